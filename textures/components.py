"""Files with several surfaces, whose shells are mapped one by one and share the unit square."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cembench.core.arrays import Complex, Indices, Real, numbered
from cembench.core.errors import MeshError
from cembench.mesh.defects import Defect, UnusableMeshError, repair_advice
from cembench.mesh.files import read_soup
from cembench.mesh.plausibility import implausible
from cembench.mesh.soup import Soup
from cembench.mesh.topology import components
from cembench.registry import Algorithm, Registry
from cembench.running.foreign_meshes import soup_of
from cembench.running.surfaces import (
    SurfaceFile,
    generate_surface,
    is_generated,
    kinds_of,
    prepared,
)

#: Maximum number of surfaces in a file.
MOST = 1000
#: A file whose surfaces have fewer triangles on average is a soup that may need welding.
_FEW = 4
#: Defects that belong to a single surface; others concern the whole file.
_OF_SHELLS = {Defect.components, Defect.closed, Defect.holes, Defect.no_hole, Defect.handles}


@dataclass(frozen=True)
class Shells:
    """The surfaces of a file.

    Parameters
    ----------
    path : Path
        The file.
    V, F : float64 (n, 3), int64 (m, 3)
        The whole file, with polygons cut into triangles.
    parts : tuple of SurfaceFile
        The shells; one if the file is a single surface.
    vertices : tuple of int64 (n_i,)
        Vertex numbers of each shell in the whole file.
    faces : tuple of int64 (m_i,)
        Triangle numbers of each shell in the whole file.
    """

    path: Path
    V: Real
    F: Indices
    parts: tuple[SurfaceFile, ...]
    vertices: tuple[Indices, ...]
    faces: tuple[Indices, ...]
    #: Whether the file's content, with other texture coordinates, is that of the surfaces.
    as_read: bool = True

    def joined(self, maps: Sequence[Complex]) -> tuple[Complex, Indices | None]:
        """Return the images of all surfaces as one array, per corner where surfaces were cut.

        Returns
        -------
        uv : complex128 (k,)
            Entry i is the image of vertex i; further entries are copies made by cuts.
        corners : int64 (m, 3), optional
            The entry of each corner, if surfaces were cut.
        """
        uv, copies = np.zeros(len(self.V), np.complex128), []
        corners, size = self.F.copy(), len(self.V)
        for part, z, own, faces in zip(self.parts, maps, self.vertices, self.faces, strict=True):
            uv[own] = z[: len(own)]
            copies.append(z[len(own) :])
            number = np.concatenate([own, size + np.arange(len(copies[-1]))])
            corners[faces] = number[part.mesh.F]
            size += len(copies[-1])
        is_cut = any(part.cut for part in self.parts)
        return np.concatenate([uv, *copies]), corners if is_cut else None


def read_shells(
    path: Path,
    registry: Registry,
    algorithms: Sequence[Algorithm],
    *,
    mend: bool = False,
    cut: bool = False,
) -> Shells:
    """Read the surfaces of a file, or generate one, each of a kind that the algorithms take.

    Triangles that are connected, even at a single vertex, are one surface. With `mend`, only the
    largest surface is kept.

    Raises
    ------
    MeshError
        The file cannot be read, or one of its surfaces is not of such a kind.
    """
    kinds, name = kinds_of(algorithms), str(path)
    generated = is_generated(name, registry)
    soup = soup_of(generate_surface(registry, name)) if generated else read_soup(path)
    if not (generated or mend):
        soup = replace(soup, notices=soup.notices + implausible(soup.V, soup.triangles))
    if mend:
        mended = prepared(soup, kinds, path, repair=True, cut=cut)
        mesh = mended.mesh.noted(implausible(mended.mesh.V, mended.mesh.F, sheets=False))
        return _alone(replace(mended, mesh=mesh))
    try:
        return _alone(prepared(soup, kinds, path, cut=cut), None if generated else soup)
    except UnusableMeshError as error:
        if {problem.defect for problem in error.problems} - _OF_SHELLS:
            raise
        pieces = _split(soup)
        if len(pieces) < 2 or (
            len(soup.triangles) < _FEW * len(pieces) and error.options.get("weld")
        ):
            raise
        if len(pieces) > MOST:
            raise MeshError(
                f"{path} holds {len(pieces):,} surfaces; up to {MOST:,} of a file are mapped at "
                f"once. {repair_advice(path, {'components': 'all'})} writes each to a file of its "
                "own."
            ) from None
    parts = []
    for k, (own, held) in enumerate(pieces):
        number = numbered(len(soup.V), own)
        name = f"{soup.name} {k + 1}"
        F = number[soup.triangles[held]]
        shell = Soup.of_triangles(soup.V[own], F, name=name, notices=soup.notices)
        try:
            parts.append(prepared(shell, kinds, path, cut=cut))
        except MeshError as error:
            where = (
                f"surface {k + 1} of the {len(pieces)} in this file, with vertex {own[0]} and "
                f"{len(held)} triangles (the following numbers count within this surface)"
            )
            if isinstance(error, UnusableMeshError):
                error.where = where
                raise
            raise MeshError(f"{where}: {error}") from None
    vertices, faces = zip(*pieces, strict=True)
    return Shells(path, soup.V, soup.triangles, tuple(parts), vertices, faces)


def _alone(file: SurfaceFile, soup: Soup | None = None) -> Shells:
    """Return a file with one surface; a soup may have vertices besides, which are kept."""
    mesh = file.uncut or file.mesh
    V, own = mesh.V, np.arange(mesh.n)
    if soup is not None and len(soup.V) > mesh.n:
        V, own = soup.V, np.unique(soup.corners)
    every = (np.arange(mesh.m),)
    return Shells(file.path, V, own[mesh.F], (file,), (own,), every, file.repaired is None)


def _split(soup: Soup) -> list[tuple[Indices, Indices]]:
    """Return the vertices and triangles of each surface."""
    F, used = soup.triangles, np.unique(soup.triangles)
    label = components(F, len(soup.V))[1]
    vertices, faces = (_grouped(of) for of in (label[used], label[F[:, 0]]))
    return [(used[own], held) for own, held in zip(vertices, faces, strict=True)]


def _grouped(labels: Indices) -> list[Indices]:
    """Return the places of each label, by label."""
    ends = np.cumsum(np.unique(labels, return_counts=True)[1])
    return np.split(np.argsort(labels, kind="stable"), ends[:-1])
