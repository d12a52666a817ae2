"""Declares the program tutte.py as an algorithm: ``cembench run --plugin tutte_program.py``."""

import shlex
import sys

from cembench import DiskMesh, external_program


@external_program(
    "tutte-program",
    title="Tutte, a program",
    target="disk",
    command=f"{shlex.quote(sys.executable)} tutte.py {{input}} {{output}}",
    output=".txt",
)
def tutte_program(mesh: DiskMesh) -> None:
    """Every vertex in the middle of its neighbours, by a program of its own."""
