"""The command `repair`: turn triangles or polygons into an oriented manifold."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from cembench.api.repair import repair as repair_surface
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, note, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Force

#: What the tables beside an output number, and the heading of its column.
_NUMBERED = {"vertices": "vertex", "faces": "triangle"}


Output = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        help="File for the repaired surface: OBJ, OFF, PLY or STL; of several components, one "
        "file each. OUTPUT_vertices.csv and OUTPUT_faces.csv beside it give the number that "
        "each vertex and triangle had.",
    ),
]


@app.command(
    epilog="Examples:  cembench repair scan.obj -o mended.obj  ·  "
    "cembench repair scan.ply -o mended.ply --weld 1e-6 --fill-holes 20  ·  "
    "cembench repair parts.stl -o part.obj --components all --json"
)
@from_api(
    repair_surface,
    without=("surface",),
    weld="--weld TOLERANCE",
    fill_holes="--fill-holes N",
)
def repair(
    call: Call,
    mesh: Annotated[Path, typer.Argument(help="Mesh file: OBJ, OFF, PLY, STL or MAT.")],
    *,
    output: Output,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the repaired surfaces, and print what was done."""
    from cembench.core.overwriting import refuse_inputs, refuse_present
    from cembench.mesh.cut import write_numbers
    from cembench.mesh.files import check_writable_format, write_mesh
    from cembench.mesh.topology import genus

    check_writable_format(output, with_uv=False)
    refuse_inputs(output, [mesh], force=force)
    with SHOWN.busy("repairing"):
        repaired = call(mesh)
    files = [output]
    if len(repaired.meshes) > 1:
        files = [output.with_stem(f"{output.stem}_{k}") for k in range(1, len(repaired.meshes) + 1)]
    tables = [[file.with_name(f"{file.stem}_{of}.csv") for of in _NUMBERED] for file in files]
    beside = [table for of_file in tables for table in of_file]
    refuse_present([*files[len(files) == 1 :], *beside], force=force)
    about: list[dict[str, Any]] = []
    for path, of_file, old, surface in zip(
        files, tables, repaired.origins, repaired.meshes, strict=True
    ):
        write_mesh(path, surface)
        for table, what, numbers in zip(of_file, _NUMBERED.values(), old, strict=True):
            write_numbers(table, what, numbers)
        about.append(
            {
                "vertices": surface.n,
                "faces": surface.m,
                "boundary_loops": len(surface.loops),
                "genus": genus(surface.F, surface.n, surface.loops),
                "output": str(path),
                "originals": [str(table) for table in of_file],
            }
        )
    if as_json:
        kept = repaired.kept._asdict()
        print_json({"input": str(mesh), "kept": kept, "steps": repaired.steps, "surfaces": about})
        return
    for notice in repaired.notices:
        note(f"{mesh.stem}: {notice}")
    out.print(f"kept: {repaired.kept}")
    print_steps(repaired.steps)
    for one in about:
        out.print(
            f"{one['output']}: {one['vertices']:,} vertices, {one['faces']:,} triangles, "
            f"{one['boundary_loops']} boundary loops, genus {one['genus']}",
            soft_wrap=True,
        )


def print_steps(steps: Mapping[str, int]) -> None:
    """Print how often each step of a repair was applied."""
    from cembench.mesh.repair import Step

    titles = {step.value: step.meaning for step in Step}
    for name, count in steps.items():
        out.print(f"{count:>9,}  {titles[name]}", style="" if count else "dim")
