"""The figures of a report, one a file: from the run's records to a plot, which others draw."""
