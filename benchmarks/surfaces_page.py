"""How hard are the stand-ins: old, calibrated, beside the models and what is printed?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import exp, log
from pathlib import Path
from statistics import fmean, pstdev
from typing import Any

import numpy as np
from cembench.surfaces.catalogue import body_mesh, stand_in
from cembench.surfaces.levers import NO_LEVERS, hardened
from cembench.surfaces.rows import ROWS

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.laplacian import half_cotangents
from cembench.conformal.metrics import all_metrics, angle_errors
from cembench.mesh.datasets import is_fetched
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.registry import load_registry
from cembench.report.document import ORIGINS
from cembench.results.columns import FITTED
from cembench.results.papers import find_paper
from cembench.running.plan import distribute_parameters, provenance_of

PAPER = find_paper("cem")
#: The algorithms whose printed figures are compared; Direct CEM shows where the energy lies.
ALGORITHMS = ("fdm", "ldm", "cem")
ANATOMY_BY = "direct-cem"
#: Kinds of lines of a row.
PRINTED, MODEL, OLD, CALIBRATED = "printed", "model", "old stand-in", "stand-in"
#: Rows of which other seeds are measured, and how many.
SEEDS = 10
FIGURES = """
| row | | FDM: E_C | mean | SD | LDM: E_C | mean | SD | CEM: E_C | mean | SD | iterations |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {row} | {kind} | {fdm[0]} | {fdm[1]} | {fdm[2]} | {ldm[0]} | {ldm[1]} | {ldm[2]} \
| {cem[0]} | {cem[1]} | {cem[2]} | {iterations:.0f} |"""
PREDICTED = """
| predicted | rows | geometric mean of the ratio to print | scatter, times | within 25 % \
| FDM's printed figure instead | scatter, times | within 25 % |
|---|---:|---:|---:|---:|---:|---:|---:|
| {what} | {n} | {mean:.2f} | {scatter:.2f} | {near} | {own[mean]:.2f} | {own[scatter]:.2f} \
| {own[near]} |"""
ANATOMY = """
| row | | scatter of the boundary's angles | triangles at the boundary | their share of E_C \
| their angle error | that of the rest |
|---|---|---:|---:|---:|---:|---:|
| {row} | {kind} | {scatter:.1f} | {rim:.1%} | {share:.2f} | {error:.1f} | {inside:.2f} |"""
SPREAD = """
| row | FDM: E_C, times printed | mean | SD | CEM: E_C, times printed | mean | SD | iterations |
|---|---:|---:|---:|---:|---:|---:|---|
| {row} | {fdm[0]} | {fdm[1]} | {fdm[2]} | {cem[0]} | {cem[1]} | {cem[2]} | {iterations} |"""
Figures = Mapping[str, Any]


def surfaces_page(
    *, mesh: Sequence[Path] = (), most: int = 2_000_000, spread: Sequence[str] = ()
) -> Section:
    """Compare stand-ins, old ones, and models with the printed figures.

    Maps them with FDM, LDM and CEM; rows of more than `most` triangles are left out. Models are
    fetched ones, or named with --mesh; a stand-in beside its model is a control. `spread` names
    stand-ins of which ten seeds are measured.
    """
    registry = load_registry()
    fetched = [d.path for d in registry.datasets.values() if d.paper_row and is_fetched(d)]
    models = dict(known_models([*mesh, *fetched]))
    names = [name for name, row in ROWS.items() if row.faces <= most]
    lines = []
    for name in progress(names):
        row = ROWS[name]
        lines.append({"row": row.model, "kind": PRINTED, **in_print(row.model)})
        made = {OLD: stand_in(name, levers=NO_LEVERS), CALIBRATED: stand_in(name)}
        if row.model in models:
            made = {MODEL: models[row.model], **made}
        for kind, surface in made.items():
            figures = measured(surface, row.model if kind == MODEL else "")
            anatomy = anatomy_of(surface) if row.model in models else {}
            lines.append({"row": row.model, "kind": kind, **figures, **anatomy})
    parts = [
        "### Energies and angle errors",
        Table([as_text(line) for line in lines], FIGURES),
        "### What is predicted",
        Table(predictions(lines), PREDICTED),
        iterations_words(lines),
        "### Controls",
        Table([line for line in lines if "scatter" in line], ANATOMY),
    ]
    if spread:
        parts += ["### Other seeds", Table([spread_of(name) for name in progress(spread)], SPREAD)]
    return Section(parts, "docs/surfaces.md")


def known_models(files: Iterable[Path]) -> Iterator[tuple[str, DiskMesh]]:
    """The paper's own models among these files."""
    for path in files:
        mesh = read_mesh(path)
        standing = provenance_of(load_registry(), mesh)
        if standing.origin != "model":
            raise SystemExit(f"{path} is none of the paper's models; see `cembench fetch`.")
        yield standing.paper_row, mesh


def in_print(model: str) -> dict[str, Any]:
    """Return what the paper prints of a model."""
    figures = {
        one: [PAPER.printed_figure(figure, one, model) for figure in FITTED] for one in ALGORITHMS
    }
    return {**figures, "iterations": PAPER.printed_figure("iterations", "cem", model)}


def measured(mesh: TriangleMesh, model: str = "") -> dict[str, Any]:
    """Return the same figures of a surface; of a model, by the algorithms as the paper ran them."""
    mappers = [load_registry().algorithm(name) for name in ALGORITHMS]
    printed = PAPER.as_printed(model, mappers) if model else {}
    arguments = distribute_parameters(mappers, printed)
    found: dict[str, Any] = {}
    for mapper in mappers:
        result = mapper.function(mesh.fresh(), **arguments[mapper.name])
        metrics = all_metrics(mesh, result.uv)
        found[mapper.name] = [metrics[figure] for figure in FITTED]
        if mapper.name == "cem":
            found["iterations"] = result.iterations
    return found


def as_text(line: Figures) -> dict[str, Any]:
    """Return a line with figures as text, those marked to which the stand-in was fitted."""
    row = next(one for one in ROWS.values() if one.model == line["row"])
    texts = dict(line)
    for name in ALGORITHMS:
        mark = ORIGINS["fitted"][1] if line["kind"] == CALIBRATED and name == row.fitted else ""
        texts[name] = [
            "-" if value is None else f"{value:.{digits}f}{mark}"
            for value, digits in zip(line[name], (4, 2, 2), strict=True)
        ]
    return texts


def predictions(lines: Sequence[Figures]) -> list[dict[str, Any]]:
    """Return how the figures that were not fitted agree with print, and how FDM's print does."""
    titles = ("E_C", "mean", "SD")
    printed = {line["row"]: line for line in lines if line["kind"] == PRINTED}
    made = {line["row"]: line for line in lines if line["kind"] == CALIBRATED}
    rows = [row for row in printed if all(printed[row]["fdm"])]
    table = []
    for name in ("ldm", "cem"):
        for k, title in enumerate(titles):
            wanted = [printed[row][name][k] for row in rows]
            here = agreement([made[row][name][k] for row in rows], wanted)
            own = agreement([printed[row]["fdm"][k] for row in rows], wanted)
            table.append({"what": f"{name.upper()}: {title}", "n": len(rows), **here, "own": own})
    return table


def agreement(figures: Sequence[float], wanted: Sequence[float]) -> dict[str, Any]:
    """Return the geometric mean of ratios, their scatter as a factor, and how many are near 1."""
    logs = [log(one / other) for one, other in zip(figures, wanted, strict=True)]
    near = sum(abs(exp(one) - 1) <= 0.25 for one in logs)
    return {"mean": exp(fmean(logs)), "scatter": exp(pstdev(logs)), "near": near}


def iterations_words(lines: Sequence[Figures]) -> str:
    """Return on how many rows CEM stops near the printed number of iterations."""
    wanted = {line["row"]: line["iterations"] for line in lines if line["kind"] == PRINTED}

    def near(kind: str) -> str:
        rows = [line for line in lines if line["kind"] == kind]
        close = sum(abs(line["iterations"] - wanted[line["row"]]) <= 5 for line in rows)
        return f"{close} of {len(rows)}"

    return (
        f"CEM's iterations are within 5 of the printed ones on {near(CALIBRATED)} stand-ins, on "
        f"{near(OLD)} old ones, and on {near(MODEL)} models."
    )


def anatomy_of(mesh: DiskMesh) -> dict[str, float]:
    """Return where the energy of a disk map lies: at the boundary, or inside."""
    mapper = load_registry().algorithm(ANATOMY_BY)
    z = mapper.function(mesh.fresh(), **mapper.arguments({})).uv[mesh.F]
    errors = np.square(angle_errors(mesh, mapper.function(mesh.fresh()).uv)).mean(axis=1)
    sides = np.abs(z[:, [2, 0, 1]] - z[:, [1, 2, 0]]) ** 2
    area = ((z[:, 1] - z[:, 0]).conj() * (z[:, 2] - z[:, 0])).imag / 2
    energy = (half_cotangents(mesh.V, mesh.F) * sides).sum(axis=1) / 2 - area
    rim = np.isin(mesh.F, mesh.loops[0]).any(axis=1)
    return {
        "scatter": float(np.std(boundary_corners(mesh))),
        "rim": float(rim.mean()),
        "share": float(energy[rim].sum() / energy.sum()),
        "error": float(np.sqrt(errors[rim].mean())),
        "inside": float(np.sqrt(errors[~rim].mean())),
    }


def boundary_corners(mesh: TriangleMesh) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the angle of the surface at each boundary vertex, in degrees."""
    angles = np.degrees(np.arctan2(1, 2 * half_cotangents(mesh.V, mesh.F)))
    total = np.bincount(mesh.F.ravel(), angles.ravel(), mesh.n)
    return np.asarray(total[mesh.loops[0]])


def spread_of(name: str) -> dict[str, Any]:
    """Return the figures of ten seeds of a stand-in's levers over the printed ones, as ranges."""
    row, wanted = ROWS[name], in_print(ROWS[name].model)
    body = body_mesh(name, row.faces, cut=row.levers.cut)
    found = [measured(hardened(body, row.levers, seed)) for seed in range(SEEDS)]

    def ranges(algorithm: str) -> list[str]:
        ratios = np.array([one[algorithm] for one in found]) / np.array(wanted[algorithm])
        ends = zip(ratios.min(axis=0), ratios.max(axis=0), strict=True)
        return [f"{low:.2f} to {high:.2f}" for low, high in ends]

    counts = sorted(one["iterations"] for one in found)
    return {
        "row": ROWS[name].model,
        **{algorithm: ranges(algorithm) for algorithm in ("fdm", "cem")},
        "iterations": ", ".join(map(str, counts)) + f" (printed {wanted['iterations']:.0f})",
    }
