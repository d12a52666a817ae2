"""The contents of a report, one table or figure per file, computed from a run's records."""
