"""The algorithms, one per file, found by the entry points ``cembench.algorithms``."""
