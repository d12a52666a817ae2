"""Surface morphing (Section 6 of the paper): from conformal maps to a path between surfaces."""
