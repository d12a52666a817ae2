"""The poly-annulus conformal map of 2021, with its author's program."""
