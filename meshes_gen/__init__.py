"""Generated surfaces, one family a file, found by the entry points ``cembench.surfaces``."""
