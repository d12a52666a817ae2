"""The command `repair`: turn triangles or polygons into an oriented manifold."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from cembench.commands.console import Json, err, note, out, print_json
from cembench.commands.options import FillHoles, Weld


class Keep(StrEnum):
    """The connected components to keep."""

    largest = "largest"
    all = "all"


def repair(
    mesh: Annotated[Path, typer.Argument(help="Mesh file: OBJ, OFF, PLY, STL or MAT.")],
    *,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="File for the repaired surface: OBJ, OFF, PLY or STL."),
    ],
    weld: Weld = None,
    fill_holes: FillHoles = 0,
    components: Annotated[
        Keep,
        typer.Option(help="Keep the component with the most triangles, or write a file for each."),
    ] = Keep.largest,
    force: Annotated[
        bool,
        typer.Option("--force", help="Overwrite the input, or existing files OUT_1, OUT_2, ..."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Repair a surface, print what was done, and write it.

    Steps, in order: faces with missing vertices dropped, polygons cut into
    triangles, coincident vertices welded, degenerate and duplicate triangles
    fixed or dropped, non-manifold edges and vertices split, triangles oriented
    consistently, components chosen, ears dropped, holes filled, isolated vertices
    removed. docs/repair.md describes each step.
    """
    from cembench.core.outputs import refuse_inputs, refuse_present
    from cembench.mesh.files import check_writable_format, write_mesh
    from cembench.mesh.topology import genus
    from cembench.workflows.repair import repair as mended

    check_writable_format(output, with_uv=False)
    refuse_inputs(output, [mesh], force=force)
    with err.status("repairing", spinner="line"):
        found = mended(mesh, weld=weld, fill_holes=fill_holes, components=components.value)
    files = [output]
    if len(found.meshes) > 1:
        files = [output.with_stem(f"{output.stem}_{k}") for k in range(1, len(found.meshes) + 1)]
        refuse_present(files, force=force)
    about: list[dict[str, Any]] = []
    for path, surface in zip(files, found.meshes, strict=True):
        write_mesh(path, surface)
        about.append(
            {
                "vertices": surface.n,
                "faces": surface.m,
                "boundary_loops": len(surface.loops),
                "genus": genus(surface.F, surface.n, len(surface.loops)),
                "output": str(path),
            }
        )
    if as_json:
        print_json({"input": str(mesh), "steps": found.steps, "surfaces": about})
        return
    for notice in found.notices:
        note(f"{mesh.stem}: {notice}")
    print_steps(found.steps)
    for one in about:
        out.print(
            f"{one['output']}: {one['vertices']:,} vertices, {one['faces']:,} triangles, "
            f"{one['boundary_loops']} boundary loops, genus {one['genus']}",
            soft_wrap=True,
        )


def print_steps(steps: Mapping[str, int]) -> None:
    """Print how often each step of a repair was applied."""
    from cembench.mesh.repair import TITLES, Step

    for step, count in steps.items():
        out.print(f"{count:>9,}  {TITLES[Step(step)]}", style="" if count else "dim")


#: Each command with the examples in its help.
VERBS = (
    (
        repair,
        "Examples:  cembench repair scan.obj -o mended.obj  ·  "
        "cembench repair scan.ply -o mended.ply --weld 1e-6 --fill-holes 20  ·  "
        "cembench repair parts.stl -o part.obj --components all --json",
    ),
)
