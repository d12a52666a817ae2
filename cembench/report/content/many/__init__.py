"""What a run over many surfaces shows instead of a page for each."""
