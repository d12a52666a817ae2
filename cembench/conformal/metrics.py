"""Quality metrics of a map, computed from the mesh and the map alone, never by the algorithm.

Angles are in degrees. Energies and areas are in the units of the map squared: for a unit disk they
can be compared between surfaces, for a free boundary only after scaling the image.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from cembench.conformal.beltrami import dilatations as dilatations_between
from cembench.conformal.gauge import gauge_measure, moved_to_gauge
from cembench.conformal.laplacian import corner_products, double_areas, half_cotangents
from cembench.conformal.planar import (
    fitted_circle,
    folded_triangles,
    overlap_share,
    polygon_area,
    signed_areas,
)
from cembench.conformal.texel_density import (
    SIDE,
    extent_of,
    texel_density_ratio,
    texture_words,
    undersampled_share,
)
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.blocks import blocks, in_blocks
from cembench.core.errors import AlgorithmFailed
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.triangle_mesh import TriangleMesh

#: Share of E_D by which rounding may make E_C negative.
MIN_ENERGY = 1e-9
#: Number of triangles that :class:`SampledAngleError` samples.
SAMPLE = 4_000
#: Allowed distance from the unit circle of a disk map's boundary, for a common gauge.
NEAR_CIRCLE = 1e-3


def dirichlet_energy(mesh: TriangleMesh, uv: Complex) -> float:
    """Return E_D (Eq. 5): half the sum over edges of cotangent weight times squared length."""
    return _energy_of_weights(half_cotangents(mesh.V, mesh.F), mesh.F, uv)


def _energy_of_weights(weights: Real, F: Indices, uv: Complex) -> float:
    """Return E_D for half the cotangents (m, 3) of the corners."""
    squared = np.empty((3, len(F)))
    for block in blocks(len(F)):
        corners = [uv.take(F[block, c]) for c in range(3)]
        for c in range(3):
            squared[c, block] = np.abs(corners[(c + 1) % 3] - corners[(c + 2) % 3]) ** 2
    return 0.5 * float((weights.T * squared).sum())


def image_area(mesh: TriangleMesh, uv: Complex) -> float:
    """Return A (Eq. 8): the area inside the boundary polygons less the holes, not exactly pi."""
    return sum(polygon_area(uv[loop]) for loop in mesh.loops)


def corner_angles(points: Real | Complex, F: Indices) -> Real:
    """Return the angles of triangles in degrees.

    Parameters
    ----------
    points : float (n, 3) or complex (n,)
        Vertices in space or in the plane.
    F : int64 (m, 3)
        Triangles.

    Returns
    -------
    float (m, 3)
        Unsigned. A triangle whose vertices coincide has angles of zero.

    Examples
    --------
    >>> import numpy as np
    >>> corner_angles(np.array([0, 1, 1j]), np.array([[0, 1, 2]])).round()
    array([[90., 45., 45.]])
    """
    V = _coordinates(points)
    return in_blocks(lambda some: _angles(V, some), F)


def _coordinates(points: Real | Complex) -> Real:
    if np.iscomplexobj(points):
        return np.stack([points.real, points.imag], axis=1)
    return np.asarray(points, np.float64)


def _angles(V: Real, F: Indices) -> Real:
    return _in_degrees(*corner_products(V, F))


def _in_degrees(dots: Real, double_area: Real) -> Real:
    # Of a triangle that has collapsed to a point, products are 0 or -0, whose angle would be 180.
    return np.asarray(np.rad2deg(np.arctan2(double_area[:, None], dots + 0.0)))


def angle_errors(mesh: TriangleMesh, uv: Complex) -> Real:
    """Return the absolute change of each corner's angle in degrees, shape (m, 3)."""
    image = _coordinates(uv)
    return in_blocks(lambda some: np.abs(_angles(mesh.V, some) - _angles(image, some)), mesh.F)


class SampledAngleError:
    """The mean change of corner angles in degrees, over every k-th triangle.

    On a large mesh these are 4,000 triangles or a few more: enough to compare two maps of it.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        self._V, self._F = mesh.V, mesh.F[:: max(1, mesh.m // SAMPLE)]

    @cached_property
    def _in_space(self) -> Real:
        return corner_angles(self._V, self._F)

    def __call__(self, uv: Complex) -> float:
        """Return the mean change in degrees for a map (n,)."""
        return float(np.abs(self._in_space - corner_angles(uv, self._F)).mean())


def flipped_triangles(mesh: TriangleMesh, uv: Complex) -> int:
    """Return the number of folded or collapsed triangles, by the exact sign of their area."""
    return len(folded_triangles(uv, mesh.F))


def dilatations(mesh: TriangleMesh, uv: Complex) -> Real:
    """Return each triangle's ratio of largest to smallest stretch, which is 1 if conformal.

    Shape (m,); infinite for a triangle that collapsed to a segment or a point.
    """
    return dilatations_between(uv, mesh.F, mesh.V)


@dataclass(frozen=True)
class BoundaryCircle:
    """The circle fitted to the image of a boundary loop.

    Parameters
    ----------
    vertex : int
        The smallest vertex of the boundary loop, which identifies it.
    vertices : int
        Number of vertices of the loop.
    centre : complex
        Centre of the circle.
    radius : float
        Its radius; NaN if the image determines no circle.
    circularity : float
        The largest ``| |z - c| - r | / r`` over the loop; infinite if there is no circle.
    """

    vertex: int
    vertices: int
    centre: complex
    radius: float
    circularity: float


#: Distance from a circle, relative to its radius, up to which a hole's image counts as one.
CIRCULAR = 1e-3


def boundary_circles(mesh: TriangleMesh, uv: Complex) -> tuple[BoundaryCircle, ...]:
    """Return the circles fitted to the boundary images, that of the largest area first."""
    loops = sorted(mesh.loops, key=lambda loop: polygon_area(uv[loop]), reverse=True)
    return tuple(circle_of(loop, uv[loop]) for loop in [*loops[:1], *sorted(loops[1:], key=min)])


def circle_of(loop: Indices, z: Complex) -> BoundaryCircle:
    """Return the circle fitted to the image z (k,) of a boundary loop (k,)."""
    centre, radius = fitted_circle(z)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = float(np.max(np.abs(np.abs(z - centre) - radius) / np.float64(radius)))
    circularity = off if np.isfinite(off) else float("inf")
    return BoundaryCircle(int(loop.min()), len(loop), centre, radius, circularity)


def boundary_circularity(mesh: TriangleMesh, uv: Complex) -> float:
    """Return the distance of the boundary images from circles: the largest ``| |z - c| - r | / r``.

    Centre and radius are fitted to each loop; infinite if a loop determines no circle.
    """
    return max((circle.circularity for circle in boundary_circles(mesh, uv)), default=0.0)


def surface_areas(mesh: TriangleMesh) -> Real:
    """Return the area of each triangle of the surface, shape (m,)."""
    return double_areas(mesh.V, mesh.F) / 2


def is_disk_map(mesh: TriangleMesh, uv: Complex) -> bool:
    """Whether the outer boundary lies on the unit circle, within :data:`NEAR_CIRCLE`."""
    if not mesh.loops:
        return False
    outer = max(mesh.loops, key=lambda loop: polygon_area(uv[loop]))
    return bool(np.all(np.abs(np.abs(uv[outer]) - 1) <= NEAR_CIRCLE))


def in_common_gauge(mesh: TriangleMesh, uv: Complex) -> Complex:
    """Move a map to the disk by the Moebius map that brings its area-weighted mean to 0.

    Two maps of a surface that differ by a Moebius map of the disk become equal up to a rotation; on
    a mesh the Moebius map is applied to the vertices. uv is (n,), its outer boundary on the unit
    circle.

    Raises
    ------
    AlgorithmFailed
        A vertex lies outside the disk, or all but a point of the surface has collapsed.
    """
    if not np.abs(uv).max() <= 1 + NEAR_CIRCLE:
        raise AlgorithmFailed("a vertex lies outside the disk: the map has no common gauge")
    return moved_to_gauge(uv, gauge_measure(mesh, "area", mesh.loops[0]))


def area_distortion(areas: Real, images: Real) -> tuple[float, float]:
    """Return mean and standard deviation of the area distortion, weighted by surface area.

    The distortion of a triangle is the logarithm of its area in the image over that on the surface,
    at the scale of the image that is best in least squares, so that the weighted mean is 0. The
    first value is the mean of the absolute values, the second the standard deviation. Folded
    triangles count with the size of their area; infinite if a triangle collapsed. `areas` (m,) are
    those on the surface, `images` (m,) the signed areas in the image.
    """
    held = areas > 0
    areas, images = areas[held], images[held]
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.log(np.abs(images)) - np.log(areas)
    if not np.isfinite(off).all():
        return float("inf"), float("inf")
    off -= np.average(off, weights=areas)
    mean, variance = (np.average(one, weights=areas) for one in (np.abs(off), off**2))
    return float(mean), float(np.sqrt(variance))


class MapFigures:
    """Intermediate results for the metrics of one map, each computed once."""

    def __init__(self, mesh: TriangleMesh, uv: Complex) -> None:
        self.mesh, self.uv = mesh, uv

    @cached_property
    def products(self) -> tuple[Real, Real]:
        """Dot products of the edges at each corner of the surface, and twice its areas."""
        return corner_products(self.mesh.V, self.mesh.F)

    @cached_property
    def areas(self) -> Real:
        """Areas of the triangles of the surface, (m,)."""
        return self.products[1] / 2

    @cached_property
    def half_cotangents(self) -> Real:
        """Half the cotangents of the corners of the surface, (m, 3)."""
        dots, double_area = self.products
        return dots / (2 * double_area[:, None])

    @cached_property
    def surface_angles(self) -> Real:
        """Angles of the triangles of the surface in degrees, (m, 3)."""
        return _in_degrees(*self.products)

    def _energy(self, uv: Complex) -> float:
        return _energy_of_weights(self.half_cotangents, self.mesh.F, uv)

    @cached_property
    def energy(self) -> float:
        """E_D (Eq. 5)."""
        return self._energy(self.uv)

    @cached_property
    def area(self) -> float:
        """A (Eq. 8)."""
        return image_area(self.mesh, self.uv)

    @cached_property
    def image_areas(self) -> Real:
        """Signed areas of the triangles' images, (m,)."""
        return signed_areas(self.uv, self.mesh.F)

    @cached_property
    def angle_errors(self) -> Real:
        """Absolute change of every corner's angle in degrees, (m, 3)."""
        return self.angle_errors_of(self.uv)

    def angle_errors_of(self, uv: Complex) -> Real:
        """Return the same, (m, 3), for any map of the surface."""
        return np.abs(self.surface_angles - corner_angles(uv, self.mesh.F))

    @cached_property
    def dilatations(self) -> Real:
        """Ratio of largest to smallest stretch of every triangle, (m,)."""
        return dilatations(self.mesh, self.uv)

    @cached_property
    def beltrami(self) -> Real:
        """Modulus of mu of every triangle, (m,): 0 if conformal, 1 if collapsed; folds reversed."""
        K = self.dilatations
        with np.errstate(invalid="ignore"):
            mu = (K - 1) / (K + 1)
        return np.where(np.isfinite(K), mu, 1.0)

    @cached_property
    def beltrami_mean(self) -> float:
        """Mean of the modulus of mu over the surface's area."""
        return float(np.average(self.beltrami, weights=self.areas))

    @cached_property
    def is_disk_map(self) -> bool:
        """Whether the outer boundary lies on the unit circle."""
        return is_disk_map(self.mesh, self.uv)

    @cached_property
    def centred(self) -> Complex | None:
        """The map, in the common gauge if it is a disk map; None if that cannot be reached."""
        if not self.is_disk_map:
            return self.uv
        try:
            return in_common_gauge(self.mesh, self.uv)
        except AlgorithmFailed:
            return None

    @cached_property
    def centred_energy(self) -> float | None:
        """E_C of a disk map in the common gauge; None for a map to another target."""
        if not self.is_disk_map:
            return None
        if self.centred is None:
            return float("inf")
        return self._energy(self.centred) - image_area(self.mesh, self.centred)

    @cached_property
    def area_distortion(self) -> tuple[float, float]:
        """Mean and standard deviation; for a disk map in the common gauge."""
        if self.centred is None:
            return float("inf"), float("inf")
        return area_distortion(self.areas, signed_areas(self.centred, self.mesh.F))

    @cached_property
    def overlap(self) -> float:
        """Share of the image that lies over other parts of it."""
        return overlap_share([self.uv[loop] for loop in self.mesh.loops])


@dataclass(frozen=True)
class Metric:
    """One metric of a map, and how it is displayed everywhere.

    Parameters
    ----------
    name : str
        Key in records, CSV and JSON.
    title : str
        Name where space is not limited.
    heading : str
        Heading of a table column.
    unit : str
        Unit after a single value.
    form : str
        Number format in tables.
    precise : str
        Number format for a single value.
    meaning : str
        One line of explanation for documents.
    compute : callable
        From :class:`MapFigures` to the value; infinite if it does not exist, None if the metric
        does not apply to such a map.
    better : "lower" or None
        Which of two values is better; None if neither is by itself.
    shown : {"overview", "page", "record"}
        The shortest kind of table with a column for it: a run's overview, a surface's page, or only
        the listing of a single record.
    """

    name: str
    title: str
    heading: str
    unit: str
    form: str
    precise: str
    meaning: str
    compute: Callable[[MapFigures], float | int | None]
    better: Literal["lower"] | None = "lower"
    shown: Literal["overview", "page", "record"] = "record"

    def text(self, value: float | None, *, precise: bool = False) -> str:
        """Return a recorded value as text; records hold None for infinite values."""
        form = self.precise if precise else self.form
        return "inf" if value is None else format(value, form)


#: All metrics of a map, in the order of tables; a new metric is added here and nowhere else.
METRICS: tuple[Metric, ...] = (
    Metric(
        "conformal_energy", "conformal energy", "E_C", "", "z.4f", "z.6f",
        "E_C = E_D - A (Eq. 7); 0 for a conformal map",
        lambda f: f.energy - f.area, shown="overview",
    ),
    Metric(
        "angle_error_mean_deg", "mean angle error", "angle°", "degrees", ".2f", ".4f",
        "mean absolute change of the triangles' corner angles",
        lambda f: float(f.angle_errors.mean()), shown="overview",
    ),
    Metric(
        "angle_error_sd_deg", "SD of angle error", "SD°", "degrees", ".2f", ".4f",
        "standard deviation of those absolute changes",
        lambda f: float(f.angle_errors.std()), shown="overview",
    ),
    Metric(
        "flipped_triangles", "folded triangles", "folds", "", ".0f", ".0f",
        "number of triangles whose image has no positive area",
        lambda f: flipped_triangles(f.mesh, f.uv), shown="overview",
    ),
    Metric(
        "dilatation_mean", "mean dilatation", "K", "", ".3f", ".4f",
        "mean of K, the ratio of a triangle's largest to its smallest stretch",
        lambda f: float(f.dilatations.mean()), shown="page",
    ),
    Metric(
        "dilatation_max", "maximum dilatation", "K max", "", ".2f", ".4f",
        "largest K of all triangles",
        lambda f: float(f.dilatations.max()), shown="page",
    ),
    Metric(
        "dirichlet_energy", "Dirichlet energy", "E_D", "", ".4f", ".6f",
        "E_D (Eq. 5), with the cotangent weights of the surface",
        lambda f: f.energy,
    ),
    Metric(
        "image_area", "image area", "A", "", ".4f", ".6f",
        "A (Eq. 8), the area that the image of the boundary encloses",
        lambda f: f.area, better=None,
    ),
    Metric(
        "boundary_circularity", "circularity error", "circularity", "of the radius", ".0e", ".1e",
        "largest distance of a boundary's image from its fitted circle, relative to the radius",
        lambda f: boundary_circularity(f.mesh, f.uv),
    ),
    Metric(
        "beltrami_area_mean", "mean |mu|", "|mu|", "", ".4f", ".6f",
        "area-weighted mean modulus of the Beltrami coefficient; 0 for a conformal map",
        lambda f: f.beltrami_mean, shown="page",
    ),
    Metric(
        "beltrami_max", "maximum |mu|", "|mu| max", "", ".3f", ".6f",
        "largest modulus of the Beltrami coefficient",
        lambda f: float(f.beltrami.max()), shown="page",
    ),
    Metric(
        "common_gauge_energy", "E_C, common gauge", "E_C, gauge", "", "z.4f", "z.6f",
        "E_C of a disk map after the Moebius map that brings its area-weighted mean to 0",
        lambda f: f.centred_energy, shown="page",
    ),
    Metric(
        "area_distortion_mean", "mean area distortion", "area", "", ".3f", ".4f",
        "area-weighted mean of the absolute log area ratio at the best scale (disk maps: common "
        "gauge)",
        lambda f: f.area_distortion[0],
    ),
    Metric(
        "area_distortion_sd", "SD of area distortion", "area SD", "", ".3f", ".4f",
        "area-weighted standard deviation of the same log area ratios",
        lambda f: f.area_distortion[1], shown="page",
    ),
    Metric(
        "overlap_share", "image overlap", "overlap", "of the image", ".1e", ".1e",
        "share of the image that covers other parts of it, by the boundary's winding numbers",
        lambda f: f.overlap,
    ),
    Metric(
        "texel_density_ratio", "texel density", "texels", ": 1", ".3g", ".4g",
        "largest over smallest texels per length on the surface, but for a hundredth of it at "
        "either end",
        lambda f: texel_density_ratio(f.areas, f.image_areas),
    ),
    Metric(
        "undersampled_share", "undersampled", "undersampled", "of the surface", ".1e", ".2g",
        f"share of the surface with less than 1 texel for each ten-thousandth, at {SIDE:,} px",
        lambda f: undersampled_share(f.areas, f.image_areas, extent_of(f.uv)),
    ),
)  # fmt: skip


def metrics_shown(*places: str) -> tuple[Metric, ...]:
    """Return the metrics that have a column in these kinds of tables."""
    return tuple(metric for metric in METRICS if metric.shown in places)


def caption(metrics: Mapping[str, float | int | None]) -> str:
    """Return the overview metrics and the texel density in one line, as a caption of a picture."""
    shown = [
        f"{m.title} {m.text(metrics[m.name])}{f' {m.unit}' if m.unit else ''}"
        for m in metrics_shown("overview")
        if m.name in metrics
    ]
    return "   ".join(filter(None, [*shown, texture_words(metrics)]))


def metrics_markdown() -> str:
    """Return a Markdown table of all metrics."""
    rows = "\n".join(f"| `{m.name}` | {m.meaning} | {m.unit or '-'} |" for m in METRICS)
    return f"| name | meaning | unit |\n|---|---|---|\n{rows}\n"


def lost_in_rounding(metrics: Mapping[str, float]) -> list[Notice]:
    """Return a sentence for each meaningless value: not finite, or an impossible energy."""
    lost = [
        f"{name} is {value}, which is not a figure"
        for name, value in metrics.items()
        if not np.isfinite(value)
    ]
    energy, whole = metrics["conformal_energy"], metrics["dirichlet_energy"]
    if energy < -MIN_ENERGY * abs(whole):
        lost.append(f"conformal_energy is {energy:.3g}, which only rounding can make negative")
    return [Notice(NoticeKind.LOST_IN_ROUNDING, text) for text in lost]


def all_metrics(mesh: TriangleMesh, uv: Complex) -> dict[str, float | int]:
    """Return all metrics of a map, by their keys in records.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    uv : complex128 (n,)
        Image of each vertex.

    Returns
    -------
    dict of str to float or int
        The values; metrics that do not apply to the map are left out.

    Examples
    --------
    >>> import cembench
    >>> disk = cembench.surface("flat-disk", 600)
    >>> found = all_metrics(disk, disk.V[:, 0] + 1j * disk.V[:, 1])
    >>> abs(found["conformal_energy"]) < 1e-12, found["flipped_triangles"]
    (True, 0)
    """
    figures = MapFigures(mesh, uv)
    return computed(METRICS, figures)


def computed(metrics: Iterable[Metric], figures: MapFigures) -> dict[str, float | int]:
    """Return the metrics that apply to a map, by name."""
    values = ((metric.name, metric.compute(figures)) for metric in metrics)
    return {name: value for name, value in values if value is not None}
