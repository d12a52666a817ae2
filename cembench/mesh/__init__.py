"""Triangle meshes: their checks, file formats, repair, cuts and datasets."""
