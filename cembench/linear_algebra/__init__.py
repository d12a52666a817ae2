"""Sparse Cholesky factorisations, their back ends, and dense blocks."""
