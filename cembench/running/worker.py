"""The process that measures one cell: ``python -m cembench.running.worker FOLDER``.

FOLDER holds ``job.json`` (the cell and the plug-ins) and ``mesh.npz`` (a mesh that was checked);
the worker adds ``uv.npz`` and last ``outcome.json``. If that file is missing, the worker died.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from cembench.geometry.mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.records import Cell
from cembench.registry import load_registry
from cembench.running.measure import measure_cell

_MESH_TYPES = {kind.__name__: kind for kind in (TriangleMesh, DiskMesh, HoledMesh)}


def main(folder: Path) -> None:
    """Measure the cell that the folder describes."""
    job = json.loads((folder / "job.json").read_text())
    cell = Cell.model_validate(job["cell"])
    algorithm = load_registry(job["plugins"]).algorithm(cell.algorithm)
    with np.load(folder / "mesh.npz") as arrays:
        V, F = arrays["V"], arrays["F"]
    V.setflags(write=False)
    F.setflags(write=False)
    mesh = _MESH_TYPES[job["mesh_type"]](V, F, cell.mesh, tuple(job["notices"]))
    outcome, uv = measure_cell(
        algorithm,
        algorithm.arguments(cell.parameters),
        mesh,
        solves=cell.solves,
        backend=cell.backend,
        repeats=cell.repeats,
        warm_up=cell.repeats > 1,
    )
    if uv is not None:
        np.savez(folder / "uv.npz", uv=uv)
    outcome = outcome.model_copy(update={"peak_memory_bytes": peak_memory_bytes()})
    (folder / "outcome.json").write_text(outcome.model_dump_json())


def peak_memory_bytes() -> int | None:
    """The largest resident set this process has had; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


if __name__ == "__main__":
    main(Path(sys.argv[1]))
