"""What a report says of a run: one table or figure a file, all of it out of the run's records."""
