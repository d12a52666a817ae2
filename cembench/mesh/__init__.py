"""Surfaces: triangle meshes, their checks, files and datasets."""
