"""The command `map`: map surfaces and write them with their UVs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.app import app
from cembench.commands.console import (
    SHOWN,
    Json,
    fail,
    note,
    out,
    print_json,
    print_pair,
)
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.from_api import Call, from_api
from cembench.core.errors import ParameterError
from cembench.core.notices import NoticeKind

from .map_files import map_files

if TYPE_CHECKING:
    from .maps import Mapped, Maps


@app.command(
    "map",
    epilog="Examples:  cembench map face.obj -o face_uv.obj --preview  ·  "
    "cembench map face.ply -a cem -p max_iterations=13 --json  ·  cembench map left-hand  ·  "
    "cembench map scan.obj --repair -o scan_uv.obj  ·  cembench map head.obj --cut -o uv.obj  ·  "
    "cembench map a.obj b.obj -o maps/",
)
@from_api(map_files, without=("reporter",), meshes="MESH", uv="--uv unit|square|world|disk")
def map_(
    call: Call,
    *,
    command: Command = None,
    program: Settings = [],  # noqa: B006 - typer copies defaults
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Print all figures.")] = False,
    as_json: Json = False,
) -> None:
    """Print each map when it is made; exit with 1 if one is not valid or a file is missing."""
    declared, named = declared_command(command, program)
    keywords = call.keywords
    if named and keywords["algorithm"]:
        raise ParameterError("-a and --command both name an algorithm; give only one of them.")
    maps = call(
        algorithm=named[0] if named else keywords["algorithm"],
        plugins=[*keywords["plugins"], *declared],
        reporter=SHOWN,
    )
    for mapped in maps:
        for path, notice in mapped.notices:
            note(f"{path}: {notice}")
        if not as_json:
            _print_notices(mapped, verbose=verbose)
            if len(maps) > 1 and not verbose:
                _show_line(mapped, len(maps.done), len(maps))
            else:
                output = maps.output is not None
                _show_all(mapped, output, verbose=verbose, keep_invalid=maps.keep_invalid)
    _print_end(maps, as_json=as_json)


def _print_notices(mapped: Mapped, *, verbose: bool) -> None:
    """Print the notices of a surface; those on the paper's theory only with the others."""
    mesh = mapped.surface.mesh
    theory = NoticeKind.DEFINITION_1
    for notice in mesh.notices:
        if verbose or notice.kind is not theory:
            note(f"{mesh.name}: {notice}")


def _print_end(maps: Maps, *, as_json: bool) -> None:
    from cembench.results.columns import row

    more = {"output": str(maps.output)} if maps.output and not maps.missing else {}
    if as_json:
        rows = [row(m.record) | _more_of(m) | more | dict(m.written) for m in maps.done]
        print_json(rows if len(rows) > 1 else rows[0])
    elif more:
        print_pair("output", maps.output)
    bad = [_failure(mapped, named=len(maps) > 1) for mapped in maps.done if not mapped.ok]
    missing = "{} was not written, because one of its surfaces has no map"
    fail([*bad, *(missing.format(path) for path in maps.missing)])


def _failure(mapped: Mapped, *, named: bool) -> str:
    outcome = mapped.record.outcome
    kept = " (written anyway, because of --keep-invalid)" if mapped.written else ""
    which = f"{mapped.record.cell.mesh}: " if named else ""
    return f"{which}{outcome.status}: {outcome.cause}{kept}"


def _more_of(mapped: Mapped) -> dict[str, Any]:
    repaired = mapped.surface.repaired
    more = {name: getattr(mapped, name) for name in ("certificate", "overlay", "uv_scale")}
    more["repair"] = repaired and repaired.counts
    return {name: what for name, what in more.items() if what not in ("", None)}


def _show_all(mapped: Mapped, output: bool, *, verbose: bool, keep_invalid: bool) -> None:
    """Print the figures of a single mapped surface, and the files written.

    `output`: whether there is a file that its UVs are in.
    """
    from cembench.report.record_table import figures_table, texture_advice

    words = (("overlay", mapped.overlay), ("certificate", mapped.certificate))
    out.print(figures_table(mapped.record, full=verbose, more=words))
    for what, where in mapped.written.items():
        print_pair(f"{what:<9}", where)  # below the figures
    if mapped.uv is not None and not output and "output" not in mapped.written:
        more = "" if mapped.ok or keep_invalid else " --keep-invalid"
        out.print(f"The map was not written: add{more} -o FILE.obj to keep it.", style="dim")
    if not verbose and (advice := texture_advice(mapped.record)):
        out.print(advice[0].upper() + advice[1:] + ".", style="bold yellow")


def _show_line(mapped: Mapped, number: int, count: int) -> None:
    """Print one of several mapped surfaces on a line: status, figures and files."""
    record = mapped.record
    metrics = record.outcome.metrics
    parts = [f"{number:>{len(str(count))}} of {count}  {record.cell.mesh}: {record.outcome.status}"]
    parts.append(f"{record.mesh.faces:,} triangles")
    if metrics.get("angle_error_mean_deg") is not None:
        parts.append(f"{metrics['angle_error_mean_deg']:.2f} degrees")
        parts.append(f"{metrics.get('flipped_triangles', 0)} folds")
    where = [mapped.written[what] for what in ("output", "preview") if what in mapped.written]
    parts += where[:1]
    out.print("  ".join(parts), soft_wrap=True)
    for said in (*map(str, record.outcome.notes), mapped.certificate):
        if said:
            out.print(f"    {said}", soft_wrap=True, markup=False)
