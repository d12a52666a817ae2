"""Meshes, their files, and the linear algebra that all algorithms share."""
