"""Pictures of a surface and of its map."""
