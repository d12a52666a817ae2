"""Sparse Cholesky factorisations, their back ends, dense blocks."""
