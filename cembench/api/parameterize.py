"""Map one surface in this process and check the map."""

from __future__ import annotations

import base64
import html
import os
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import entry_points
from pathlib import Path
from types import MethodType
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.api.notebook import html_table, is_notebook, show_page
from cembench.api.settings import MapTarget, Placement, Threads, algorithms_named
from cembench.core.arguments import checked
from cembench.core.errors import AlgorithmFailed, ParameterError
from cembench.core.names import file_name, unknown
from cembench.mesh.files import check_writable_format
from cembench.mesh.plausibility import implausible
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, load_registry
from cembench.results.records import Outcome
from cembench.running.in_this_process import numerical_threads
from cembench.running.map_checks import figures
from cembench.running.measure import check_cell, check_overlay, refinement_of
from cembench.running.plan import MeasurementSettings, cell_of, distribute_parameters
from cembench.running.sources import sources_of
from cembench.running.surfaces import SurfaceInput, load_surface

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cembench.conformal.certificate import Certificate, HolesCertificate

#: How thoroughly a map is checked.
Check = Literal["full", "fast"]


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

    @cached_property
    def metrics(self) -> Mapping[str, float | int | None]:
        """Figures by name, computed by the harness; None if one is infinite."""
        return _Figures(self.outcome.metrics or figures(self.algorithm.target, self.mesh, self.z))

    @property
    def notices(self) -> tuple[str, ...]:
        """Remarks on the surface and the map, e.g. a broken premise of the paper."""
        from cembench.api.view import notices_of

        return notices_of(self.mesh, self.outcome)

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
        """The algorithm's energy at the start and after each iteration: E_C (Eq. 7) as a rule.

        ``extras["energy_of"]`` names another. That of `direct-cem` is E_C by the weights of the
        intrinsic Delaunay triangulation.
        """
        return self.outcome.energy_history

    @property
    def extras(self) -> Mapping[str, Any]:
        """Additional data reported by the algorithm."""
        return self.outcome.extras

    @checked
    def save(
        self,
        path: str | os.PathLike[str],
        *,
        uv: Placement = "unit",
        checker: bool = False,
        overwrite: bool = False,
    ) -> Path:
        """Write the surface with the map as its texture coordinates.

        Parameters
        ----------
        path : path
            OBJ, PLY, GLB, VTP or NPZ, by its suffix. GLB gets a checkerboard texture.
        uv : {"unit", "square", "world", "disk"}
            Whether the map is moved into the unit square, where engines look for textures
            (``(z + 1 + 1j) / 2`` for a disk), fills it as a map of the disk can, has the surface's
            own units (equal total area), or is written as it is.
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
            `uv` is unknown, or "square" for a map that is no disk.
        """
        from cembench.api.save_map import save_map, texture_files
        from cembench.core.overwriting import refuse_present

        path = Path(path)
        check_writable_format(path, with_uv=True)
        refuse_present((path, *(texture_files(path) if checker else ())), force=overwrite)
        for notice in save_map(path, self.mesh, self.z, uv, checker=checker):
            warnings.warn(f"{path}: {notice}", stacklevel=2)
        return path

    def flat(self) -> TriangleMesh:
        """Return the flattened mesh in the plane z = 0, in the surface's own units.

        Its vertices and triangles have the surface's numbers, and it has the surface's area.
        """
        from cembench.api.save_map import flattened

        return flattened(self.mesh, self.z)

    def certificate(self) -> Certificate | HolesCertificate:
        """Enclose the conformal modulus of the surface, which the map should have.

        Four boundary points make a disk a quadrilateral, whose modulus two harmonic functions
        enclose from both sides without a known map; a surface with holes has their capacities,
        enclosed by two functions for each hole. Every conformal map keeps both. A map whose modulus
        or circles are outside is not conformal; one within may still be wrong elsewhere.

        Returns
        -------
        Certificate or HolesCertificate
            The bounds; ``words(result.z[certificate.corners])`` compares the map with them.

        Raises
        ------
        ParameterError
            The map is not one to the disk.
        AlgorithmFailed
            The boundary has fewer than four vertices.

        Examples
        --------
        >>> import cembench
        >>> mesh = cembench.surface("hemi-ellipsoid", 2000)
        >>> result = cembench.parameterize(mesh, target="disk")
        >>> proof = result.certificate()
        >>> proof.encloses(result.z[proof.corners])
        True
        """
        from cembench.conformal.certificate import certificate_of

        certificate = certificate_of(self.mesh, self.z, self.algorithm.target)
        if certificate is None:
            raise ParameterError(
                f"{self.algorithm.name} on {self.mesh.name} is no map to the disk, whose modulus "
                'is known. Take target="disk".'
            )
        return certificate

    def __getattr__(self, name: str) -> Any:
        """Return a function of the entry point group ``cembench.result`` as a method."""
        if not name.startswith("_"):
            for entry in entry_points(group="cembench.result", name=name):
                return MethodType(entry.load(), self)
        raise AttributeError(f"a Result has no attribute {name!r}", name=name, obj=self)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *entry_points(group="cembench.result").names]

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw the surface and its image under the same checkerboard.

        Parameters
        ----------
        path : path, optional
            PNG file to write the picture to, too.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, which ``matplotlib.pyplot.show()`` or a notebook displays.

        Raises
        ------
        ParameterError
            The path does not end in .png.
        """
        import io

        from matplotlib import pyplot
        from matplotlib.image import imread

        if path is not None and Path(path).suffix.lower() != ".png":
            raise ParameterError(
                f"{path}: the picture is a PNG; for other formats use `savefig` of the figure."
            )
        png = self._png()
        if path is not None:
            from cembench.core.atomic import write

            write(Path(path), lambda file: file.write(png))
        pixels = imread(io.BytesIO(png), format="png")
        size = (pixels.shape[1] / 100, pixels.shape[0] / 100)
        figure = pyplot.figure(figsize=size, dpi=100)
        if is_notebook():  # it would display it twice: as the cell's result, and at the cell's end
            pyplot.close(figure)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.imshow(pixels, aspect="auto")
        axes.set_axis_off()
        return figure

    def show(self, path: str | os.PathLike[str] | None = None) -> Path | None:
        """Show an interactive page with the surface and its image.

        It is shown below the cell of a notebook, else in the browser. The page works offline and
        needs no other file.

        Parameters
        ----------
        path : path, optional
            HTML file to write; it is then not shown. Default: a temporary file.

        Returns
        -------
        Path or None
            The file of the page; None if a notebook shows it.

        Raises
        ------
        RenderError
            The page cannot be written.
        ParameterError
            The path does not end in .html.
        """
        import tempfile
        import webbrowser

        from cembench.api.view import map_page
        from cembench.report.render.view_page import write_view_page

        if path is not None and Path(path).suffix.lower() not in (".html", ".htm"):
            raise ParameterError(f"{path} is no name of a web page; use the suffix .html.")
        page = map_page(self.mesh, self.z, self.outcome, self.algorithm.title)
        if path is not None:
            write_view_page(Path(path), page)
            return Path(path)
        if is_notebook():
            show_page(page)
            return None
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
        from cembench.api.view import metric_facts

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


class _Figures(dict[str, "float | int | None"]):
    """Figures by name; an unknown name is answered with the nearest known one."""

    def __missing__(self, name: str) -> None:
        raise KeyError(unknown("metric", str(name), self))


def parameterize(
    surface: SurfaceInput | ArrayLike,
    *faces_and_algorithm: ArrayLike | str,
    algorithm: str | None = None,
    target: MapTarget | None = None,
    keep_invalid: bool = False,
    check: Check = "full",
    overlay: bool = False,
    threads: Threads = 1,
    plugins: Iterable[str] = (),
    **parameters: Any,
) -> Result:
    """Map a surface to the plane and check the map.

    Parameters
    ----------
    surface : mesh, path, name or arrays
        A disk or a surface with holes: a mesh, a path, a name, a pair (V, F), or V with F as the
        next argument. V is (n, 3), F is (m, 3) and counts from 0.
    *faces_and_algorithm
        F, if `surface` is V; then the name of the algorithm, unless it is given by keyword.
    algorithm : str, optional
        A name from :func:`cembench.list_algorithms`, instead of a `target`.
    target : {"plane", "disk", "circular holes"}, optional
        Take the recommended map to the plane, with a free boundary and the least angle errors
        (``"plane"``, the default); to the disk, with round holes if there are any
        (``"direct-cem"`` or ``"direct-cem-holes"``); or to the disk with round holes alone.
    keep_invalid : bool
        Whether to return an invalid map (for example, one with folds) instead of raising; see
        :attr:`Result.ok`.
    check : {"full", "fast"}
        With "fast" only the promises of the map's class are checked, such as no folds: there are
        no notices on its quality, and :attr:`Result.metrics` are computed when asked for.
    overlay : bool
        Whether the map is on a refinement of the surface, without folds by construction; then
        :attr:`Result.mesh` is that. ``"cetm-flips"`` has it: the mesh cut along the edges of the
        flipped triangulation.
    threads : int
        Threads of the numerical libraries. OpenBLAS always has one, whatever the environment says,
        since its sums depend on their number: built-in algorithms have the same map with any.
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
        A parameter, a check or a target is unknown, a value is out of range, two algorithms or an
        algorithm and a target are named, or there is no `overlay` of the algorithm.
    AlgorithmFailed
        No map was found, or the map is not valid and `keep_invalid` is False.

    Examples
    --------
    >>> import cembench
    >>> mesh = cembench.surface("hemi-ellipsoid", 400)
    >>> result = cembench.parameterize(mesh.V, mesh.F)
    >>> result.uv.shape == (mesh.n, 2)
    True
    >>> result.metrics["flipped_triangles"]
    0
    >>> cembench.parameterize(mesh, "cem").algorithm.name
    'cem'
    """
    if check not in get_args(Check):
        allowed = ", ".join(map(repr, get_args(Check)))
        raise ParameterError(f"check={check!r} is unknown; allowed: {allowed}.")
    arrays = [one for one in faces_and_algorithm if one is not None and not isinstance(one, str)]
    named = [one for one in (*faces_and_algorithm, algorithm) if isinstance(one, str)]
    if len(named) > 1:
        raise ParameterError(f"two algorithms are named, {' and '.join(named)}; name one.")
    what: Any = (surface, *arrays) if arrays else surface
    registry = load_registry(plugins)
    names = algorithms_named(named[0] if named else None, target)
    candidates = [registry.algorithm(name) for name in names]
    mesh = load_surface(what, [a.mesh_type for a in candidates], registry=registry)
    full = check == "full"
    mesh = mesh.noted(implausible(mesh.V, mesh.F)) if full else mesh
    chosen = next(a for a in candidates if isinstance(mesh, a.mesh_type))
    arguments = distribute_parameters([chosen], parameters)[chosen.name]
    settings = MeasurementSettings(repeats=1, threads=threads)
    cell = cell_of(chosen, mesh, arguments, settings, sources_of(chosen))
    with numerical_threads(threads):
        if overlay:
            refinement_of(chosen)
            outcome, mesh, z = check_overlay(chosen, mesh, cell, figures=full)
        else:
            outcome, z = check_cell(chosen, mesh, cell, memory=False, figures=full)
    if z is None or (outcome.status != "ok" and not keep_invalid):
        raise AlgorithmFailed(f"{mesh.name} / {chosen.name}: {outcome.status}: {outcome.cause}")
    return Result(mesh, chosen, z, outcome)
