"""Generated surfaces, one family per file, found by the entry points ``cembench.surfaces``."""
