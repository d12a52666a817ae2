"""Koebe-CEM: Algorithm 2 of the paper, for surfaces with holes."""
