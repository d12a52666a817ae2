"""Conformal geometry: Laplacian, harmonic and Moebius maps, Beltrami coefficients, metrics."""
