"""Map one surface in this process and check the map."""

from __future__ import annotations

import base64
import html
import os
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import AlgorithmFailed, ParameterError
from cembench.mesh.files import check_writable_format
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import Algorithm, Registry, load_registry
from cembench.results.records import Outcome
from cembench.running.measure import check_cell
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.surfaces import SurfaceInput, load_surface
from cembench.workflows.notebook import html_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The recommended algorithm for each kind of surface.
DEFAULT_ALGORITHMS: Mapping[type[TriangleMesh], str] = {
    DiskMesh: "direct-cem",
    HoledMesh: "direct-cem-holes",
}


@dataclass(frozen=True)
class Result:
    """A checked map of a surface to the plane.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    algorithm : Algorithm
        The algorithm that mapped it.
    z : complex128 (n,)
        Image of each vertex.
    outcome : Outcome
        Result of the check: figures, notices and seconds.

    Examples
    --------
    >>> import cembench
    >>> result = cembench.parameterize(cembench.surface("flat-disk", 200), "harmonic-circle")
    >>> result.ok, result.z.shape == (result.mesh.n,)
    (True, True)
    >>> result.save("flat.obj").name
    'flat.obj'

    """

    mesh: TriangleMesh
    algorithm: Algorithm
    z: NDArray[np.complex128]
    outcome: Outcome

    @property
    def uv(self) -> NDArray[np.float64]:
        """Image of each vertex as two columns, float64 (n, 2)."""
        return np.stack([self.z.real, self.z.imag], axis=1)

    @property
    def ok(self) -> bool:
        """Whether the map keeps what its target class promises (see docs/measuring.md)."""
        return self.outcome.status == "ok"

    @property
    def cause(self) -> str | None:
        """Why the map is not valid; None if it is valid."""
        return self.outcome.cause

    @property
    def metrics(self) -> Mapping[str, float | int | None]:
        """Figures by name, computed by the harness; None if one is infinite."""
        return self.outcome.metrics

    @property
    def notices(self) -> tuple[str, ...]:
        """Remarks on the surface and the map, e.g. a broken premise of the paper."""
        return (*map(str, self.mesh.notices), *map(str, self.outcome.notes))

    @property
    def phases(self) -> Mapping[str, float]:
        """Seconds by phase; they add up to :attr:`seconds`."""
        return self.outcome.phases

    @property
    def seconds(self) -> float | None:
        """Wall-clock seconds of the call, without warm-up; use `benchmark` for reliable timings."""
        return self.outcome.median_seconds

    @property
    def iterations(self) -> int | None:
        """Number of iterations; 0 for a direct method."""
        return self.outcome.iterations

    @property
    def energy_history(self) -> tuple[float, ...]:
        """E_C (Eq. 7) at the start and after each iteration."""
        return self.outcome.energy_history

    @property
    def extras(self) -> Mapping[str, Any]:
        """Additional data reported by the algorithm."""
        return self.outcome.extras

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        uv: Literal["unit", "disk"] = "unit",
        checker: bool = False,
        overwrite: bool = False,
    ) -> Path:
        """Write the surface with the map as its texture coordinates.

        Parameters
        ----------
        path : path
            OBJ, PLY, GLB, VTP or NPZ, by its suffix. GLB gets a checkerboard texture.
        uv : {"unit", "disk"}
            Whether the map is moved into the unit square, where engines look for textures
            (``(z + 1 + 1j) / 2`` for a disk), or written as it is.
        checker : bool
            Whether an OBJ or PLY file gets a checkerboard texture too, as separate files.
        overwrite : bool
            Whether existing files may be replaced.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        MeshError
            The format is unknown, the folder does not exist, or the file exists and must not be
            replaced. No partial file is left.
        ParameterError
            `uv` is neither "unit" nor "disk".

        """
        from cembench.core.outputs import refuse_existing
        from cembench.workflows.map_files import FileOptions, beside, save_map
        from cembench.workflows.places import Place

        path = Path(path)
        if uv not in tuple(Place):
            raise ParameterError(f"uv={uv!r} is unknown; allowed: 'unit', 'disk'.")
        file_options = FileOptions(Place(uv), checker)
        check_writable_format(path, with_uv=True)
        for file in (path, *beside(path, file_options)):
            refuse_existing(file, overwrite=overwrite)
        for notice in save_map(path, self.mesh, self.z, file_options):
            warnings.warn(f"{path}: {notice}", stacklevel=2)
        return path

    def geometry_image(self, side: int = 257) -> NDArray[np.float64]:
        """Return the surface sampled on a regular grid of the map.

        Parameters
        ----------
        side : int
            Samples along a side.

        Returns
        -------
        float64 (side, side, 3)
            Points of the surface. A map onto the disk is sampled on the square, see
            :func:`cembench.conformal.resample.geometry_image`.

        """
        from cembench.conformal.resample import geometry_image

        square = self.algorithm.target == "disk"
        return geometry_image(self.mesh, self.z, side, "square" if square else "disk")

    def remesh(self, side: int = 65) -> DiskMesh:
        """Return the surface remeshed with triangles that are equilateral in the disk.

        Parameters
        ----------
        side : int
            Lattice points along the disk's diameter; see
            :func:`cembench.conformal.resample.regular_remesh`.

        Returns
        -------
        DiskMesh
            The new mesh.

        """
        from cembench.conformal.resample import regular_remesh

        return regular_remesh(self.mesh, self.z, side)[0]

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw the surface and its image under the same checkerboard.

        Parameters
        ----------
        path : path, optional
            PNG file to write the picture to, too.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, which a notebook displays.

        """
        from matplotlib.figure import Figure
        from matplotlib.image import imread

        png = self._png()
        if path is not None:
            from cembench.core.atomic import write

            write(Path(path), lambda file: file.write(png))
        import io

        pixels = imread(io.BytesIO(png), format="png")
        figure = Figure(figsize=(pixels.shape[1] / 100, pixels.shape[0] / 100), dpi=100)
        figure.figimage(pixels)
        return figure

    def show(self, path: str | os.PathLike[str] | None = None) -> Path:
        """Open an interactive page with the surface and its image in the browser.

        The page works offline and needs no other file.

        Parameters
        ----------
        path : path, optional
            HTML file to write; it is then not opened. Default: a temporary file.

        Returns
        -------
        Path
            The file of the page.

        Raises
        ------
        RenderError
            The page cannot be written.

        """
        import tempfile
        import webbrowser

        from cembench.core.names import file_name
        from cembench.report.render.view_page import write_view_page
        from cembench.workflows.view import map_page

        page = map_page(self.mesh, self.z, self.outcome, self.algorithm.title, self.notices)
        if path is not None:
            write_view_page(Path(path), page)
            return Path(path)
        shown = Path(tempfile.mkdtemp(prefix="cembench-")) / f"{file_name(self.mesh.name)}.html"
        write_view_page(shown, page)
        webbrowser.open(shown.as_uri())
        return shown

    def _png(self) -> bytes:
        from cembench.drawing.preview import preview_png

        return preview_png(self.mesh, self.z, title=self._title, caption=self._caption)

    @property
    def _title(self) -> str:
        return f"{self.mesh.name}: {self.algorithm.title}"

    @property
    def _caption(self) -> str:
        from cembench.conformal.metrics import caption

        return caption(self.metrics)

    def __repr__(self) -> str:
        state = "ok" if self.ok else f"{self.outcome.status}: {self.cause}"
        return (
            f"<Result of {self.algorithm.name} on {self.mesh.name} "
            f"({self.mesh.n:,} vertices, {self.mesh.m:,} triangles): {state}; {self._caption}>"
        )

    def _repr_html_(self) -> str:
        from cembench.workflows.view import metric_facts

        picture = base64.b64encode(self._png()).decode()
        rows = [("status", self.outcome.status + (f": {self.cause}" if self.cause else ""))]
        rows += metric_facts(self.outcome)
        rows += [("iterations", str(self.iterations)), ("seconds", f"{self.seconds:.3f}")]
        rows += [("note", notice) for notice in self.notices]
        words = html.escape(self._title)
        return (
            f"<figure><img alt='{words}' style='max-width:100%' "
            f"src='data:image/png;base64,{picture}'/></figure>{html_table(rows)}"
        )


def parameterize(
    surface: SurfaceInput,
    algorithm: str | None = None,
    *,
    keep_invalid: bool = False,
    plugins: Iterable[str] = (),
    **parameters: Any,
) -> Result:
    """Map a surface to the plane and check the map.

    Parameters
    ----------
    surface : mesh, path, name or pair of arrays (V, F)
        A disk or a surface with holes. V is (n, 3), F is (m, 3) and counts from 0.
    algorithm : str, optional
        A name from :func:`cembench.list_algorithms`; default: ``"direct-cem"``, or
        ``"direct-cem-holes"`` for surfaces with holes.
    keep_invalid : bool
        Whether to return an invalid map (for example, one with folds) instead of raising; see
        :attr:`Result.ok`.
    plugins : iterable of str
        Python files or ``module:name`` with more algorithms.
    **parameters
        Parameters of the algorithm.

    Returns
    -------
    Result
        The map with its figures.

    Raises
    ------
    MeshError
        The surface is damaged, or the algorithm does not take surfaces of its kind.
    RegistryError
        The algorithm is unknown.
    ParameterError
        A parameter is unknown, or its value is out of range.
    AlgorithmFailed
        No map was found, or the map is not valid and `keep_invalid` is False.

    Examples
    --------
    >>> import cembench
    >>> result = cembench.parameterize(cembench.surface("hemi-ellipsoid", 400))
    >>> result.uv.shape == (result.mesh.n, 2)
    True
    >>> result.metrics["flipped_triangles"]
    0

    """
    registry = load_registry(plugins)
    mesh, chosen = _mesh_and_algorithm(surface, algorithm, registry)
    task = plan_cells([chosen], [mesh], parameters, MeasurementSettings(repeats=1))[0]
    outcome, z = check_cell(chosen, task.mesh, task.cell)
    if z is None or (outcome.status != "ok" and not keep_invalid):
        raise AlgorithmFailed(f"{mesh.name} / {chosen.name}: {outcome.status}: {outcome.cause}")
    return Result(mesh, chosen, z, outcome)


def default_algorithm(mesh: TriangleMesh) -> str:
    """Return the name of the recommended algorithm for this kind of surface."""
    for kind, name in DEFAULT_ALGORITHMS.items():
        if isinstance(mesh, kind):
            return name
    kinds = ", ".join(kind.__name__ for kind in DEFAULT_ALGORITHMS)
    raise ParameterError(f"{mesh.name} is a {type(mesh).__name__}; allowed: {kinds}.")


def _mesh_and_algorithm(
    surface: SurfaceInput, name: str | None, registry: Registry
) -> tuple[TriangleMesh, Algorithm]:
    if name is None:
        mesh: TriangleMesh = load_surface(surface, registry=registry)
        return mesh, registry.algorithm(default_algorithm(mesh))
    chosen = registry.algorithm(name)
    return load_surface(surface, (chosen.mesh_type,), registry=registry), chosen
