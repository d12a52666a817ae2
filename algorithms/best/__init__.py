"""The best map of several algorithms."""
