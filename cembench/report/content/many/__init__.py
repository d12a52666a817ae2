"""Summaries of a run over many surfaces, in place of a page for each."""
