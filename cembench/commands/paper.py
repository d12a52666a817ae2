"""The command `paper`: check the folder of a paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from cembench.api.papers import check_paper
from cembench.commands.app import app
from cembench.commands.console import Json, fail, out, print_json
from cembench.core.wording import counted


@app.command(epilog="Example:  cembench paper check papers/mine")
def paper(
    what: Annotated[Literal["check"], typer.Argument(help="What to do: check.")],
    folder: Annotated[Path, typer.Argument(help="The paper's folder, or an installed paper.")],
    *,
    as_json: Json = False,
) -> None:
    """Check a paper's folder before anything is measured, and exit with 1 if something is wrong.

    Names, expressions, models and digits are tested; each fault has its file, and
    its line in a CSV file.
    """
    wrong = check_paper(folder)
    if as_json:
        print_json({"folder": str(folder), "wrong": wrong})
    elif not wrong:
        from cembench.results.papers import find_paper

        found = find_paper(str(folder))
        nouns = ("algorithm", "model", "table", "claim")
        *most, last = (counted(len(getattr(found, f"{noun}s")), noun) for noun in nouns)
        out.print(f"{found.title}: {', '.join(most)} and {last}; nothing is wrong")
    fail(wrong)
