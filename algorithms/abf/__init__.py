"""Angle based flattening: linear in one step, and ABF++ by Newton's method."""
