"""How good is the registration of Section 6 on scans? Error at landmarks that it was not told."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from cembench.papers.cem.morph import morph
from numpy.typing import NDArray

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.core.errors import AlgorithmFailed, ParameterError
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.results.intervals import median_interval

#: Of 51 landmarks in the usual order of faces (brows, nose, eyes, mouth): the tip of the nose,
#: which goes to the centre, and the outer corners of the eyes, whose distance is the unit.
TIP, EYES = 13, (19, 28)
LAYOUT = """
| landmarks told | scans | median error at the others | 95 % interval | largest | fails |
|---:|---:|---:|---|---:|---:|
| {told} | {scans} | {median:.2f} | {interval} | {largest:.2f} | {fails} |"""
Landmarks = NDArray[np.int64]


def expressions(files: Sequence[Path], *, algorithm: str = "direct-cem") -> Section:
    """Measure the error of registration on scans of one person, at landmarks left out.

        cembench fetch --group expressions
        python -m benchmarks expressions CACHE/datasets/chy-?.mat

    Each file holds a scan (`V`, `F`) and the vertices of its 51 landmarks (`landmark`, from 1). The
    first scan is registered to each other one, told all, half and a quarter of the landmarks, and
    the tip of the nose alone. An error is the distance between where a landmark that was not told
    is carried and where it is marked, in percent of the distance between the outer corners of the
    eyes; told all, that of the landmarks told. Figures only: scans of a person are not drawn.
    """
    first, *others = [read_scan(file) for file in progress(files)]
    rows, reasons = [], list[str]()
    for step in (1, 2, 4, len(first[1])):
        landmarks = told_of(len(first[1]), step)
        errors: list[float] = []
        worst = 0.0
        for other in others:
            try:
                between = errors_of(first, other, landmarks, algorithm)
            except (AlgorithmFailed, ParameterError) as error:
                reasons.append(f"{other[0].name}, {len(landmarks)} landmarks: {error}")
                continue
            errors.append(float(np.median(between)))
            worst = max(worst, float(between.max()))
        rows.append(row(landmarks, errors, worst, len(others) - len(errors)))
    about = (
        f"{len(others)} scans beside the first; errors in percent of the distance between the "
        "outer corners of the eyes: medians of a scan's landmarks, then the median over scans."
    )
    return Section([about, Table(rows, LAYOUT), *reasons])


def read_scan(file: Path) -> tuple[DiskMesh, Landmarks]:
    """Return the surface and the vertices of its landmarks, counted from 0.

    Raises
    ------
    ParameterError
        The file has no landmarks, or one of them is not a vertex.
    """
    mesh = read_mesh(file, arrays=("V", "F"))
    marked = np.asarray(scipy.io.loadmat(file).get("landmark", ())).ravel().astype(np.int64) - 1
    if not len(marked) or marked.min() < 0 or marked.max() >= mesh.n:
        raise ParameterError(
            f"{file}: landmark holds {len(marked)} numbers; give vertices from 1 to {mesh.n}."
        )
    return mesh, marked


def told_of(count: int, step: int) -> list[int]:
    """Return which landmarks are told, the tip of the nose first; every `step`-th of the others."""
    return [TIP, *(k for k in range(0, count, step) if k != TIP)] if step < count else [TIP]


def errors_of(
    first: tuple[DiskMesh, Landmarks],
    other: tuple[DiskMesh, Landmarks],
    landmarks: Sequence[int],
    algorithm: str,
) -> NDArray[np.float64]:
    """Return the errors in percent at the landmarks that were not told, or at all if all were."""
    pairs = {str(k): [int(first[1][k]), int(other[1][k])] for k in landmarks}
    path = morph([first[0], other[0]], pairs, algorithm=algorithm, pose="keep")
    left = [k for k in range(len(first[1])) if k not in landmarks] or list(landmarks)
    marked = other[0].V[other[1]]
    unit = np.linalg.norm(np.subtract(*marked[list(EYES)]))
    away = np.linalg.norm(path.at(1.0)[first[1][left]] - marked[left], axis=1)
    return np.asarray(100 * away / unit)


def row(
    landmarks: Sequence[int], errors: Sequence[float], worst: float, fails: int
) -> dict[str, Any]:
    """Return the table's row for one number of landmarks."""
    around = median_interval(errors)
    return {
        "told": len(landmarks),
        "scans": len(errors),
        "median": float(np.median(errors)) if errors else None,
        "interval": f"{around.low:.2f} to {around.high:.2f}" if around else "too few scans",
        "largest": worst if errors else None,
        "fails": fails,
    }
