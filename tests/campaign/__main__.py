"""The command line: ``python -m tests.campaign``."""

from __future__ import annotations

import gc
import os
import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from tests.campaign import campaign, summary
from tests.campaign.journal import Entry, Journal, WrongFolder, fingerprint
from tests.campaign.limited import run_cases

ROOT = Path(__file__).parents[2]


def main(
    *,
    seconds: Annotated[float, typer.Option(help="How long to go on at most.")] = 7200.0,
    seed: Annotated[int, typer.Option(help="The same seed makes the same cases.")] = 1,
    out: Annotated[Path, typer.Option(help="Journal and faulty cases; resumed.")] = Path(
        "results/fuzz"
    ),
    files: Annotated[int, typer.Option(min=0, help="Mutated files.")] = 10_000,
    meshes: Annotated[int, typer.Option(min=0, help="Meshes, each for all algorithms.")] = 3_000,
    kills: Annotated[int, typer.Option(min=0, help="Verbs that are killed.")] = 300,
    slots: Annotated[int, typer.Option(min=1, help="Processes at a time.")] = os.cpu_count() or 1,
    replay: Annotated[str, typer.Option(help="Repeat one case, such as files:17.")] = "",
    write_docs: Annotated[
        bool, typer.Option("--write-docs", help="Write docs/robustness.md.")
    ] = False,
) -> None:
    """Try to break the package: mutated files, hard meshes, kills.

    Exit code 0 where no fault was found, 1 where one was, 2 where the call was wrong.
    """
    console, told = Console(), Console(stderr=True)
    targets = campaign.Targets(files, meshes, kills)
    if replay:
        with tempfile.TemporaryDirectory(prefix="fuzz-replay-") as folder:
            chosen = campaign.parts(seed, targets, Path(folder))
            raise typer.Exit(_replay(replay, chosen, console))
    out = out.resolve()
    try:
        about: dict[str, Any] = {"seed": seed, "sources": fingerprint(ROOT)}
        journal = Journal(out, about)
    except WrongFolder as error:
        told.print(f"error: {error}", markup=False, soft_wrap=True)
        raise typer.Exit(2) from None
    chosen = campaign.parts(seed, targets, out)
    deadline = time.monotonic() + seconds
    gc.collect()
    gc.freeze()  # the forked processes share these pages as long as nobody looks at them
    # Drawn at each case and not by a thread: this process forks.
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeRemainingColumn(), console=told, auto_refresh=False) as progress:
        bars = {
            part.name: progress.add_task(
                part.name,
                total=len(part.cases),
                completed=sum(f"{part.name}:{part.key(c)}" in journal for c in part.cases),
            )
            for part in chosen
        }

        def finished(entry: Entry) -> None:
            progress.update(bars[entry.part], advance=1)
            progress.refresh()

        complete = campaign.run(chosen, journal, slots, deadline, finished)
    summary.show(journal.entries, console)
    if write_docs:
        summary.write_page(ROOT / "docs" / "robustness.md", journal.entries, about)
    if not complete:
        console.print("Not all cases were tried; the same command goes on.", soft_wrap=True)
    raise typer.Exit(int(any(entry.fault for entry in journal.entries)))


def _replay(id: str, chosen: list[campaign.Part[Any]], console: Console) -> int:
    """Repeat one case, whatever a journal says, and tell what became of it; 2 if there is none."""
    name, _, key = id.partition(":")
    items = [(p, c) for p in chosen if p.name == name for c in p.cases if p.key(c) == key]
    if not items:
        console.print(f"there is no case {id}", markup=False)
        return 2
    part, case = items[0]
    part.begin([case])
    (ending,) = run_cases([case], part.judge, part.limits, slots=1)
    entry = campaign.entry_of(part, ending)
    console.print(f"{entry.outcome}: {entry.fault}: {entry.detail}", markup=False, soft_wrap=True)
    return int(entry.fault is not None)


if __name__ == "__main__":
    typer.run(main)
