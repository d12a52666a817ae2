"""The linear disk conformal map of 2018."""
