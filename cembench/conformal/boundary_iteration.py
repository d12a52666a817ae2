"""The steps of CEM (Algorithm 1) that do not depend on how the Dirichlet problem is solved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np

from cembench.conformal.gauge import middle_triangle
from cembench.conformal.planar import backward_arcs, polygon_area
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed

#: What ends CEM's iteration: a step that does not lower E_C by at least the tolerance, or one that
#: changes it by less, whichever way.
Stop: TypeAlias = Literal["drop", "change"]


def pole(V: Real, F: Indices, triangle: int | None = None) -> tuple[Indices, Complex]:
    """Return the right-hand side that puts a pole at a triangle in the middle (Eq. 14).

    V is (n, 2 or 3). By default the triangle is the one whose barycentre is nearest to the mean
    vertex. Returns its corners (3,) and their values (3,); all other entries are zero.
    """
    corners = middle_triangle(V, F) if triangle is None else F[triangle]
    p_a, p_b, p_c = V[corners]
    base = p_b - p_a
    alpha = np.dot(p_c - p_a, base) / np.dot(base, base)
    height = np.linalg.norm(p_c - (p_a + alpha * base))
    length = np.linalg.norm(base)
    values = [
        -1 / length + 1j * (1 - alpha) / height,
        1 / length + 1j * alpha / height,
        -1j / height,
    ]
    return corners, np.array(values)


def pole_start(
    V: Real, F: Indices, solve: Callable[[Complex], Complex], triangle: int | None = None
) -> Complex:
    """Return the boundary values of the map with a pole in the middle (Eqs. 13, 14, 18).

    `solve` returns f_b of L f = rhs (n,); `triangle` replaces the usual middle triangle.
    """
    with phase("start"):
        corners, values = pole(V, F, triangle)
        rhs = np.zeros(len(V), dtype=np.complex128)
        rhs[corners] = values
        f_b = solve(rhs)
    # The image is the outside of a curve, so the boundary runs clockwise around it.
    return np.conj(f_b) if polygon_area(f_b) < 0 else f_b


def on_circle(f_b: Complex) -> Complex:
    """Centralise and normalise boundary values (Eqs. 24, 25).

    Raises
    ------
    AlgorithmFailed
        A vertex lies at the centre.
    """
    f_b = f_b - f_b.mean()
    modulus = np.abs(f_b)
    if not modulus.min() > 0:
        raise AlgorithmFailed(
            f"boundary vertex number {int(np.argmin(modulus))} of the loop lies at the centre of "
            "the boundary, so its position on the circle is undefined (Eq. 25)"
        )
    return f_b / modulus


def inverted(f: Complex) -> Complex:
    """Return ``F / |f|^2`` (Eq. 30); zero stays zero."""
    squared = (f * np.conj(f)).real
    return np.divide(f, squared, out=np.zeros_like(f), where=squared > 0)


def iterate_boundary(
    f_b: Complex,
    dirichlet: Callable[[Complex], Complex],
    ring: Callable[[Complex], Complex],
    energy: Callable[[Complex, Complex], float],
    *,
    tolerance: float,
    max_iterations: int,
    stop: Stop,
    inversion: bool = True,
    best: bool = False,
) -> tuple[Complex, Complex, list[float], int]:
    """Return the boundary values at the end of CEM's iteration (30), (24), (25), (22).

    Parameters
    ----------
    f_b : complex (k,)
        The start, on the unit circle.
    dirichlet : callable
        Returns the values f_i that are harmonic for boundary values f_b (Eq. 22).
    ring : callable
        Returns the solution of L_bb x = -L_bi f_i for f_i (Eq. 23).
    energy : callable
        Returns E_C (Eq. 7) of f_i and f_b.
    tolerance, max_iterations : float, int
        The iteration ends after the first step that `stop` names, or after `max_iterations` steps.
    stop : {"drop", "change"}
        Whether that is a step that does not lower E_C by at least `tolerance`, so that an increase
        ends the iteration, or one that changes E_C by less than `tolerance`. With "change" and 0 no
        step ends it.
    inversion : bool
        Whether to use step (30) rather than (23). A step that would exchange boundary vertices is
        replaced by (23), and the iteration ends if (23) would do so too.
    best : bool
        Whether to return the values of least E_C, the start included, instead of the last ones.

    Returns
    -------
    f_b, f_i : complex
        The last values, or those of least E_C.
    history : list of float
        E_C at the start and after each step.
    order_kept : int
        Number of steps that were changed, or left out, to keep the boundary's order.
    """

    def step(f_i: Complex) -> Complex:
        with phase("boundary step"):
            return on_circle(ring(f_i))

    f_i = dirichlet(f_b)
    history = [energy(f_i, f_b)]
    least = f_b, f_i
    order_kept = 0
    for _ in range(max_iterations):
        following = step(inverted(f_i) if inversion else f_i)
        if backward_arcs(following) > backward_arcs(f_b):
            order_kept += 1
            following = step(f_i)
            if backward_arcs(following) > backward_arcs(f_b):
                break
        f_b = following
        f_i = dirichlet(f_b)
        history.append(energy(f_i, f_b))
        if history[-1] < min(history[:-1]):
            least = f_b, f_i
        drop = history[-2] - history[-1]
        if (drop if stop == "drop" else abs(drop)) < tolerance:
            break
    return *(least if best else (f_b, f_i)), history, order_kept
