"""The figures of given UVs, in words, as data and as a picture."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cembench.api.parameterize import parameterize
from cembench.conformal.atlas import CutMap, cut_map, metrics_of
from cembench.conformal.metrics import angle_errors, surface_areas
from cembench.conformal.planar import signed_areas
from cembench.conformal.texel_density import density_words, texel_density_ratio, texture_words
from cembench.conformal.uv_quality import UV_METRICS, Place, UvFigures, by_island, worst_places
from cembench.core.arrays import Indices, Real
from cembench.core.errors import CembenchError, MeshError
from cembench.core.reporter import Reporter
from cembench.core.wording import counted
from cembench.mesh.topology import components
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.running.given_uvs import surface_and_uv
from cembench.running.surfaces import load_surface

#: Maximum number of pieces that are mapped anew, the largest first.
MAX_PIECES = 50
#: Share of the surface that must be mapped anew for a comparison.
COMPARABLE = 0.95
#: What is mapped anew.
ISLANDS, WHOLE = "the same islands", "the surface without seams"
#: Overlaps of this share of the image are of rounding, or of single folds.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Best:
    """The best map of the same islands, or of the surface without seams.

    Parameters
    ----------
    angle_error_mean_deg : float
        Mean angle error in degrees, over all triangles that were mapped.
    texel_density_ratio : float
        Largest over smallest texel density, in one texture where islands get the area they have on
        the surface.
    share : float
        Share of the surface that was mapped.
    """

    angle_error_mean_deg: float
    texel_density_ratio: float
    share: float


@dataclass(frozen=True)
class Measurement:
    """The figures of given UVs.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    cut : CutMap
        The surface cut along the seams, with its islands.
    metrics : mapping of str to float
        Figures by name: those of every map, islands and seams, overlaps, tiles, stretch. None if
        one is infinite.
    islands : tuple of mapping
        The same of each island, in the order of their numbers.
    worst : tuple of Place
        The triangles of the largest dilatation, apart from each other.
    notices : tuple of str
        What was left out, and what the UVs lack.
    best : mapping of str to Best
        With `against`: the best map of "the same islands" and of "the surface without seams", if
        one was found.

    Examples
    --------
    >>> import cembench
    >>> mesh = cembench.surface("flat-disk", 400)
    >>> cembench.measure(mesh, mesh.V[:, :2] / 4 + 0.5).verdict[:24]
    '1 island, mean angle err'
    """

    mesh: TriangleMesh
    cut: CutMap
    metrics: Mapping[str, float | int | None]
    islands: tuple[Mapping[str, Any], ...]
    worst: tuple[Place, ...]
    notices: tuple[str, ...] = ()
    best: Mapping[str, Best] = field(default_factory=dict)

    @cached_property
    def verdict(self) -> str:
        """The figures in one sentence, and what seams bought and a better solver would gain."""
        return " ".join([_sentence(self), *([_compared(self)] if self.best else [])])

    def as_dict(self) -> dict[str, Any]:
        """Return everything as data for JSON."""
        best = {name: asdict(one) for name, one in self.best.items()}
        return {
            "surface": self.mesh.name,
            "verdict": self.verdict,
            **self.metrics,
            "worst": [asdict(place) for place in self.worst],
            "best": best,
            "notices": list(self.notices),
            "by_island": [dict(one) for one in self.islands],
        }

    def plot(self, path: str | os.PathLike[str]) -> Path:
        """Draw the surface and its UVs, coloured by the angle error, into a PNG file."""
        from cembench.drawing.preview import write_distortion
        from cembench.drawing.scene import folded_by

        folded = folded_by(self.cut.uv, self.cut.surface.F)
        words = (self.mesh.name, self.verdict)
        write_distortion(self.cut.surface, self.cut.given, folded, Path(path), words)
        return Path(path)

    def __repr__(self) -> str:
        return f"<Measurement of {self.mesh.name}: {self.verdict}>"


def measured(
    surface: Any, more: Sequence[ArrayLike], reporter: Reporter, *, against: bool
) -> Measurement:
    """Return the figures of UVs; the arguments are those of :func:`cembench.measure`."""
    mesh, corners, notices = surface_and_uv(surface, more)
    figures = UvFigures(cut_map(mesh, corners))
    with np.errstate(all="ignore"):
        values = metrics_of(figures, UV_METRICS)
        islands = tuple(by_island(figures))
        worst = worst_places(figures)
    metrics = {name: value if np.isfinite(value) else None for name, value in values.items()}
    best = _best(figures, mesh, reporter) if against else {}
    return Measurement(mesh, figures.cut, metrics, islands, worst, notices, best)


def _best(figures: UvFigures, mesh: TriangleMesh, reporter: Reporter) -> dict[str, Best]:
    """Map the islands, and the surface without seams, anew."""
    with reporter.busy("mapping the islands anew") as say:
        cut = figures.cut
        islands = _mapped(cut.surface, cut.island, figures.areas)
        say("mapping the surface without seams")
        whole = _mapped(mesh, components(mesh.F, mesh.n)[1][mesh.F[:, 0]], figures.areas)
    return {name: one for name, one in ((ISLANDS, islands), (WHOLE, whole)) if one is not None}


def _mapped(mesh: TriangleMesh, piece: Indices, areas: Real) -> Best | None:
    """Map the largest pieces of a surface, given by each triangle's number (m,)."""
    errors, spaces, images = list[Real](), list[Real](), list[Real]()
    for number in np.argsort(-np.bincount(piece, areas))[:MAX_PIECES]:
        used, F = np.unique(mesh.F[piece == number], return_inverse=True)
        arrays = (mesh.V[used], F.reshape(-1, 3))
        try:
            try:
                one: TriangleMesh = load_surface(arrays)
            except MeshError:
                one = load_surface(arrays, cut=True)
            found = parameterize(one, check="fast")
        except CembenchError:
            continue  # not mapped, which the share says
        errors.append(angle_errors(found.mesh, found.z).mean(axis=1))
        spaces.append(surface_areas(found.mesh))
        image = signed_areas(found.z, found.mesh.F)
        images.append(image * (spaces[-1].sum() / image.sum()))
    if not errors:
        return None
    space = np.concatenate(spaces)
    return Best(
        float(np.concatenate(errors).mean()),
        texel_density_ratio(space, np.concatenate(images)),
        float(space.sum() / areas.sum()),
    )


def _overlap(m: Mapping[str, float | int | None], where: str) -> str:
    if (share := m[f"overlap_{where}_islands"]) is None:
        return f"overlaps {where} islands cannot be told"
    return f"{100 * share:.2g} % of the image overlaps {where} islands" if share > ROUNDING else ""


def _coverage(m: Mapping[str, float | int | None], islands: int) -> str:
    """Return how much of the texture is used; where it repeats, a share would say nothing."""
    if beyond := m["islands_beyond_their_tile"]:
        of = counted(islands, "island")
        return f"{beyond} of {of} beyond one tile, where the texture repeats"
    if m["covered_share"] is None:
        return ""
    tiles = m["tiles"] or 1
    square = "the square" if tiles == 1 else f"{tiles} tiles"
    return f"{100 * m['covered_share']:.0f} % of {square} covered"


def _sentence(found: Measurement) -> str:
    """Return what the UVs are in a sentence."""
    m = found.metrics
    parts = [
        counted(found.cut.islands, "island"),
        f"mean angle error {m['angle_error_mean_deg'] or 0:.2f} degrees",
        counted(int(folds), "fold") if (folds := m["flipped_triangles"]) else "no folds",
        *(_overlap(m, where) for where in ("inside", "between")),
        texture_words(m),
        _coverage(m, found.cut.islands),
    ]
    return ", ".join(filter(None, parts)) + "."


def _compared(found: Measurement) -> str:
    """Return in a sentence what seams bought, and what a better solver would gain."""
    here = found.metrics["angle_error_mean_deg"] or 0.0
    texts = [
        f"the best map of {name} has {one.angle_error_mean_deg:.2f} degrees and "
        f"{density_words(one.texel_density_ratio)}"
        + (f" (of {one.share:.0%} of the surface)" if one.share < 0.995 else "")
        for name, one in found.best.items()
    ]
    text = " and ".join(texts)
    whole = [name for name, one in found.best.items() if one.share >= COMPARABLE]
    if ISLANDS in whole:
        least = found.best[ISLANDS].angle_error_mean_deg
        text += f": a better solver would gain {max(here - least, 0):.2f} degrees"
        if WHOLE in whole and len(found.cut.seams):
            bought = found.best[WHOLE].angle_error_mean_deg - least
            text += f", and the seams buy {bought:.2f}"
    return text[0].upper() + text[1:] + "."
