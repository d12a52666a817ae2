"""Files in, files with UVs out: several surfaces side by side, textures, geometry images."""
