"""Beltrami coefficients: how far from conformal is a piecewise linear map, and which way?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.geometry.planar import signed_areas

Complex = NDArray[np.complex128]


def beltrami_coefficients(uv: Complex, F: NDArray[np.int64], V: NDArray[np.float64]) -> Complex:
    """What is mu of the map that carries each planar triangle ``uv[F]`` to ``V[F]``? Shape (m,).

    V is (n, 2) or (n, 3). From the first fundamental form E, F, G of that map,
    mu = (E - G + 2 i F) / (E + G + 2 sqrt(EG - F^2)), with the root's sign that of the planar area:
    |mu| < 1 where the orientation is kept, |mu| > 1 where the triangle is folded, NaN where the
    planar triangle has no area.
    """
    area = signed_areas(uv, F)
    # The gradient of the hat function of a corner is i times the opposite edge over 2 area.
    dx = np.zeros((len(F), V.shape[1]))
    dy = np.zeros_like(dx)
    with np.errstate(divide="ignore", invalid="ignore"):
        for c in range(3):
            gradient = 1j * (uv[F[:, (c + 2) % 3]] - uv[F[:, (c + 1) % 3]]) / (2 * area)
            dx += gradient.real[:, None] * V[F[:, c]]
            dy += gradient.imag[:, None] * V[F[:, c]]
        E, G = np.einsum("td,td->t", dx, dx), np.einsum("td,td->t", dy, dy)
        mixed = np.einsum("td,td->t", dx, dy)
        root = np.sign(area) * np.sqrt(np.maximum(E * G - mixed**2, 0.0))
        mu: Complex = (E - G + 2j * mixed) / (E + G + 2 * root)
    return mu


def dilatations_of(mu: Complex) -> NDArray[np.float64]:
    """Largest over smallest stretch, (1 + |mu|) / |1 - |mu||; infinite where mu is NaN."""
    modulus = np.nan_to_num(np.abs(mu), nan=1.0)
    with np.errstate(divide="ignore"):
        return (1 + modulus) / np.abs(1 - modulus)
