"""Surface morphing through conformal maps (Section 6 of the paper)."""
