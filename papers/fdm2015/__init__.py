"""The fast disk conformal map of 2015, with its authors' program."""
