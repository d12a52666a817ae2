"""How good is the registration of Section 6? Error against the true correspondence of faces."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from cembench.papers.cem.morphing.align import aligned, centred, to_centre, vertex_areas
from cembench.papers.cem.morphing.landmarks import check_order
from cembench.papers.cem.morphing.registration import register
from cembench.surfaces.ict_face import LANDMARKS, ict_face, landmarks_of, sample, triangulation
from cembench.surfaces.ict_model import load_model
from matplotlib.figure import Figure
from scipy import optimize

from benchmarks.measuring import png, progress
from benchmarks.pages import Section, Table
from cembench.api.parameterize import parameterize
from cembench.conformal.moebius import Moebius
from cembench.conformal.planar import signed_areas
from cembench.conformal.resample import interpolated, locate
from cembench.core.errors import AlgorithmFailed, ParameterError
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.results.intervals import median_interval

mpl.use("Agg")
import matplotlib.pyplot as plt

PAGE, FIGURE, PAIRS = (f"docs/registration.{suffix}" for suffix in ("md", "png", "csv"))
#: Triangles of the first and of the second face of a pair.
FACES = (8_000, 9_000)
COUNTS = (0, 3, 6, 20)
#: Number of decimals of an error.
DIGITS = 4
KINDS = {
    "identity": "other people",
    "expression": "other expressions",
    "both": "both",
}
#: The methods. "fitted" is the Moebius map that meets the landmarks best, where the paper's takes
#: the first landmark to the centre and turns; "oracle" is fitted to the true correspondence of all
#: vertices of the face, which is unknown in practice. "floor" is the face on itself.
PLAIN, FITTED, PAPER, ORACLE, FLOOR = "Moebius", "Moebius, fitted", "(34)", "oracle", "floor"
TITLES = {
    PLAIN: "Moebius, as the paper aligns",
    FITTED: "Moebius, least squares",
    PAPER: "the paper's: Moebius, then (34)",
    ORACLE: "best Moebius map, fitted to the truth",
    FLOOR: "the face registered to itself, on other triangles",
}
MEDIANS = f"""
| method | landmarks | all | {" | ".join(KINDS.values())} | fails |
|---|---:|---|---|---|---|---:|
| {{title}} | {{landmarks}} | {{all}} | {
    " | ".join(f"{{{kind}}}" for kind in KINDS)
} | {{fails}} |"""
CHANGES = """
| landmarks | against | median change | (34) better on |
|---:|---|---|---:|
| {landmarks} | {against} | {change} | {better} |"""


def registration(*, pairs: int = 30, algorithm: str = "cem") -> Section:
    """Measure the error of registration against the true correspondence of faces.

    Pairs of faces of the ICT face model, whose correspondence is known at every vertex: other
    people, other expressions of one person, and both. Each is mapped to the disk by an algorithm
    and registered by the paper's method (Moebius alignment, then (34)) with 0, 3, 6 and 20
    landmarks, and by Moebius maps alone. ``CEMBENCH_ICT_FACE`` names the model's folder.

    The two faces of a pair have different triangles (8,000 and 9,000), so that no method gains from
    equal meshes. What the triangles alone cost is measured too: the first face registered to
    itself.
    """
    rows, modes = measured(pairs, algorithm)
    files = {FIGURE: png(draw(rows), dpi=130), PAIRS: csv_of(rows)}
    return Section(parts(rows, modes), PAGE, files)


@dataclass(frozen=True)
class Face:
    """A sample on a mesh of its own, its map, and where the model's vertices lie on it."""

    mesh: DiskMesh
    z: np.ndarray
    landmarks: np.ndarray
    whole: np.ndarray


@dataclass(frozen=True)
class Row:
    """The error of one method on one pair: None where it gave no map."""

    pair: int
    kind: str
    method: str
    landmarks: int
    error: float | None


def face(seed: int, expression: str, faces: int, algorithm: str) -> Face:
    """Return a sample with its conformal map and its landmarks."""
    mesh = ict_face(faces, seed=seed, expression=expression, part="disk")
    assert isinstance(mesh, DiskMesh)
    landmarks = landmarks_of(triangulation("disk", faces))
    z = parameterize(mesh, algorithm).z
    whole = sample(load_model(), seed, expression)
    return Face(mesh, z, np.array(list(landmarks.values())), whole)


def errors_of_pair(
    first: Face, other: Face, itself: Face | None = None
) -> dict[tuple[str, int], float]:
    """Return the mean error of each method that gave a map, by method and number of landmarks.

    `itself` is the first face on the other one's triangles.

    An error is the distance in space between where a vertex of the first face is carried on the
    other one and where it truly belongs, over the vertices of the face without neck, skull and
    sockets, weighted by area, in percent of the distance between the outer corners of the eyes.
    """
    made = triangulation("disk", FACES[0])
    seen = np.flatnonzero(made.kept < NARROW)
    weights = vertex_areas(first.mesh)[seen]
    truth = other.whole[made.kept[seen]]
    unit = np.linalg.norm(np.subtract(*other.whole[[LANDMARKS[name] for name in EYES]]))

    def error(points: np.ndarray) -> float:
        away = np.linalg.norm(points - truth, axis=1)
        share = float(100 * np.average(away, weights=weights) / unit)
        return round(share, DIGITS)  # as the CSV has it, so that the page can be made from it

    def carried(uv: np.ndarray, z: np.ndarray) -> float:
        where, weights = locate(uv, other.mesh.F, z[seen], nearest=True)
        return error(interpolated(weights, other.mesh.V[other.mesh.F[where]]))

    errors: dict[tuple[str, int], float] = {}
    stretch = _stretch(other)
    true_image = _interpolated(truth, other, other.z)
    best = fitted(first.z[seen], true_image, weights * _interpolated(truth, other, stretch))
    errors[ORACLE, 0] = carried(other.z, _applied(best, first.z))
    if itself is not None:
        errors[FLOOR, 0] = errors_of_pair(first, itself)[PLAIN, COUNTS[-1]]
    for count in COUNTS:
        own, others = first.landmarks[:count], other.landmarks[:count]
        z = centred(first.mesh, first.z, own)
        moved = aligned(other.mesh, other.z, others, first.mesh, z, own)
        errors[PLAIN, count] = carried(moved, z)
        if not count:
            continue
        move = fitted(first.z[own], other.z[others], stretch[others])
        errors[FITTED, count] = carried(other.z, _applied(move, first.z))
        try:
            check_order(list(LANDMARKS)[:count], z[own], moved[others], ("first", "other"))
            uv = register(other.mesh, moved, others, z[own]).uv
        except (AlgorithmFailed, ParameterError):
            continue  # counted as a failure
        errors[PAPER, count] = carried(uv, z)
    return errors


#: So many of the model's first vertices are the face without neck, skull and sockets.
NARROW = 6_706
EYES = ("eye_outer_right", "eye_outer_left")


def _stretch(face: Face) -> np.ndarray:
    """Return the square of the factor from distances in the disk to those in space, (n,)."""
    image = np.bincount(
        face.mesh.F.ravel(),
        weights=np.repeat(signed_areas(face.z, face.mesh.F) / 3, 3),
        minlength=face.mesh.n,
    )
    return vertex_areas(face.mesh) / image


def _interpolated(points: np.ndarray, face: Face, values: np.ndarray) -> np.ndarray:
    """Return the values (p,) at points of the surface, of values (n,) at its vertices."""
    import igl  # slow to load

    _, faces, on = igl.point_mesh_squared_distance(points, np.array(face.mesh.V), face.mesh.F)
    corners = face.mesh.F[np.asarray(faces)]
    a, b, c = (np.ascontiguousarray(face.mesh.V[corners[:, k]]) for k in range(3))
    weights = igl.barycentric_coordinates(np.asarray(on), a, b, c)
    return np.einsum("pc,pc->p", np.asarray(weights), values[corners])


def _applied(move: Moebius, z: np.ndarray) -> np.ndarray:
    moved = move(z)
    return moved / np.maximum(np.abs(moved), 1.0)


def fitted(z: np.ndarray, targets: np.ndarray, weights: np.ndarray) -> Moebius:
    """Return the Moebius map of the disk that brings points nearest to their targets.

    Weighted least squares over its three degrees of freedom, from eight turns. With weights that
    turn distances in the disk into those on the surface, the latter count.
    """

    def move(x: np.ndarray) -> Moebius:
        a = complex(x[0], x[1])
        return to_centre(a / (1 + abs(a)), x[2])

    def apart(x: np.ndarray) -> np.ndarray:
        away = np.sqrt(weights / weights.sum()) * (move(x)(z) - targets)
        return np.concatenate([away.real, away.imag])

    starts = ([0.0, 0.0, turn] for turn in np.arange(8) * np.pi / 4)
    return move(min((optimize.least_squares(apart, x) for x in starts), key=lambda f: f.cost).x)


def specimens(pairs: int) -> list[tuple[str, tuple[int, str], tuple[int, str]]]:
    """Return the kind of each pair, and the seed and expression of its faces."""
    chosen = []
    for k in range(pairs):
        kind = list(KINDS)[k % 3]
        other = 1_000 + k if kind != "expression" else k
        chosen.append(
            (kind, (k, "neutral"), (other, "random" if kind != "identity" else "neutral"))
        )
    return chosen


def measured(pairs: int, algorithm: str) -> tuple[list[Row], int]:
    """Return a row for every pair and method, and how many identity modes there were."""
    rows = []
    for k, (kind, one, another) in enumerate(progress(specimens(pairs))):
        first, itself = (face(*one, faces, algorithm) for faces in FACES)
        other = face(*another, FACES[1], algorithm)
        errors = errors_of_pair(first, other, itself)
        rows += [
            Row(k, kind, method, count, errors.get((method, count))) for method, count in METHODS
        ]
    return rows, len(load_model().identities)


#: Every method with its number of landmarks, in the table's order.
METHODS = (
    *((PLAIN, count) for count in COUNTS),
    *((FITTED, count) for count in COUNTS[1:]),
    *((PAPER, count) for count in COUNTS[1:]),
    (ORACLE, 0),
    (FLOOR, 0),
)


def parts(rows: Sequence[Row], modes: int) -> list[Table | str]:
    """Return medians with 95 % intervals, and what (34) adds."""
    pairs = len({row.pair for row in rows})
    medians, changes = [], []
    for method, count in METHODS:
        mine = [row for row in rows if (row.method, row.landmarks) == (method, count)]
        by_kind = {kind: _cell([r for r in mine if r.kind == kind]) for kind in KINDS}
        fails = sum(row.error is None for row in mine) or ""
        landmarks = "" if method in (ORACLE, FLOOR) else count
        medians.append({"title": TITLES[method], "landmarks": landmarks, "all": _cell(mine),
                        **by_kind, "fails": fails})  # fmt: skip
    for count in COUNTS[1:]:
        for against, landmarks in ((PLAIN, count), (FITTED, count), (PLAIN, 0)):
            change = differences(rows, (PAPER, count), (against, landmarks))
            name = TITLES[against] if landmarks else "Moebius by curvature"
            better = f"{sum(c < 0 for c in change)} of {len(change)}"
            changes.append({"landmarks": count, "against": name, "better": better,
                            "change": _interval(change, "+.2f")})  # fmt: skip
    about = (
        f"{pairs} pairs ({modes} of 100 identity modes); median error in percent of the distance "
        "between the outer corners of the eyes, with the 95 % interval of the median; fails: pairs "
        "without a map."
    )
    then = "What (34) changes, pair by pair (error of (34) less that of the other):"
    return [about, Table(medians, MEDIANS), then, Table(changes, CHANGES)]


def differences(rows: Sequence[Row], one: tuple[str, int], other: tuple[str, int]) -> list[float]:
    """Return the error of one method less that of another on every pair that both have."""
    by_pair = {
        key: {r.pair: r.error for r in rows if (r.method, r.landmarks) == key}
        for key in (one, other)
    }
    both = [(by_pair[one][pair], by_pair[other].get(pair)) for pair in by_pair[one]]
    return [a - b for a, b in both if a is not None and b is not None]


def _cell(rows: Sequence[Row]) -> str:
    return _interval([row.error for row in rows if row.error is not None], ".2f")


def _interval(values: Sequence[float], form: str) -> str:
    if not values:
        return "-"
    around = median_interval(values)
    middle = format(float(np.median(values)), form)
    if around is None:
        return middle
    return f"{middle} [{around.low:{form}}, {around.high:{form}}]"


def draw(rows: Sequence[Row]) -> Figure:
    """Draw the error of every pair by method, medians with their intervals on top."""
    figure, axes = plt.subplots(figsize=(8.4, 4.4))
    colours = {PLAIN: "tab:orange", FITTED: "tab:green", PAPER: "tab:blue"}
    rng = np.random.default_rng(0)
    for shift, method in zip((-0.24, 0.0, 0.24), colours, strict=True):
        for k, count in enumerate(COUNTS):
            values = [
                r.error
                for r in rows
                if (r.method, r.landmarks) == (method, count) and r.error is not None
            ]
            if not values:
                continue
            at = k + shift
            spread = rng.uniform(-0.06, 0.06, len(values))
            axes.plot(at + spread, values, ".", ms=4, color=colours[method], alpha=0.35)
            around = median_interval(values)
            if around is not None:
                axes.plot([at, at], [around.low, around.high], color=colours[method], lw=3)
            middle = float(np.median(values))
            label = TITLES[method] if k == 1 else None
            axes.plot(at, middle, "o", ms=7, mec="white", color=colours[method], label=label)
    for method, style in ((ORACLE, "--"), (FLOOR, ":")):
        values = [r.error for r in rows if r.method == method and r.error is not None]
        axes.axhline(float(np.median(values)), color="0.4", ls=style, lw=1, label=TITLES[method])
    axes.set_xticks(range(len(COUNTS)), [f"{count} landmarks" for count in COUNTS])
    axes.set_ylabel("error, % of the outer eye distance")
    axes.set_yscale("log")
    axes.set_yticks([0.2, 0.5, 1, 2, 5, 10, 20, 50])
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(mpl.ticker.NullFormatter())
    axes.grid(axis="y", alpha=0.3)
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(0, -0.1), ncols=2)
    figure.tight_layout()
    return figure


def csv_of(rows: Sequence[Row]) -> str:
    """Return the figures of every pair as CSV, errors in percent."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("pair", "kind", "method", "landmarks", "error_percent"))
    for row in rows:
        error = "" if row.error is None else f"{row.error:.{DIGITS}f}"
        writer.writerow((row.pair, row.kind, row.method, row.landmarks, error))
    return text.getvalue()
