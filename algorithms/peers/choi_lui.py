"""The MATLAB programs of P. T. Choi and L. M. Lui, which Octave or MATLAB runs.

A variable of the environment names the file of each program's function ``map = f(v, f)``; what is
in its folder and below can be called by it. Octave lacks a few of MATLAB's functions that they
call: the folder `octave` has these, in as much as the programs need them. MATLAB has its own.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from cembench.core.program import matlab_string, of_matlab_function
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from cembench.registry import external_program

C = TypeVar("C", bound=Callable[..., Any])

#: Functions of MATLAB that Octave lacks.
SHIMS = Path(__file__).with_name("octave")
#: Maximum depth of calls: one of the programs follows a boundary by recursion.
DEPTH = 100_000


def matlab_program(name: str, function: str, where: str, **about: Any) -> Callable[[C], C]:
    """Declare the program whose function's file CEMBENCH_NAME, a variable, names.

    Parameters
    ----------
    name, function, where : str
        The algorithm's name, the usual name of the function, and where the program is published.
    **about
        As for :func:`cembench.registry.external_program`.
    """
    variable = f"CEMBENCH_{name.upper().replace('-', '_')}"
    remedy = (
        f"Get it from {where}, let {variable} name the file of its function ({function}.m), and "
        "install Octave (in Debian: apt-get install octave-cli) or MATLAB"
    )
    declared: dict[str, Any] = {"command": f"{function}.m {{input}} {{output}}"}
    named = Path(os.environ.get(variable, ""))
    if named.is_file():
        file = named.absolute()
        declared = of_matlab_function(file)
        words = shlex.split(declared["command"])
        path = f"addpath(genpath({matlab_string(file.parent)})); "
        if declared["version"]:
            path = f"max_recursion_depth({DEPTH}); addpath({matlab_string(SHIMS)}); {path}"
        declared["command"] = shlex.join([*words[:-1], path + words[-1]])
    return external_program(name, **about, **declared | {"remedy": remedy})


@matlab_program(
    "fdm-program",
    "disk_conformal_map",
    "https://github.com/garyptchoi/disk-conformal-map",
    title="FDM, its authors' program",
    target="disk",
    source="Choi & Lui 2015; disk_conformal_map.m",
)
def fdm_program(mesh: DiskMesh) -> None:
    """Map a disk by the fast disk map, as its authors programmed it.

    The boundary's first vertex is the lowest-numbered one under Octave; `fdm` with `public_program`
    reads the same program.
    """


@matlab_program(
    "ldm-program",
    "lineardiskmap",
    "the authors (https://www.math.cuhk.edu.hk/~ptchoi)",
    title="LDM, its authors' program",
    target="disk",
    source="Choi & Lui 2018; lineardiskmap.m",
)
def ldm_program(mesh: DiskMesh) -> None:
    """Map a disk by the linear disk map, as its authors programmed it.

    It scales the disk by the coordinates of all its vertices, where `ldm` takes the boundary's, and
    so turns long surfaces inside out.
    """


@matlab_program(
    "poly-annulus-program",
    "poly_annulus_conformal_map",
    "https://github.com/garyptchoi/poly-annulus-conformal-map",
    title="PACM, its author's program",
    target="circular holes",
    source="Choi 2021; poly_annulus_conformal_map.m",
)
def poly_annulus_program(mesh: HoledMesh) -> None:
    """Map a surface with holes to a disk with circular holes, as the author programmed it.

    Under Octave the cut between two boundaries is one of the shortest paths, not necessarily
    MATLAB's, and sequential quadratic programming takes the place of `fmincon`.
    """
