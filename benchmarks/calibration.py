"""Fit the levers of the stand-ins to what the paper prints of its models."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from cembench.surfaces.catalogue import body_mesh
from cembench.surfaces.levers import NO_LEVERS, Levers, hardened
from cembench.surfaces.rows import FILE, ROWS, Row
from numpy.typing import NDArray

from benchmarks.measuring import progress
from benchmarks.pages import ROOT, Section, Table
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import CembenchError
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.results.columns import FITTED
from cembench.results.papers import usual_paper

Real = NDArray[np.float64]
#: Models whose printed figures of FDM are none, or unlike those of all other algorithms.
BY_LDM = ("Statue of Liberty", "Isis Statue", "Bimba Statue")
#: Steps of the levers that weigh alike, and their bounds.
STEP = {"jag": 0.15, "smooth": 1.0, "even": 0.3, "gain": 0.3, "non_delaunay": 0.05}
BOUND = {
    "jag": (0, 1.5),
    "smooth": (0.05, 40),
    "even": (0, 2),
    "gain": (0, 4),
    "non_delaunay": (0, 0.3),
}


@dataclass(frozen=True)
class Recipe:
    """The levers that are fitted, and where they start; others stay as there."""

    varied: tuple[str, ...]
    start: Levers
    rounds: int = 8
    last_rounds: int = 5


def _recipe(varied: str, rounds: int = 8, **start: float) -> Recipe:
    return Recipe(tuple(varied.split()), Levers(centred=True, **start), rounds)


#: Rows whose printed mean is below that of the body are smoothed, others are roughened.
_SMOOTHER, _ROUGHER = "jag smooth even", "jag gain non_delaunay"
RECIPES: dict[str, Recipe] = {
    "nefertiti-stand-in": _recipe(_SMOOTHER, jag=0.2, smooth=12, even=0.5, cut=0.5),
    "cowboy-hat-stand-in": _recipe(_ROUGHER, jag=0.05, gain=0.6, non_delaunay=0.15),
    "chinese-vase-stand-in": _recipe(_ROUGHER, jag=0.4, non_delaunay=0.11, gain=1.7),
    "bourbon-bottle-stand-in": _recipe(
        "jag smooth non_delaunay", jag=0.02, smooth=6, non_delaunay=0.2
    ),
    "foot-stand-in": _recipe(_SMOOTHER, jag=0.2, smooth=4, even=1, cut=0.34),
    "chinese-lion-stand-in": _recipe(_SMOOTHER, jag=0.75, smooth=0.7, even=1.3),
    "david-head-stand-in": _recipe(_ROUGHER, jag=0.1, non_delaunay=0.2, gain=1.7),
    "stanford-bunny-stand-in": _recipe(_ROUGHER, jag=0.88, gain=0.54, non_delaunay=0.03),
    "human-brain-stand-in": _recipe(_SMOOTHER, jag=0.45, smooth=0.1, even=1.2),
    "ho-pouting-face-stand-in": _recipe(_SMOOTHER, jag=0.5, smooth=3, even=0.7),
    "ho-neutral-face-stand-in": _recipe(_SMOOTHER, jag=0.5, smooth=3, even=0.7),
    "left-hand-stand-in": _recipe(_SMOOTHER, jag=0.58, smooth=3, even=0.9),
    "statue-of-liberty-stand-in": _recipe(_ROUGHER, jag=0.2, gain=1.8, non_delaunay=0.03),
    # No `even`, which would flatten noses, and one smoothing: the four show one person.
    "liu-neutral-face-stand-in": _recipe("jag", jag=0.85, smooth=20.5),
    "liu-smile-face-stand-in": _recipe("jag", jag=0.85, smooth=20.5),
    "liu-pouting-face-stand-in": _recipe("jag", jag=0.85, smooth=20.5),
    "liu-wry-face-stand-in": _recipe("jag", jag=0.85, smooth=20.5),
    "isis-statue-stand-in": _recipe(_SMOOTHER, jag=0.5, smooth=5, even=0.7),
    "bimba-statue-stand-in": _recipe(_ROUGHER, jag=0.5, gain=1.1, non_delaunay=0.02),
    "knit-cap-man-stand-in": _recipe(_SMOOTHER, 5, jag=1.28, smooth=0.25, even=1.9),
}
#: Cheaper than FDM, and with nearly its figures: the first rounds are by it.
QUICK = "direct-cem"
#: The largest error of a figure, as a logarithm, at which a fit ends.
GOAL = 0.012


def calibration(
    stand_ins: Sequence[str] = (), *, levers: Sequence[str] = (), start: Sequence[str] = ()
) -> Section:
    """Fit levers of stand-ins to the printed E_C, mean and SD of FDM (LDM where FDM has none).

    Least-norm Gauss-Newton with Broyden's updates on the logarithms; `direct-cem` does the first
    rounds. RECIPES say which levers are fitted from where, or `levers` and `start` do: ``--levers
    jag gain --start jag=0.3 gain=1``. With ``--write-docs`` they are kept in meshes_gen/rows.toml.
    """
    fitted = dict(ROWS)
    for name in progress(list(stand_ins or ROWS)):
        given = {key: float(value) for key, value in (one.split("=") for one in start)}
        own = Recipe(tuple(levers), replace(Levers(centred=True), **given))
        fitted[name] = fit(name, own if levers else RECIPES[name])
    rows = [
        {"name": name, **asdict(row.levers), **ratios(row)}
        for name, row in fitted.items()
        if name in (stand_ins or ROWS)
    ]
    return Section([Table(rows, LAYOUT)], files={str(FILE.relative_to(ROOT)): text_of(fitted)})


LAYOUT = """
| stand-in | jag | smooth | even | gain | not Delaunay | cut | E_C, times printed | mean | SD |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {name} | {jag:.3f} | {smooth:.2f} | {even:.2f} | {gain:.2f} | {non_delaunay:.1%} | {cut:.3f} \
| {conformal_energy:.2f} | {angle_error_mean_deg:.2f} | {angle_error_sd_deg:.2f} |"""


def printed(row: Row, algorithm: str) -> dict[str, float]:
    """Return what the paper prints of a model's map by an algorithm."""
    paper = usual_paper()
    figures = {name: paper.printed_figure(name, algorithm, row.model) for name in FITTED}
    return {name: figure for name, figure in figures.items() if figure is not None}


def ratios(row: Row) -> dict[str, float]:
    """Return the reached figures over the printed ones."""
    wanted = printed(row, row.fitted)
    return {name: row.reached[name] / wanted[name] for name in FITTED}


def figures(mesh: DiskMesh, algorithm: str) -> Real:
    """Return the fitted figures of a map, in their order."""
    mapper = load_registry().algorithm(algorithm)
    uv = mapper.function(mesh.fresh(), **mapper.arguments({})).uv
    found = all_metrics(mesh, uv)
    return np.array([max(float(found[name]), 1e-7) for name in FITTED])


def fit(name: str, recipe: Recipe) -> Row:
    """Return a row with the levers that come nearest to its printed figures."""
    row, first, varied = ROWS[name], recipe.start, recipe.varied
    by = "ldm" if row.model in BY_LDM else "fdm"
    target = np.log([printed(row, by)[figure] for figure in FITTED])
    bare = body_mesh(name, row.faces, cut=first.cut)
    # The boundary slides once, before the levers that are fitted.
    body = hardened(bare, Levers(centred=first.centred))
    log(name, "body", np.exp(np.log(figures(body, QUICK)) - target))
    tried: dict[str, dict[Levers, Real]] = {QUICK: {}, by: {}}

    def errors(levers: Levers, algorithm: str) -> Real:
        off = np.log(figures(hardened(body, levers), algorithm)) - target
        tried[algorithm][levers] = off
        log("  ", algorithm, np.exp(off), levers)
        return off

    best = replace(first, centred=False, cut=0.0)
    for algorithm, most in ((QUICK, recipe.rounds), (by, recipe.last_rounds)):
        while most > 0:
            descent(best, varied, lambda one, a=algorithm: errors(one, a), most)
            before, best = best, min(tried[algorithm], key=lambda one: worst(tried[algorithm][one]))
            if before == best or worst(tried[algorithm][best]) < GOAL:
                break
            most //= 2  # once more with another derivative
    kept = replace(rounded(best), centred=first.centred, cut=first.cut)
    reached = figures(hardened(bare, kept), by)
    log(name, "kept", reached / np.exp(target), kept)
    return replace(
        row,
        levers=kept,
        fitted=by,
        reached=dict(zip(FITTED, map(float, reached), strict=True)),
    )


def worst(errors: Real) -> float:
    """Return the largest of some logarithms of ratios."""
    return float(np.abs(errors).max())


def descent(
    start: Levers, varied: Sequence[str], errors: Callable[[Levers], Real], most: int
) -> None:
    """Try at most `most` Gauss-Newton steps of least norm, with Broyden's updates."""
    steps = np.array([STEP[name] for name in varied])
    low, high = (np.array([BOUND[name][k] for name in varied]) / steps for k in range(2))

    def at(x: Real) -> Levers:
        return replace(start, **dict(zip(varied, map(float, x * steps), strict=True)))

    x = np.array([getattr(start, name) for name in varied]) / steps
    y = errors(at(x))
    if worst(y) < GOAL:
        return
    J = np.zeros((3, len(x)))
    for k in range(len(x)):
        z = x.copy()
        z[k] += 0.6 if z[k] + 0.6 < high[k] else -0.6
        J[:, k] = (errors(at(z)) - y) / (z[k] - x[k])
    for _ in range(most):
        step = -np.linalg.solve(J.T @ J + 1e-3 * np.eye(len(x)), J.T @ y)
        z = np.clip(x + step * min(1.0, 1.8 / np.abs(step).max()), low, high)
        s = z - x
        if s @ s < 1e-8:
            return
        try:
            found = errors(at(z))
        except CembenchError as error:  # folded in space, or no map
            log("fails:", str(error)[:80])
            J = 1.7 * J
            continue
        J = J + np.outer(found - y - J @ s, s) / (s @ s)
        x, y = z, found
        if worst(y) < GOAL:
            return


def rounded(levers: Levers) -> Levers:
    """Return levers of four digits."""
    return replace(levers, **{name: float(f"{getattr(levers, name):.4g}") for name in STEP})


def log(*words: object) -> None:
    """Print progress to the error stream."""
    print(*words, file=sys.stderr, flush=True)


def text_of(rows: Mapping[str, Row]) -> str:
    """Return the rows' levers and figures as TOML."""
    parts = [
        "# Levers of the stand-ins, and the figures reached with seed 0 by the algorithm whose\n"
        "# printed figures they are fitted to; made by `python -m benchmarks calibration`.\n"
    ]
    for name, row in rows.items():
        if not row.fitted:
            continue
        usual = asdict(NO_LEVERS)
        own = {key: value for key, value in asdict(row.levers).items() if value != usual[key]}
        own_text = ", ".join(f"{key} = {str(value).lower()}" for key, value in own.items())
        reached = ", ".join(f"{key} = {value:.6g}" for key, value in row.reached.items())
        parts.append(
            f'[{name}]\nfitted = "{row.fitted}"\n'
            f"levers = {{ {own_text} }}\nreached = {{ {reached} }}\n"
        )
    return "\n".join(parts)
