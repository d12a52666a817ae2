"""The command `cut`: cut a closed surface, or one with handles, into a disk."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cembench.api.cut import cut as cut_surface
from cembench.commands.app import app
from cembench.commands.console import Json, err, note, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Force
from cembench.commands.repair import print_steps
from cembench.core.errors import MeshError

Output = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        help="File for the disk: OBJ, OFF or PLY; OUTPUT_seam.csv beside it gives, for each "
        "vertex of the disk, the vertex of the surface that it is a copy of.",
    ),
]
Along = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|uv",
        help="Seams to cut along: a text file with the vertices of a seam on each line, counted "
        "from 0, or 'uv' for the seams of the mesh file's texture coordinates.",
    ),
]


@app.command(
    epilog="Examples:  cembench cut head.obj -o disk.obj  ·  "
    "cembench cut sphere.ply -o disk.ply --between 0 812  ·  "
    "cembench map torus.obj --cut -o torus_uv.obj"
)
@from_api(cut_surface, without=("surface", "through", "along"))
def cut(
    call: Call,
    mesh: Annotated[Path, typer.Argument(help="Mesh file: OBJ, OFF, PLY, STL or MAT.")],
    *,
    output: Output,
    between: Annotated[
        tuple[int, int] | None,
        typer.Option(metavar="A B", help="Two vertices that the cut must reach, counted from 0."),
    ] = None,
    along: Along = None,
    mend: Annotated[
        bool, typer.Option("--repair", help="Repair the file first, like `cembench repair`.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the disk and its seam, and print the length of the cut."""
    from cembench.api.repair import repair
    from cembench.core.notices import NoticeKind
    from cembench.core.overwriting import refuse_inputs, refuse_present
    from cembench.mesh.cut import read_seams, write_numbers
    from cembench.mesh.files import check_writable_format, write_mesh

    check_writable_format(output, with_uv=False)
    if output.suffix.lower() == ".stl":
        raise MeshError(
            f"{output}: STL stores no connectivity, so the cut would be closed again; allowed "
            "here: .obj, .off, .ply."
        )
    seam = output.with_name(f"{output.stem}_seam.csv")
    refuse_inputs(output, [mesh], force=force)
    refuse_present([seam], force=force)
    with err.status("cutting", spinner="line"):
        repaired = repair(mesh) if mend else None
        seams = along if along in (None, "uv") else read_seams(Path(along))
        disk = call(repaired.mesh if repaired else mesh, through=between or (), along=seams)
    rim = sum(map(len, disk.mesh.loops))
    write_mesh(output, disk.mesh)
    write_numbers(seam, "vertex", disk.origin)
    if as_json:
        about: dict[str, Any] = {"input": str(mesh), "output": str(output), "seam": str(seam)}
        about |= {"cut_edges": disk.edges.tolist(), "cut_length": disk.length}
        about |= {"vertices": disk.mesh.n, "faces": disk.mesh.m, "boundary_vertices": rim}
        print_json(about if repaired is None else about | {"repair": repaired.steps})
        return
    for notice in disk.mesh.notices:
        if along or notice.kind is not NoticeKind.CUT_OPEN:  # printed below
            note(f"{mesh.stem}: {notice}")
    if repaired is not None:
        print_steps(repaired.steps)
    out.print(
        f"{len(disk.edges):,} edges cut, {disk.length:.6g} long; the disk has "
        f"{disk.mesh.n:,} vertices, {rim:,} of them on its boundary"
    )
    for path in (output, seam):
        out.print(str(path), soft_wrap=True)
