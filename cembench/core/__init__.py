"""What everything else stands on: errors, the clock, whole files, what an algorithm returns."""
