"""What a person sees of a run: tables, figures and pictures."""
