"""Writers, one mesh format per file: from a surface with texture coordinates to bytes."""
