"""Measure the cells of a plan, each in its own process, and return records."""
