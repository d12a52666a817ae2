"""Conformal equivalence of triangle meshes: to the disk, with a free boundary, and with flips."""
