"""External programs and foreign libraries, run and measured as algorithms."""
