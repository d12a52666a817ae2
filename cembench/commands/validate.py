"""The command `validate`: judge a solver."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cembench.api.validate import validate as validate_solver
from cembench.api.validate import written_files
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, Markdown, out, print_json, split
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Junit
from cembench.core.errors import ParameterError


@app.command(
    epilog="Examples:  cembench validate mine.py  ·  "
    "cembench validate mine.py:fast --against cem,fdm --profile quick -o results/mine  ·  "
    "cembench validate mine.py --require not-slower"
)
@from_api(validate_solver, without=("reporter",), require="--require WHAT")
def validate(
    call: Call,
    plugin: Annotated[
        str | None,
        typer.Argument(
            metavar="PLUGIN", help="FILE.py, FILE.py:NAME, module:name, or a registered name."
        ),
    ] = None,
    *,
    command: Command = None,
    program: Settings = [],  # noqa: B006 - typer copies defaults
    surfaces: Annotated[
        list[str], typer.Option(help="Compare on these surfaces (see `list surfaces`).")
    ] = [],  # noqa: B006
    mesh: Annotated[list[Path], typer.Option(help="Compare on this file. Repeatable.")] = [],  # noqa: B006
    markdown: Markdown = None,
    junit: Junit = None,
    as_json: Json = False,
) -> None:
    """Print the verdict; exit with 1 if the solver is not valid, or not what is required."""
    declared, _ = declared_command(command, program)
    if (plugin is None) == (not declared):
        raise ParameterError(
            "name one solver: a PLUGIN (FILE.py, module:name or a registered name), or a program "
            "with --command COMMAND."
        )
    if junit:
        from cembench.report.junit import check_junit

        check_junit(junit, "validate")
    validation = call(plugin or declared[0], surfaces=[*mesh, *split(surfaces)], reporter=SHOWN)
    folder = call.keywords["output"]
    written = {} if folder is None else written_files(folder)
    if as_json:
        from cembench.validation.verdict import sentences

        verdict: dict[str, Any] = {"valid": validation.valid, "passed": validation.passed}
        verdict |= {"verdict": " ".join(sentences(validation))}
        print_json(verdict | validation.model_dump(mode="json") | written)
    else:
        from cembench.validation.document import validation_text

        out.print(validation_text(validation))
        for path in written.values():
            out.print(path, style="dim", markup=False, soft_wrap=True)
    if markdown or junit:
        from cembench.validation.summaries import append_markdown, checks_of

        if markdown:
            append_markdown(validation, markdown)
        if junit:
            from cembench.report.junit import write_junit

            write_junit(junit, "validate", checks_of(validation))
    if not validation.passed:
        raise typer.Exit(1)
