"""The figures of a report, one per file; each turns records into plot data."""
