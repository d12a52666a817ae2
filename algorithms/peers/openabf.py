"""OpenABF, by its example program that flattens a mesh file."""

from __future__ import annotations

from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import external_program


@external_program(
    "openabf",
    title="OpenABF",
    target="free boundary",
    command="openabf_example_flatten {input} {output}",
    source="Sheffer, Levy, Mogilnitsky & Bogomyakov 2005; https://github.com/educelab/OpenABF",
    flat=True,
    remedy="Build the examples of https://github.com/educelab/OpenABF and put their folder into "
    "PATH",
)
def openabf(mesh: DiskMesh) -> None:
    """Map a disk by OpenABF: ABF++, then angle based LSCM.

    Untested: written from the example's source. The program writes the flattened surface itself, in
    single precision.
    """
