"""Minimise the conformal energy of harmonic maps to a circle domain over the boundary positions.

A map that is harmonic inside has E_C = z^* S z / 2 - A(z), with z its boundary values, S the
Dirichlet-to-Neumann matrix and A the area of the boundary polygons (Eqs. 5, 7, 8). The unknowns are
the angle of every vertex on its circle, and the centre and radius of every hole. With
G = S z - grad A, where grad A at vertex j is -(i/2) (z_next - z_previous), E_C = Re(z^* G) / 2, its
derivative along dz is Re(dz^* G), and the second derivative is Re(dz^* (S - A'') dz) +
Re(G^* d^2 z). So Newton steps can be taken.

S and its inverse cost B^2 operations for B boundary vertices. S is also the preconditioner: on the
disk the Hessian's Fourier mode k has ``|k| - 1`` where S has ``|k|``.

The Moebius maps of the disk preserve conformality, but the energy of a polygon only nearly. They
are therefore held fixed by a *gauge*: weights w with sum 1 for which sum w z = 0.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cembench.conformal.circle_domain import CircleDomain
from cembench.conformal.dirichlet_to_neumann import DirichletToNeumann
from cembench.conformal.trust_region import newton_step
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed

#: Fourier modes from 2 to this one have the Hessian's own weight in the preconditioner.
MODES = 8
#: A predicted decrease below this, times the number of boundary vertices, is rounding.
ROUNDING = 1e-16
#: With more arcs than this held at their minimal length, the boundary is too crowded.
MAX_HELD = 64
#: Relative residual at which CG ends a Newton step. Products are cheap, and with coarser steps
#: crowded circles need ten times as many.
ACCURACY = 0.01, 0.03
#: Curvatures of radii and centres are at least this share of the largest one.
MIN_CURVATURE = 1e-12
#: Tolerance for sum w z = 0, and the maximal number of Newton steps for it.
GAUGE_ACCURACY, GAUGE_STEPS = 1e-13, 50


@dataclass(frozen=True)
class Minimum:
    """The result of a minimisation.

    Attributes
    ----------
    model : EnergyModel
        The model at the minimiser.
    energies : tuple of float
        E_C at the start and after every step.
    gradient : float
        The gradient's norm, whose square is about twice what E_C could still decrease.
    reason : str
        Why the iteration ended: "gradient" (it is small enough), "rounding" (no further decrease in
        floating point), "iterations", or "crowded" (more than `MAX_HELD` arcs at their minimal
        length; `gradient` is then NaN).
    products : int
        Number of products with the Hessian.
    held_arcs : int
        Number of arcs that would have to become shorter than allowed to decrease E_C further.
    """

    model: EnergyModel
    energies: tuple[float, ...]
    gradient: float
    reason: str
    products: int
    held_arcs: int


def minimise(
    S: DirichletToNeumann,
    start: CircleDomain,
    weights: Real,
    *,
    tolerance: float,
    max_iterations: int,
) -> Minimum:
    """Minimise the conformal energy over boundaries on circles, in the gauge `weights` (B,).

    Ends when E_C can decrease by at most a relative `tolerance`. The result is never above the
    energy of the start, which is moved into the gauge first.

    Raises
    ------
    AlgorithmFailed
        The gauge cannot be reached.
    """
    model = EnergyModel(S, in_gauge(start, weights), weights)
    energies, radius, products = [model.energy], 1.0, 0
    while True:
        if len(model.held) > MAX_HELD:
            reason = "crowded"
            break
        if model.gradient_norm**2 <= 2 * tolerance * model.energy:
            reason = "gradient"
            break
        if len(energies) > max_iterations:
            reason = "iterations"
            break
        with phase("boundary step"):
            accuracy = float(np.clip(model.gradient_norm, *ACCURACY))
            step = newton_step(
                model.gradient, model.uphill, model.hessian, model.precondition, radius, accuracy
            )
        products += step.products
        if not step.decrease >= ROUNDING * len(weights):
            reason = "rounding"
            break
        there = _tried(model, step.p)
        agreement = (model.energy - there.energy) / step.decrease if there else -np.inf
        if agreement > 0.75 and step.at_edge:
            radius *= 3
        elif not agreement > 0.25:
            radius = step.length / 4
        if there and agreement > 1e-4 and there.energy < model.energy:
            model = there
            energies.append(model.energy)
    gradient = float("nan") if reason == "crowded" else model.gradient_norm
    return Minimum(model, tuple(energies), gradient, reason, products, len(model.held))


def moebius_descent(here: EnergyModel, max_modulus: float) -> complex:
    """Return the a, ``|a| <= max_modulus``, whose Moebius map of the disk lowers the energy most.

    The map is z -> (z - a) / (1 - conj(a) z). By the second-order model of E_C in a: z moves by
    ``-a + conj(a) z^2 - |a|^2 z + conj(a)^2 z^3 + ...``.
    """
    z, G = here.domain.points, here.residual
    squared = z * z
    fields = np.stack([squared - 1, -1j * (squared + 1)], axis=1)  # for real and imaginary a
    g = np.real(np.conj(fields).T @ G)
    H = np.real(np.conj(fields).T @ here.residual_of(fields))
    once, cubed = complex(np.vdot(z, G)), complex(np.vdot(squared * z, G))
    across = -2 * cubed.imag
    H += [[2 * (cubed - once).real, across], [across, -2 * (cubed + once).real]]
    # In units of the max_modulus: the model's minimum in the unit disk (More and Sorensen 1983).
    curvatures, axes = np.linalg.eigh(max_modulus**2 * (H + H.T) / 2)
    first, second = map(float, max_modulus * (axes.T @ g))
    low_curvature, high_curvature = map(float, curvatures)

    def minimum(shift: float) -> tuple[float, float]:
        return first / (low_curvature + shift), second / (high_curvature + shift)

    rounding = sys.float_info.epsilon * max(map(abs, (low_curvature, high_curvature)))
    low = max(0.0, -low_curvature) + rounding + sys.float_info.min
    if math.hypot(*minimum(low)) > 1:
        high = low + math.hypot(first, second)
        for _ in range(60):
            middle = (low + high) / 2
            outside = math.hypot(*minimum(middle)) > 1
            low, high = (middle, high) if outside else (low, middle)
        low = high
    return -max_modulus * complex(*(axes @ minimum(low)))


def _tried(here: EnergyModel, step: Real) -> EnergyModel | None:
    """Return the model after a step, or None if circles meet or the gauge is lost."""
    domain = here.moved(step)
    if not domain.apart:
        domain = domain.apart_from(here.domain)
    if not domain.apart:
        return None
    try:
        return here.at(in_gauge(domain, here.weights))
    except AlgorithmFailed:
        return None


def in_gauge(domain: CircleDomain, weights: Real) -> CircleDomain:
    """Return the Moebius image of a domain for which sum w z = 0.

    Raises
    ------
    AlgorithmFailed
        Newton's method does not converge: a single vertex has too much of the weight.
    """
    for _ in range(GAUGE_STEPS):
        a = _to_gauge(domain.points, weights)
        if a == 0:
            return domain
        domain = domain.through(a)
    mean = abs(weights @ domain.points)
    raise AlgorithmFailed(
        f"no Moebius map of the disk brings the gauge's mean to 0 (it stays at {mean:.2g}): "
        "a single boundary vertex has too much of the weight. Choose another gauge"
    )


def _to_gauge(points: Complex, weights: Real) -> complex:
    """Return a, |a| <= 0.5, such that z -> (z - a) / (1 - conj(a) z) decreases sum w z.

    By Newton's method on the points alone; 0 if nothing is left to do.
    """
    a, z = 0j, points
    for _ in range(GAUGE_STEPS):
        middle, second = complex(weights @ z), complex(weights @ (z * z))
        if abs(middle) < GAUGE_ACCURACY:
            break
        # A small b moves sum w z by -b + conj(b) sum w z^2.
        bottom = 1 - abs(second) ** 2
        b = (middle + second * middle.conjugate()) / bottom if bottom > 0 else middle
        b *= min(1.0, 0.5 / abs(b))
        a = (a + b) / (1 + a.conjugate() * b)
        if abs(a) > 0.5:
            return a * (0.5 / abs(a))
        z = (points - a) / (1 - a.conjugate() * points)
    return a


class EnergyModel:
    """E_C at a domain, with gradient, Hessian and preconditioner on steps that keep the gauge.

    A step is a real vector: the motion of every vertex along its circle (B), then for the holes the
    growth of the radii and the motion of the centres to the right and up.
    """

    def __init__(self, S: DirichletToNeumann, domain: CircleDomain, weights: Real) -> None:
        self.S, self.domain, self.weights = S, domain, weights
        with phase("energy"):
            self.residual = self.residual_of(domain.points)
            self.energy = 0.5 * float(np.vdot(domain.points, self.residual).real)

    def at(self, domain: CircleDomain) -> EnergyModel:
        """Return the model at another domain."""
        return EnergyModel(self.S, domain, self.weights)

    def residual_of(self, z: Complex) -> Complex:
        """Return (S - A'') z for z (B,) or (B, k)."""
        rims = self.domain.rims
        return self.S(z) + 0.5j * (z[rims.following] - z[rims.previous])

    @cached_property
    def _along(self) -> Complex:
        """The derivative of z with respect to each vertex's motion along its circle, (B,)."""
        return 1j * self.domain.directions

    @cached_property
    def _holes(self) -> Complex | None:
        """The derivative of z with respect to each radius and centre (right, up), (B, 3 holes)."""
        rims = self.domain.rims
        if not len(rims.holes):
            return None
        inside = rims.loop[:, None] == rims.holes
        grow = inside * self.domain.directions[:, None]
        return np.concatenate([grow, inside.astype(complex), 1j * inside], axis=1)

    def _velocity(self, x: Real) -> Complex:
        """Return the dz of a step."""
        B = len(self._along)
        moved = self._along * x[:B]
        return moved if self._holes is None else moved + self._holes @ x[B:]

    def _pulled_back(self, u: Complex) -> Real:
        """Return Re(dz^* u) as a linear function of the step."""
        along = (self._along.conj() * u).real
        if self._holes is None:
            return along
        return np.concatenate([along, np.real(np.conj(self._holes).T @ u)])

    def moved(self, x: Real) -> CircleDomain:
        """Return the domain after a step."""
        domain, holes, B = self.domain, self.domain.rims.holes, len(self._along)
        growth, shift = np.zeros_like(domain.radii), np.zeros_like(domain.centres)
        grown, right, up = x[B:].reshape(3, -1)
        growth[holes], shift[holes] = grown, right + 1j * up
        return domain.moved(x[:B], growth, shift)

    @cached_property
    def gradient(self) -> Real:
        """The derivative of E_C along each entry of a step."""
        return self._pulled_back(self.residual)

    @cached_property
    def _outward(self) -> Real:
        """The radial component of the residual, divided by the radius, (B,)."""
        return (self.residual.conj() * self.domain.directions).real / self.domain.radius

    def hessian(self, x: Real) -> Real:
        """Return the second derivative of E_C applied to a step."""
        domain, rims = self.domain, self.domain.rims
        B, h = len(domain.arcs), len(rims.holes)
        result = self._pulled_back(self.residual_of(self._velocity(x)))
        # d^2 z = exp(i theta) (-dx^2 + 2 i dx dr) / r
        result[:B] -= self._outward * x[:B]
        if h:
            turning = self.gradient[:B] / domain.radius
            grown = np.zeros(h + 1)
            grown[rims.holes] = x[B : B + h]
            result[:B] += turning * grown[rims.loop]
            result[B : B + h] += rims.sums(turning * x[:B])[rims.holes]
        return result

    @cached_property
    def _modes(self) -> tuple[Real, Real]:
        """Fourier modes on the outer circle, and the excess of 1 / (|k| - 1) over 1 / |k|."""
        domain, k = self.domain, np.arange(2, MODES + 1)
        base = np.where(domain.rims.on_outer, domain.directions, 0)
        powers = np.multiply.accumulate(np.broadcast_to(base, (MODES, len(base))))[1:].T
        weights = 1 / (np.pi * k * (k - 1))
        return np.concatenate([powers.real, powers.imag], axis=1), np.tile(weights, 2)

    @cached_property
    def _hole_block(self) -> Real:
        """The inverse of the Hessian's block of radii and centres."""
        assert self._holes is not None
        block = np.real(np.conj(self._holes).T @ self.residual_of(self._holes))
        values, vectors = np.linalg.eigh((block + block.T) / 2)
        values = np.maximum(values, MIN_CURVATURE * values[-1])
        return np.asarray(vectors / values @ vectors.T)

    def _unconstrained(self, g: Real) -> Real:
        """Return M^-1 g for g (N,) or (N, k)."""
        B = len(self._along)
        modes, weights = self._modes
        along = self.S.inverse(g[:B]) + (modes * weights) @ (modes.T @ g[:B])
        if len(g) == B:
            return along
        return np.concatenate([along, self._hole_block @ g[B:]])

    @cached_property
    def _gauge(self) -> tuple[Real, Real, Real]:
        """The constraints of the gauge, as :meth:`_constrained` returns them."""
        rims, mean = self.domain.rims, self.weights * self._along
        turn = rims.on_outer / rims.sizes[rims.outer]
        if self._holes is not None:
            mean = np.concatenate([mean, self.weights @ self._holes])
            turn = np.concatenate([turn, np.zeros(self._holes.shape[1])])
        return self._constrained(np.stack([mean.real, mean.imag, turn], axis=1))

    def _constrained(self, c: Real) -> tuple[Real, Real, Real]:
        """Return columns c that steps are orthogonal to, M^-1 c, and the inverse of c^T M^-1 c."""
        preconditioned = self._unconstrained(c)
        return c, preconditioned, np.asarray(np.linalg.inv(c.T @ preconditioned), dtype=np.float64)

    @cached_property
    def held(self) -> Indices:
        """The arcs that have their minimal length and would become shorter downhill."""
        rims, B = self.domain.rims, len(self.domain.arcs)
        short = self.domain.shortest(MAX_HELD)
        held, constraints = short[:0], self._gauge
        while len(short):
            downhill = -_projected(self._free_uphill, constraints)[:B]
            change = rims.sense * (downhill[rims.following] - downhill)
            more = np.setdiff1d(short[change[short] < 0], held)
            if not len(more):
                break
            held = np.union1d(held, more)  # others may become shorter once these are held
            if len(held) > MAX_HELD:
                break
            constraints = self._keeping(held)
        return held

    def _keeping(self, held: Indices) -> tuple[Real, Real, Real]:
        """The constraints of the gauge, and those that keep the length of some arcs."""
        if not len(held):
            return self._gauge
        c, k = self._gauge[0], np.arange(len(held))
        keep = np.zeros((len(c), len(k)))
        keep[self.domain.rims.following[held], k] = 1
        keep[held, k] = -1
        return self._constrained(np.concatenate([c, keep], axis=1))

    @cached_property
    def _constraints(self) -> tuple[Real, Real, Real]:
        return self._keeping(self.held)

    def precondition(self, g: Real) -> Real:
        """Return M^-1 g projected onto the steps that keep the gauge."""
        return _projected(self._unconstrained(g), self._constraints)

    @cached_property
    def _free_uphill(self) -> Real:
        return self._unconstrained(self.gradient)

    @cached_property
    def uphill(self) -> Real:
        """The preconditioned gradient."""
        with phase("boundary step"):
            return _projected(self._free_uphill, self._constraints)

    @cached_property
    def gradient_norm(self) -> float:
        """The norm of the gradient on these steps, (g M^-1 g)^(1/2)."""
        return max(0.0, float(self.gradient @ self.uphill)) ** 0.5


def _projected(x: Real, constraints: tuple[Real, Real, Real]) -> Real:
    """Project a preconditioned gradient onto the steps that satisfy the constraints."""
    c, preconditioned, inverse = constraints
    return x - preconditioned @ (inverse @ (c.T @ x))
