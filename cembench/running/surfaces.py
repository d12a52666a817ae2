"""Load a surface from a file, a registered name, arrays, or a mesh of any library."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, TypeGuard, TypeVar, cast

from numpy.typing import ArrayLike

from cembench.core.errors import MeshError
from cembench.core.names import did_you_mean
from cembench.mesh.cut import Cut, cut_open
from cembench.mesh.datasets import is_fetched, surface_file
from cembench.mesh.defects import located
from cembench.mesh.files import checked, mesh_names, most_special, read_soup, repaired_soup
from cembench.mesh.repair import Repaired
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import Algorithm, Registry, load_registry
from cembench.running.foreign_meshes import soup_of

M = TypeVar("M", bound=TriangleMesh)

#: A checked mesh; the path of a mesh file; the name of a generated surface, or of a public one that
#: was fetched; arrays (V, F); what :func:`cembench.running.foreign_meshes.soup_of` takes.
SurfaceInput: TypeAlias = TriangleMesh | str | os.PathLike[str] | tuple[ArrayLike, ArrayLike] | Any

#: The kinds of surface that algorithms take, the most special first.
KINDS: tuple[type[TriangleMesh], ...] = (DiskMesh, HoledMesh)


@dataclass(frozen=True)
class SurfaceFile:
    """A surface read from a file, with its repair and its cut."""

    path: Path
    #: The surface to map: that of the file, repaired and cut open if requested.
    mesh: TriangleMesh
    repaired: Repaired | None = None
    #: The surface before it was cut, and the cut.
    uncut: TriangleMesh | None = None
    cut: Cut | None = None


def load_surface(
    surface: SurfaceInput,
    kinds: Sequence[type[M]] = KINDS,  # type: ignore[assignment]
    *,
    faces: int | None = None,
    holes: bool = True,
    repair: bool = False,
    cut: bool = False,
    registry: Registry | None = None,
) -> M:
    """Load a surface from a file, a name, arrays, or a mesh of another library, and check it.

    Parameters
    ----------
    surface : path, name, pair of arrays (V, F), or mesh
        A mesh file, if there is one of this name; the name of a generated surface, or of a public
        one that was fetched; arrays V (n, 3) and F (m, 3) that counts from 0; a mesh of cembench,
        trimesh, PyVista, meshio or pymeshlab, or any object with `vertices` and `faces`.
    kinds : sequence of mesh classes
        Allowed classes; the surface is of the most special one that fits.
    faces : int, optional
        Number of triangles of a generated surface; other surfaces keep theirs.
    holes : bool
        Whether surfaces with several boundary loops are allowed.
    repair : bool
        Whether to repair the surface first, and to keep its largest component.
    cut : bool
        Whether to cut the surface open to a disk.
    registry : Registry, optional
        Registry of names (default: everything installed).

    Returns
    -------
    DiskMesh, HoledMesh or TriangleMesh
        The surface.

    Raises
    ------
    MeshError
        There is no such surface, it is damaged, or it is of none of these kinds.

    Examples
    --------
    >>> import cembench
    >>> cembench.load_surface("flat-disk", faces=600).m
    600
    >>> V = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> type(cembench.load_surface((V, [[0, 1, 2], [0, 2, 3]]))).__name__
    'DiskMesh'
    """
    allowed = tuple(kind for kind in kinds if holes or not issubclass(kind, HoledMesh))
    path, name = None, ""
    if isinstance(surface, str | os.PathLike):
        registry = registry or load_registry()
        name = os.fspath(surface)
        path = None if is_generated(name, registry) else file_named(Path(name), registry)
        surface = read_soup(path) if path else generate_surface(registry, name, faces)
    if isinstance(surface, allowed) and not repair and not cut:
        return surface
    soup = surface if isinstance(surface, Soup) else soup_of(surface)
    try:
        return cast(M, prepared(soup, allowed, path, repair=repair, cut=cut).mesh)
    except MeshError as error:
        if path or not name:
            raise
        raise MeshError(f"{name}: {error}") from None


def load_file(
    path: Path, kinds: Sequence[type[TriangleMesh]], *, repair: bool = False, cut: bool = False
) -> SurfaceFile:
    """Read a file as :func:`load_surface` does, and return what was done, too."""
    return prepared(read_soup(path), kinds, path, repair=repair, cut=cut)


def prepared(
    soup: Soup,
    kinds: Sequence[type[TriangleMesh]],
    path: Path | None = None,
    *,
    repair: bool = False,
    cut: bool = False,
) -> SurfaceFile:
    """Repair and cut polygons if requested, and check them as the most special kind that fits.

    Raises
    ------
    MeshError
        The surface is of none of these kinds; the message says why it is not of the first.
    """
    repaired = None
    file = path or Path(soup.name)
    if repair:
        soup, repaired = repaired_soup(soup, path)
    if cut:
        uncut = checked(soup, TriangleMesh, path)
        with located(path):
            opened = cut_open(uncut)
        return SurfaceFile(file, opened.mesh, repaired, uncut, opened)
    return SurfaceFile(file, most_special(soup, kinds, path), repaired)


def kinds_of(algorithms: Iterable[Algorithm]) -> list[type[TriangleMesh]]:
    """Return the kinds of surface that algorithms take, in the order of the algorithms."""
    return list(dict.fromkeys(a.mesh_type for a in algorithms))


def is_generated(surface: Any, registry: Registry) -> TypeGuard[str]:
    """Whether this is the name of a generated surface, and not of a file."""
    return isinstance(surface, str) and surface in registry.surfaces and not Path(surface).is_file()


def generate_surface(registry: Registry, name: str, faces: int | None = None) -> TriangleMesh:
    """Generate a registered surface with about `faces` triangles, or at its own size."""
    family = registry.surface(name)
    sizes = {} if faces is None else {"faces": faces}
    return family.function(**family.arguments(sizes))


def file_named(path: Path, registry: Registry) -> Path:
    """Return the file that a path or name refers to: itself, or a public surface that was fetched.

    Raises
    ------
    MeshError
        It is neither, or the public surface is not here yet.
    """
    if path.suffix or path.exists() or len(path.parts) > 1:
        return path
    name = str(path)
    dataset = registry.datasets.get(name)
    if dataset is None:
        raise MeshError(
            f"{name!r} is neither a file nor a registered surface; known surfaces: "
            f"{', '.join(sorted(registry.surfaces)) or 'none'}."
            + did_you_mean(name, [*registry.surfaces, *registry.datasets, *mesh_names(Path())])
        )
    if not is_fetched(dataset):
        raise MeshError(
            f"the public surface {name!r} is not here yet: `cembench fetch {name}` fetches it."
        )
    return surface_file(dataset)
