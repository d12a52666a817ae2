"""The MATLAB programs of P. T. Choi and L. M. Lui, which Octave or MATLAB runs.

A variable of the environment names the file of each program's function ``map = f(v, f)``; what is
in its folder and below can be called by it. Octave lacks a few of MATLAB's functions that they
call: the folder `octave` has these, in as much as the programs need them. MATLAB has its own.
"""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import Any

from cembench.core.program import matlab_string, of_matlab_function
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from cembench.registry import external_program

#: Functions of MATLAB that Octave lacks.
SHIMS = Path(__file__).with_name("octave")
#: Maximum depth of calls: one of the programs follows a boundary by recursion.
DEPTH = 100_000


def declaration(variable: str, function: str, where: str) -> dict[str, Any]:
    """Return the declaration of a program whose function's file this variable names.

    Parameters
    ----------
    variable, function, where : str
        The variable, the usual name of the function, and where the program is published.

    """
    remedy = (
        f"Get it from {where}, let {variable} name the file of its function ({function}.m), and "
        "install Octave (in Debian: apt-get install octave-cli) or MATLAB"
    )
    named = os.environ.get(variable, "")
    if not Path(named).is_file():
        return {"command": f"{function}.m {{input}} {{output}}", "remedy": remedy}
    file = Path(named).absolute()
    declared = of_matlab_function(file)
    words = shlex.split(declared["command"])
    path = f"addpath(genpath({matlab_string(file.parent)})); "
    if declared["version"]:
        path = f"max_recursion_depth({DEPTH}); addpath({matlab_string(SHIMS)}); {path}"
    command = shlex.join([*words[:-1], path + words[-1]])
    return {**declared, "command": command, "remedy": remedy}


@external_program(
    "fdm-program",
    title="FDM, its authors' program",
    target="disk",
    source="Choi & Lui 2015; disk_conformal_map.m",
    **declaration(
        "CEMBENCH_FDM_PROGRAM",
        "disk_conformal_map",
        "https://github.com/garyptchoi/disk-conformal-map",
    ),
)
def fdm_program(mesh: DiskMesh) -> None:
    """Map a disk by the fast disk map, as its authors programmed it.

    The boundary's first vertex is the lowest-numbered one under Octave; `fdm` with `public_program`
    reads the same program.
    """


@external_program(
    "ldm-program",
    title="LDM, its authors' program",
    target="disk",
    source="Choi & Lui 2018; lineardiskmap.m",
    **declaration(
        "CEMBENCH_LDM_PROGRAM",
        "lineardiskmap",
        "the authors (https://www.math.cuhk.edu.hk/~ptchoi)",
    ),
)
def ldm_program(mesh: DiskMesh) -> None:
    """Map a disk by the linear disk map, as its authors programmed it.

    It scales the disk by the coordinates of all its vertices, where `ldm` takes the boundary's, and
    so turns long surfaces inside out.
    """


@external_program(
    "poly-annulus-program",
    title="PACM, its author's program",
    target="circular holes",
    source="Choi 2021; poly_annulus_conformal_map.m",
    **declaration(
        "CEMBENCH_POLY_ANNULUS_PROGRAM",
        "poly_annulus_conformal_map",
        "https://github.com/garyptchoi/poly-annulus-conformal-map",
    ),
)
def poly_annulus_program(mesh: HoledMesh) -> None:
    """Map a surface with holes to a disk with circular holes, as the author programmed it.

    Under Octave the cut between two boundaries is one of the shortest paths, not necessarily
    MATLAB's, and sequential quadratic programming takes the place of `fmincon`.
    """
