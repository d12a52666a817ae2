"""Beltrami coefficients: how far a piecewise linear map is from conformal, and in which direction.

Also the reverse, from coefficients to a map: the generalised Laplacian and the linear Beltrami
solver (Lui, Lam, Wong & Gu 2013).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.laplacian import double_areas, half_cotangents, laplacian_of_weights
from cembench.conformal.planar import signed_areas
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.blocks import in_blocks
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed

#: A triangle with 1 - abs(mu) below this is collapsed: its coefficient has no correct digits.
COLLAPSED = 1e-8


def beltrami_coefficients(uv: Complex, F: Indices, V: Real) -> Complex:
    """Return mu (m,) of the map that takes each planar triangle ``uv[F]`` to ``V[F]``.

    V is (n, 2) or (n, 3). With the first fundamental form E, F, G of that map, ``mu = (E - G + 2 i
    F) / (E + G + 2 sqrt(EG - F^2))``, where the root has the sign of the planar area: ``|mu| < 1``
    if the orientation is kept, ``|mu| > 1`` if the triangle is folded, NaN if the planar triangle
    has no area.
    """
    area = signed_areas(uv, F)
    E, G, mixed = _first_fundamental_form(uv, F, V, area)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = np.sign(area) * np.sqrt(np.maximum(E * G - mixed**2, 0.0))
        mu: Complex = (E - G + 2j * mixed) / (E + G + 2 * root)
    return mu


def dilatations(uv: Complex, F: Indices, V: Real) -> Real:
    """Return the ratio of the largest to the smallest stretch of each triangle (m,), at least 1.

    Infinite if an image has no area. The map is that between ``uv[F]`` and ``V[F]``. The ratio is
    ``(1 + |mu|) / |1 - |mu||``, with mu as in :func:`beltrami_coefficients`, computed as
    ``(1 + |mu|)^2 / (1 - |mu|^2)`` with the ratio of the areas as the root. No nearly equal numbers
    are subtracted, so slivers cost no digits.
    """
    return in_blocks(lambda some: _dilatations(uv, some, V), F)


def _dilatations(uv: Complex, F: Indices, V: Real) -> Real:
    area = signed_areas(uv, F)
    E, G, mixed = _first_fundamental_form(uv, F, V, area)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = double_areas(V, F) / (2 * np.abs(area))
        whole = E + G + 2 * root
        modulus = np.hypot(E - G, 2 * mixed) / whole
        dilatations = (1 + modulus) ** 2 * whole / (4 * root)
    return np.where(np.isnan(dilatations), np.inf, dilatations)


def _first_fundamental_form(
    uv: Complex, F: Indices, V: Real, area: Real
) -> tuple[Real, Real, Real]:
    """Return E, G, F of the map that takes triangles of these signed areas to ``V[F]``."""
    # The gradient of a corner's hat function is i times the opposite edge over twice the area.
    dx = np.zeros((len(F), V.shape[1]))
    dy = np.zeros_like(dx)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for c in range(3):
            ahead, behind = (uv.take(F[:, (c + k) % 3]) for k in (1, 2))
            gradient = 1j * (behind - ahead) / (2 * area)
            corner = V.take(F[:, c], axis=0)
            dx += gradient.real[:, None] * corner
            dy += gradient.imag[:, None] * corner
        E, G = np.einsum("td,td->t", dx, dx), np.einsum("td,td->t", dy, dy)
        mixed = np.einsum("td,td->t", dx, dy)
    return E, G, mixed


def unfolded(mu: Complex) -> Complex:
    """Return mu after reversing folded triangles: ``1 / conj(mu)`` where ``|mu| > 1``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.abs(mu) > 1, 1 / np.conj(mu), mu)


def generalised_weights(uv: Complex, F: Indices, mu: Complex) -> Real:
    """Return the edge weights (m, 3) for which maps with coefficients mu are harmonic.

    Weights belong to the opposite edges. They assemble (`laplacian_of_weights`) into the
    generalised Laplacian, the stiffness matrix of ``-div(A grad)`` on the planar triangles
    ``uv[F]``, with ``A = [[a, b], [b, c]]``, ``a = |1 - mu|^2 / d``, ``b = -2 Im mu / d``, ``c = |1
    + mu|^2 / d`` and ``d = 1 - |mu|^2``; mu = 0 gives half the cotangents of the plane. A folded
    triangle uses its coefficient `unfolded`, which keeps A positive. Not finite if a planar
    triangle has no area or ``|mu| = 1``.
    """
    mu = unfolded(mu)
    edge = [uv[F[:, (c + 2) % 3]] - uv[F[:, (c + 1) % 3]] for c in range(3)]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        double_area = np.abs((np.conj(edge[0]) * edge[1]).imag)
        scale = 1 / (2 * double_area * (1 - np.abs(mu) ** 2))
        # n.An = |e + mu conj(e)|^2 / d for the normal n = i e of an edge e; polarised.
        e = [edge[c] + mu * np.conj(edge[c]) for c in range(3)]
        weights = [-scale * (np.conj(e[(c + 1) % 3]) * e[(c + 2) % 3]).real for c in range(3)]
    return np.stack(weights, axis=1)


def weights_of_map(uv: Complex, F: Indices, mu: Complex, V: Real) -> Real:
    """Return `generalised_weights` for the coefficients mu of the map from ``uv[F]`` to ``V[F]``.

    Dirichlet's energy is conformally invariant, so these are half the cotangents of V for any uv.
    If a planar triangle has collapsed, so that mu has no correct digits, that limit is used.
    """
    weights = generalised_weights(uv, F, mu)
    with np.errstate(invalid="ignore"):
        usable = 1 - np.abs(unfolded(mu)) > COLLAPSED
    lost = np.flatnonzero(~(usable & np.isfinite(weights).all(axis=1)))
    weights[lost] = half_cotangents(V, F[lost])
    return weights


def linear_beltrami_solver(
    F: Indices, weights: Real, fixed: Indices, values: NDArray[Any]
) -> NDArray[Any]:
    """Return the map with given Beltrami coefficients and given values at some vertices.

    The coefficients are met in the least squares sense: the map is harmonic for the generalised
    Laplacian, whose matrix is symmetric positive definite once a vertex is fixed.

    Parameters
    ----------
    F : int64 (m, 3)
        Triangles; they use the vertices 0 to n - 1.
    weights : float64 (m, 3)
        From `generalised_weights`.
    fixed : int64 (k,)
        Fixed vertices.
    values : float or complex (k,)
        Their images.

    Returns
    -------
    float or complex (n,)
        The image of each vertex.

    Raises
    ------
    AlgorithmFailed
        The weights are not finite, or the matrix is not positive definite.
    """
    bad = np.flatnonzero(~np.isfinite(weights).all(axis=1))
    if len(bad):
        raise AlgorithmFailed(
            f"{len(bad)} of {len(F)} triangles have collapsed in the plane (the first is number "
            f"{bad[0]}), so the generalised Laplacian has no coefficients there"
        )
    with phase("assembly"):
        A = laplacian_of_weights(F, weights, int(F.max()) + 1)
    return harmonic_extension(A, fixed, values)
