"""Algorithms of others: libraries and programs that are run where they are on the machine."""
