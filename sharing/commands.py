"""The commands that share runs: publish, sign, submissions and submit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, Markdown, err, out, print_json, warn
from cembench.commands.from_api import Call, from_api

from . import submissions as api

if TYPE_CHECKING:
    from cembench.report.document import Plain, Table

SIGNERS = "--require-signed SIGNERS"


@app.command(
    epilog="Examples:  cembench publish results/may results/june -o site  ·  "
    "cembench publish submissions -o site"
)
@from_api(api.publish, without=("reporter",), runs="RUN", require_signed=SIGNERS)
def publish(call: Call, *, as_json: Json = False) -> None:
    """Print where the site is."""
    site, output = call(reporter=SHOWN), call.keywords["output"]
    if as_json:
        print_json({"output": str(output), "runs": [asdict(one) for one in site]})
    else:
        runs = f"{len(site)} run{'s' * (len(site) > 1)}"
        out.print(f"{runs} in {output / 'index.html'}", soft_wrap=True)


@app.command(epilog="Example:  cembench sign results/may --key ~/.ssh/id_ed25519")
@from_api(api.sign, run="RUN", key="--key KEY")
def sign(call: Call) -> None:
    """Print the file of the signature."""
    out.print(f"signed: {call()}", soft_wrap=True)


@app.command(epilog="Example:  cembench submissions check submissions --require-signed signers")
@from_api(api.check_submissions, require_signed=SIGNERS)
def submissions(
    call: Call,
    what: Annotated[Literal["check"], typer.Argument(help="What to do: check.")],
    folder: Annotated[Path, typer.Argument(help="A folder of bundles, or one bundle.")],
    *,
    markdown: Markdown = None,
    as_json: Json = False,
) -> None:
    """Print what was found; exit with 1 if a bundle is refused."""
    with err.status("checking", spinner="line"):
        checked = call(folder)
    if markdown:
        from cembench.report.document import Section
        from cembench.report.render.markdown import append_section

        append_section(markdown, Section("submissions", "Submissions", (_table(checked),)))
    if as_json:
        print_json([asdict(one) | {"accepted": one.accepted} for one in checked])
    else:
        out.print(_table(checked))
    if not all(one.accepted for one in checked):
        raise typer.Exit(1)


def _table(checked: Sequence[api.Submission]) -> Table:
    from cembench.report.document import words
    from cembench.report.given_tables import given_table

    rows: list[list[Plain]] = []
    notes: list[str] = []
    for one in checked:
        found = words("accepted", "good") if one.accepted else words("refused", "bad")
        about = (one.name, found, ", ".join(one.machines) or "-")
        rows.append([*about, one.cells, one.maps, one.signer or "-"])
        more = f"; and {len(one.faults) - 5} more" if len(one.faults) > 5 else ""
        notes += [f"{one.name}: {'; '.join(one.faults[:5])}{more}"] * bool(one.faults)
    accepted = sum(one.accepted for one in checked)
    known = {"accepted": accepted, "number": len(checked)}
    return given_table("submissions", rows, known, package="cembench.sharing", notes=notes)


@app.command(
    epilog="Example:  cembench submit results/run -o mine.zip --maps --author 'A. Lovelace'"
)
@from_api(api.submit, author="--author NAME", licence="--licence SPDX")
def submit(call: Call, *, as_json: Json = False) -> None:
    """Print what was packed."""
    submission = call()
    if as_json:
        print_json(asdict(submission) | {"output": str(call.keywords["output"])})
        return
    out.print(f"{submission.cells} cells, {submission.maps} with maps: {call.keywords['output']}")
    if left_out := submission.unlicensed:
        warn(
            f"no licence is stated for {', '.join(left_out)}, so these surfaces are not sent and "
            "the figures of their maps cannot be checked. If they are yours, add "
            "--surfaces-licence, e.g. CC-BY-4.0."
        )
