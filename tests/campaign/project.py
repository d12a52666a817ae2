"""All that the campaign uses of the package: as few names as possible, imported here alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cembench import CembenchError, TriangleMesh
from cembench.commands.cli import main as command_line
from cembench.mesh.files import read_mesh
from cembench.registry import Algorithm, load_registry
from cembench.results.records import Cell, Outcome
from cembench.running.measure import check_cell

__all__ = [
    "Algorithm",
    "CembenchError",
    "Outcome",
    "TriangleMesh",
    "algorithms",
    "check",
    "command_line",
    "read",
]


def read(path: Path) -> TriangleMesh:
    """Read a file as a user's script would, whatever the topology of its surface."""
    return read_mesh(path, TriangleMesh)


def algorithms() -> Mapping[str, Algorithm]:
    """Return the registered algorithms by name."""
    return load_registry().algorithms


def check(algorithm: Algorithm, mesh: TriangleMesh) -> tuple[Outcome, Any]:
    """Call an algorithm once and judge its map, as the process that measures a cell does."""
    cell = Cell(
        algorithm=algorithm.name,
        parameters=algorithm.arguments({}),
        code_hash="",
        mesh=mesh.name,
        mesh_hash=mesh.hash,
        repeats=1,
    )
    return check_cell(algorithm, mesh, cell)
