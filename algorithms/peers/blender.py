"""Blender's three unwrapping methods, each in a process of Blender's own.

Blender is available as a program or as the Python module `bpy`. The module needs an older NumPy
than cembench, so it is installed in a separate environment. The variable CEMBENCH_BLENDER names
that environment's Python, or a Blender program.
"""

from __future__ import annotations

import importlib.util
import os
import shlex
import sys
from pathlib import Path
from typing import Any

from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import external_program

VARIABLE = "CEMBENCH_BLENDER"
_REMEDY = (
    "Install Blender; or `pip install bpy` in an environment of its own (it needs numpy < 2), and "
    f"let {VARIABLE} name the Python of that, or a Blender"
)
_SCRIPT = Path(__file__).with_name("blender_unwrap.py")


def blender_command() -> str:
    """Return the command that runs the script with the Blender that is installed."""
    named = os.environ.get(VARIABLE, "")
    this_python = sys.executable if importlib.util.find_spec("bpy") else ""
    program = named or this_python or "blender"
    words = [program, str(_SCRIPT)]
    if "blender" in Path(program).name:
        words = [program, "--background", "--factory-startup", "--python", str(_SCRIPT), "--"]
    return shlex.join(words)


_HOW: dict[str, Any] = {
    "target": "free boundary",
    "input": ".npz",
    "output": ".npz",
    "seconds": r"^solve: (\S+) s$",
    "remedy": _REMEDY,
    "version": blender_command(),
}


@external_program(
    "blender-angle-based",
    title="Blender, angle based",
    command=f"{blender_command()} {{input}} {{output}} ANGLE_BASED",
    source="Sheffer, Levy, Mogilnitsky & Bogomyakov 2005 (ABF++); Blender's uv.unwrap",
    **_HOW,
)
def blender_angle_based(mesh: DiskMesh) -> None:
    """Map a disk by Blender's angle based flattening, without a seam.

    Blender computes UVs in single precision, and moves them into the unit square.
    """


@external_program(
    "blender-conformal",
    title="Blender, conformal",
    command=f"{blender_command()} {{input}} {{output}} CONFORMAL",
    source="Levy, Petitjean, Ray & Maillot 2002 (LSCM); Blender's uv.unwrap",
    **_HOW,
)
def blender_conformal(mesh: DiskMesh) -> None:
    """Map a disk by Blender's least squares conformal map, without a seam.

    Blender computes UVs in single precision, and moves them into the unit square.
    """


@external_program(
    "blender-minimum-stretch",
    title="Blender, minimum stretch",
    command=f"{blender_command()} {{input}} {{output}} MINIMUM_STRETCH",
    source="SLIM; Blender's uv.unwrap, from version 4.3 on",
    **_HOW,
)
def blender_minimum_stretch(mesh: DiskMesh) -> None:
    """Map a disk by Blender's minimum stretch (SLIM), without a seam.

    Its energy measures isometry. Blender computes UVs in single precision.
    """
