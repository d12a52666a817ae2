"""The verbs that pack a run for others, and check what others packed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cembench.api import submissions as api
from cembench.api.submissions import Submission
from cembench.commands.console import Json, Markdown, err, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.sign import RequireSigned

if TYPE_CHECKING:
    from cembench.report.document import Table


@from_api(api.submit, author="--author NAME", licence="--licence SPDX")
def submit(call: Call, *, as_json: Json = False) -> None:
    """Print what was packed."""
    found = call()
    if as_json:
        print_json(asdict(found) | {"output": str(call.keywords["output"])})
        return
    out.print(f"{found.cells} cells, {found.maps} with maps: {call.keywords['output']}")


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
        found = api.check_submissions(folder, require_signed=require_signed)
    if markdown:
        from cembench.report.document import Section
        from cembench.report.render.markdown import append_section

        append_section(markdown, Section("submissions", "Submissions", (_table(found),)))
    if as_json:
        print_json([asdict(one) | {"accepted": one.accepted} for one in found])
    else:
        out.print(_table(found))
    if not all(one.accepted for one in found):
        raise typer.Exit(1)


def _table(found: Sequence[Submission]) -> Table:
    from cembench.report.document import Column, Table, words

    return Table.of(
        "submissions",
        f"{sum(one.accepted for one in found)} of {len(found)} bundles accepted",
        [
            *(Column(title, numeric=False) for title in ("bundle", "found", "machines")),
            *(Column(title, form=",d") for title in ("cells", "maps")),
            Column("signed by", numeric=False),
        ],
        [
            [
                one.name,
                words("accepted", "good") if one.accepted else words("refused", "bad"),
                ", ".join(one.machines) or "-",
                one.cells,
                one.maps,
                one.signer or "-",
            ]
            for one in found
        ],
        notes=tuple(
            f"{one.name}: {'; '.join(one.faults[:5])}"
            + (f"; and {len(one.faults) - 5} more" if len(one.faults) > 5 else "")
            for one in found
            if one.faults
        ),
    )


#: Each verb with the examples that its help shows.
VERBS = (
    (submit, "Example:  cembench submit results/run -o mine.zip --maps --author 'A. Lovelace'"),
    (submissions, "Example:  cembench submissions check submissions --require-signed signers"),
)
