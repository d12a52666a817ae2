"""Boundary first flattening: to the disk, and with a free boundary."""
