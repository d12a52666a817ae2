"""The algorithms, one a file, found by the entry points ``cembench.algorithms``."""
