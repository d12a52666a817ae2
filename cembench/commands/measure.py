"""The command `measure`: judge UVs that exist."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cembench.api.measure import measure as measure_uv
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, note, out, print_json, print_pair
from cembench.commands.from_api import Call, from_api

if TYPE_CHECKING:
    from cembench.api.measurement import Measurement

#: Figures that are printed without --verbose, in this order.
FEW = (
    *("angle_error_mean_deg", "angle_error_sd_deg", "flipped_triangles", "symmetric_dirichlet"),
    *("area_distortion_mean", "texel_density_ratio", "islands", "mirrored_islands", "seam_length"),
    *("overlap_inside_islands", "overlap_between_islands", "covered_share", "tiles"),
)


@app.command(
    epilog="Examples:  cembench measure model.obj  ·  "
    "cembench measure model.glb --against best --preview distortion.png  ·  "
    "cembench measure a.obj b.ply --json"
)
@from_api(measure_uv, without=("surface", "faces_and_uv", "reporter"))
def measure(
    call: Call,
    meshes: Annotated[
        list[Path],
        typer.Argument(metavar="MESH...", help="Files with UVs: OBJ, PLY, GLB ..."),
    ],
    *,
    preview: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Draw the angle error on the surface (one file)."),
    ] = None,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Print all figures.")] = False,
    as_json: Json = False,
) -> None:
    """Print the answer, the figures and the worst places of each file."""
    from cembench.core.errors import ParameterError
    from cembench.core.overwriting import refuse_inputs

    if preview:
        if len(meshes) > 1 or preview.suffix.lower() != ".png":
            raise ParameterError("--preview names one PNG file, for one mesh.")
        refuse_inputs(preview, meshes, force=False)
    found = []
    for path in meshes:
        one = call(path, reporter=SHOWN)
        found.append(one.as_dict() | {"file": str(path)})
        if preview:
            one.plot(preview)
        if not as_json:
            _show(one, verbose=verbose)
    if as_json:
        print_json(found if len(found) > 1 else found[0])
    elif preview:
        print_pair("preview", preview)


def _show(found: Measurement, *, verbose: bool) -> None:
    from cembench.conformal.atlas import ATLAS_METRICS
    from cembench.conformal.metrics import METRICS
    from cembench.conformal.uv_quality import UV_METRICS

    for notice in found.notices:
        note(f"{found.mesh.name}: {notice}")
    out.print(f"{found.mesh.name}: {found.verdict}", style="bold")
    known = {metric.name: metric for metric in (*METRICS, *ATLAS_METRICS, *UV_METRICS)}
    for name in found.metrics if verbose else FEW:
        metric = known[name]
        text = metric.text(found.metrics[name], precise=True)
        out.print(f"{metric.title:<28} {text} {metric.unit}".rstrip())
    for place in found.worst:
        where = ", ".join(f"{x:.4g}" for x in place.position)
        at = f"triangle {place.triangle} (island {place.island}) at ({where})"
        off = f"dilatation {place.dilatation:.3g}, angles off by up to {place.angle_error_deg:.1f}"
        out.print(f"worst: {at}: {off}", soft_wrap=True)
