"""The verb that makes a site of several runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cembench.commands.console import Json, err, out, print_json
from cembench.commands.sign import RequireSigned, check_signed
from cembench.core.overwriting import refuse_inputs


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
    from dataclasses import asdict

    from cembench.api.submissions import accepted, bundles_in, is_bundle
    from cembench.report.site import publish as write_site
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records

    refuse_inputs(output, runs, force=False)
    sent = [bundle for path in runs if is_bundle(path) for bundle in bundles_in(path)]
    own = [path for path in runs if not is_bundle(path)]
    for run in own:
        sound_records(Store(run), Depth.sample)

    def progress(words: str, done: int, total: int) -> None:
        err.print(f"[{done}/{total}] {words}", markup=False, style="dim")

    with accepted(sent) as unpacked:
        signers = check_signed([*own, *unpacked], require_signed)
        found = write_site([*own, *unpacked], output, progress, signers)
    if as_json:
        print_json({"output": str(output), "runs": [asdict(one) for one in found]})
    else:
        out.print(f"{len(found)} runs in {output / 'index.html'}", soft_wrap=True)


#: Each verb with the examples that its help shows.
VERBS = (
    (
        publish,
        "Examples:  cembench publish results/may results/june -o site  ·  "
        "cembench publish submissions -o site",
    ),
)
