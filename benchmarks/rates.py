"""Does the spectrum of K predict how fast CEM's iteration converges?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cembench.papers.cem.boundary_operator import BoundaryOperator, predicted_rate, trajectory

from benchmarks.disks import disk_of
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table

LAYOUT = """
| surface | triangles | predicted | measured, (23) | measured, (30) |
|---|---:|---:|---:|---:|
| {surface} | {faces:,} | {predicted:.4f} | {plain:.4f} | {inverted:.4f} |"""


def rates(surfaces: Sequence[str], *, iterations: int = 200) -> Section:
    """Compare the rate that the eigenvalues of K predict with that of the iterations (23) and (30).

    Surfaces are mesh files, or NAME@TRIANGLES for generated ones. Rates are those at the end of
    `iterations` steps: where they converge slowly the first ones are still faster.
    """
    rows = [row(one, iterations) for one in progress(surfaces)]
    return Section([Table(rows, LAYOUT), f"After {iterations} steps."], "docs/theory.md")


def row(name: str, iterations: int) -> dict[str, Any]:
    """Return a surface's predicted and measured rates."""
    mesh = disk_of(name)
    K = BoundaryOperator(mesh)
    plain, inverted = (
        trajectory(K, iterations, inversion=inversion).rate for inversion in (False, True)
    )
    predicted = predicted_rate(K.leading_eigenpairs()[0])
    return {
        "surface": mesh.name,
        "faces": mesh.m,
        "predicted": predicted,
        "plain": plain,
        "inverted": inverted,
    }
