"""The commands that share runs: publish, sign, submit, and check what others sent."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cembench.api import submissions as api
from cembench.commands.app import app
from cembench.commands.console import Json, Markdown, err, out, print_json, warn
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import RequireSigned
from cembench.core.overwriting import refuse_inputs

if TYPE_CHECKING:
    from cembench.report.document import Plain, Table
    from cembench.results.bundle import Submission


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


@app.command(epilog="Example:  cembench submissions check submissions --require-signed signers")
def submissions(
    what: Annotated[Literal["check"], typer.Argument(help="What to do: check.")],
    folder: Annotated[Path, typer.Argument(help="A folder of bundles, or one bundle.")],
    *,
    require_signed: RequireSigned = None,
    markdown: Markdown = None,
    as_json: Json = False,
) -> None:
    """Check bundles that others sent, and exit with 1 if one is refused.

    Each is unpacked safely; the schema and digest of its records, the hashes of
    its files, its times and, where maps were sent, their figures are checked.
    """
    with err.status("checking", spinner="line"):
        checked = api.check_submissions(folder, require_signed=require_signed)
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


def _table(checked: Sequence[Submission]) -> Table:
    from cembench.report.document import Column, Table, words

    rows: list[list[Plain]] = []
    notes: list[str] = []
    for one in checked:
        found = words("accepted", "good") if one.accepted else words("refused", "bad")
        about = (one.name, found, ", ".join(one.machines) or "-")
        rows.append([*about, one.cells, one.maps, one.signer or "-"])
        more = f"; and {len(one.faults) - 5} more" if len(one.faults) > 5 else ""
        notes += [f"{one.name}: {'; '.join(one.faults[:5])}{more}"] * bool(one.faults)
    counts = (Column("cells", form=",d"), Column("maps", form=",d"))
    title = f"{sum(one.accepted for one in checked)} of {len(checked)} bundles accepted"
    columns = ("bundle", "found", "machines", *counts, "signed by")
    return Table.of("submissions", title, columns, rows, notes=tuple(notes))


@app.command(
    epilog="Examples:  cembench publish results/may results/june -o site  ·  "
    "cembench publish submissions -o site"
)
def publish(
    runs: Annotated[
        list[Path], typer.Argument(help="Runs' folders, bundles, and folders of bundles.")
    ],
    *,
    output: Annotated[Path, typer.Option("-o", "--output", help="Where the site goes.")],
    require_signed: RequireSigned = None,
    as_json: Json = False,
) -> None:
    """Write a static site of several runs: leaderboard, machines, ratios, reports.

    It needs no network and no server: open index.html, or put the folder on a web server.
    Bundles (see `cembench submit`) are checked first, and none is published that is refused.
    """
    from cembench.report.site import publish as write_site
    from cembench.results.bundle import accepted, bundles_in, is_bundle
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records

    refuse_inputs(output, runs, force=False)
    sent = [bundle for path in runs if is_bundle(path) for bundle in bundles_in(path)]
    own = [path for path in runs if not is_bundle(path)]
    for run in own:
        sound_records(Store(run), Depth.sample)

    def progress(words: str, done: int, total: int) -> None:
        err.print(f"[{done}/{total}] {words}", markup=False, style="dim")

    with accepted(sent, require_signed) as unpacked:
        signers = check_signed(own, require_signed)
        signers |= {folder: one.signer for folder, one in unpacked.items() if one.signer}
        site = write_site([*own, *unpacked], output, progress, signers)
    if as_json:
        print_json({"output": str(output), "runs": [asdict(one) for one in site]})
    else:
        runs_words = f"{len(site)} run{'s' * (len(site) > 1)}"
        out.print(f"{runs_words} in {output / 'index.html'}", soft_wrap=True)


@app.command(epilog="Example:  cembench sign results/may --key ~/.ssh/id_ed25519")
def sign(
    run: Annotated[Path, typer.Argument(help="The run's folder.")],
    *,
    key: Annotated[Path, typer.Option("--key", help="Your SSH key.")],
) -> None:
    """Sign a run with your SSH key, so that others know who measured it.

    The signature is in RUN/signature, over all its files; sign again after the
    run has changed. `merge` and `publish` check it with --require-signed.
    """
    from cembench.results.signing import sign as signed

    out.print(f"signed: {signed(run, key.expanduser())}", soft_wrap=True)


def check_signed(runs: Iterable[Path], signers: Path | None) -> dict[Path, str]:
    """Return who signed each run, and print it; raise if one is not as ``--require-signed`` asks.

    Without that, nothing is known.
    """
    from cembench.results.signing import signer

    names = {} if signers is None else {run: signer(run, signers) for run in runs}
    for run, name in names.items():
        err.print(f"{run}: signed by {name}", markup=False, style="dim", soft_wrap=True)
    return names
