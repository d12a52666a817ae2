"""Map a surface with holes by every algorithm for such surfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cembench.api.settings import AnyPath, Faces
from cembench.core.arguments import Range, checked
from cembench.core.errors import AlgorithmFailed
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.api.parameterize import Result
    from cembench.mesh.triangle_mesh import HoledMesh
    from cembench.results.exhibits import Exhibit
    from cembench.running.surfaces import SurfaceInput

__all__ = ["HoledMaps", "holes"]

#: The surface that is mapped where none is named; it stands in for a model without a public mesh.
STAND_IN = "ho-face-with-holes"


class HoledMaps(dict[str, "Result"]):
    """The valid maps of a surface with holes, by the name of the algorithm.

    A name whose map failed raises :class:`AlgorithmFailed` with the cause. Koebe's map is that of
    one sweep, the paper's Algorithm 2.

    Parameters
    ----------
    maps : mapping of Result
        The valid maps.
    rows : sequence of dict
        A row for each map, as ``cembench holes --json`` prints it, with its status and figures.
        Koebe's method has a second one for the best number of sweeps, unless that is one.

    Examples
    --------
    >>> import cembench
    >>> found = cembench.holes(cembench.surface("catenoid-ring", 200), sweeps=1)
    >>> [row["status"] for row in found.rows]
    ['ok', 'ok', 'ok']
    """

    def __init__(self, maps: Mapping[str, Result], rows: Sequence[dict[str, Any]]) -> None:
        super().__init__(maps)
        self.rows = list(rows)

    def __missing__(self, name: str) -> Result:
        own = [row for row in self.rows if row["algorithm"] == name]
        for message in failures([HoledMaps({}, own)]):
            raise AlgorithmFailed(message)
        raise KeyError(name)


@checked
def holes(
    surface: SurfaceInput = STAND_IN,
    *,
    outer: Annotated[int, Range(0, 2**63 - 1)] | None = None,
    sweeps: Annotated[int, Range(1, 1000)] = 8,
    faces: Faces | None = None,
    run: AnyPath | None = None,
    reporter: Reporter = SILENT,
) -> HoledMaps:
    """Map surfaces with holes, and draw the steps of Koebe's method.

    One sweep is the paper's Algorithm 2. The table compares it with the best number of sweeps, by
    conformal energy, and with every other algorithm for this class. docs/holes.md explains it.

    Parameters
    ----------
    surface : mesh, path, name or pair of arrays (V, F)
        A surface of genus 0 with two boundary loops or more (default: a face made for this).
    outer : int, optional
        A vertex of the outer boundary, counted from 0 (default: the widest boundary).
    sweeps : int
        Maximum number of sweeps to try.
    faces : int, optional
        Number of triangles of generated surfaces.
    run : path, optional
        Add the pictures and the table to this run, as exhibits that its report shows.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    HoledMaps
        The maps by algorithm name, without algorithms that found no valid map, and the figures of
        all.

    Raises
    ------
    MeshError
        The surface is damaged or has no hole, or `outer` is not on a boundary.
    RecordError
        The folder `run` is not a run, or cannot be written to.

    Examples
    --------
    >>> import cembench
    >>> found = cembench.holes(cembench.surface("catenoid-ring", 200), sweeps=1)
    >>> sorted(found)
    ['direct-cem-holes', 'harmonic-filled', 'koebe-cem']
    """
    from cembench.registry import load_registry
    from cembench.results import exhibits, run_folder
    from cembench.running.map_promises import WITH_HOLES

    from .holes_exhibits import examine_holes

    folder = None if run is None else Path(run)
    if folder is not None:
        run_folder.check(folder)
    mesh = loaded(surface, faces=faces, outer=outer)
    algorithms = [
        a for a in load_registry().algorithms.values() if a.target in WITH_HOLES and a.usual
    ]
    command = exhibits.command("holes", surface, mesh.name, outer=outer, sweeps=sweeps, faces=faces)
    with reporter.busy(f"Koebe's method on {mesh.name}") as tell:
        examined = examine_holes(
            mesh, algorithms, outer, sweeps, folder, command, reporter.warn, tell
        )
    if folder is not None:
        for exhibit in shown([examined], command):
            exhibits.write_exhibit(folder, exhibit)
    return examined


# For the command line


def loaded(surface: SurfaceInput, *, faces: int | None, outer: int | None, **_: Any) -> HoledMesh:
    """Return the surface with holes that was named, which has this outer boundary."""
    from cembench.mesh.triangle_mesh import HoledMesh
    from cembench.running.surfaces import load_surface

    mesh = load_surface(surface, (HoledMesh,), faces=faces)
    mesh.outer_and_holes(outer)
    return mesh


def shown(examined: Sequence[HoledMaps], command: str) -> list[Exhibit]:
    """Return a table of the figures of all surfaces as an exhibit, which `command` makes."""
    from .holes_exhibits import holes_table

    return [holes_table(facts(examined), command)]


def facts(examined: Sequence[HoledMaps]) -> list[Any]:
    """Return the figures of all maps as plain data."""
    return [row for one in examined for row in one.rows]


def failures(examined: Sequence[HoledMaps]) -> list[str]:
    """Return which maps are not valid, and why."""
    return [
        f"{row['mesh']} / {row['algorithm']}: {row['status']}: {row['cause']}"
        for row in facts(examined)
        if row["status"] != "ok"
    ]
