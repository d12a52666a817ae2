"""Boundary first flattening, 2017, with its authors' program."""
