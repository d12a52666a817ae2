"""Discrete conformal equivalence of polyhedral surfaces, 2021."""
