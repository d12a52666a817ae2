"""Basics that every other room uses: errors, the phase clock, atomic files, return types."""
