"""What a campaign has found, as tables on a terminal and as a page of the documentation."""

from __future__ import annotations

import datetime
import subprocess
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.campaign.journal import Entry

#: Title of a table, the part it is of, and what its rows are.
TABLES: tuple[tuple[str, str, str, Callable[[Entry], str]], ...] = (
    ("Files by format", "files", "format", lambda e: e.family),
    ("Meshes by algorithm", "meshes", "algorithm", lambda e: e.case.partition("/")[2]),
    ("Kills by verb", "kills", "verb", lambda e: e.family),
)

ORACLES = """\
**Files** are small legal meshes of every format, with what exporters add (normals, colours, texture coordinates, comments), damaged by
one to three mutations: cut, bits flipped, lines and words doubled, dropped or swapped, numbers, byte order or encoding changed. Reading a
file in a limited process must give a mesh, or an error of the project with a message; one in twenty is also given to `cembench map`. An
independent reader, written from the specification, must find the same corners. A file that it finds damaged must be refused; a file that
is still legal must be read.

**Meshes** (flat triangles, needles, slivers, spikes, combs, mazes, spirals, pinched and crowded boundaries, close holes, coordinates far
away, huge or tiny, and others) go through every registered algorithm that takes them, judged as `run` judges a cell. For a map that is
"ok", rational arithmetic must confirm that every triangle is counter-clockwise, that the boundary goes round the unit circle once and in
order, and that holes are disjoint and inside. For one mesh in four, energy and angles are computed again with fifty digits. "Refused":
the surface is not a clean manifold; "skipped": the algorithm does not take its topology.

**Kills** end a verb by SIGKILL at a random moment, in a folder full of files that look like the package's own. After the kill, and after
a second call, these are unchanged, finished work is unchanged, and the folder holds the names that an undisturbed call leaves. "Had
ended": the verb was faster than the kill.
"""  # noqa: E501


def show(entries: Sequence[Entry], console: Console) -> None:
    """Print the tables, and the faults."""
    for title, header, rows in _tables(entries):
        table = Table(title=title, title_justify="left")
        for column in header:
            table.add_column(column, justify="left" if column == header[0] else "right")
        for row in rows:
            table.add_row(*row)
        console.print(table)
    for (part, family, fault), found in _faults(entries):
        console.print(
            f"{len(found)} x {fault} ({part}, {family}), first: {found[0].id} {found[0].detail}",
            markup=False,
            soft_wrap=True,
            highlight=False,
        )


def write_page(path: Path, entries: Sequence[Entry], about: dict[str, object]) -> None:
    """Write the page of the documentation."""
    wrong = sum(entry.fault is not None for entry in entries)
    lines = [
        "# Robustness",
        "",
        "What `make fuzz` tried, and what became of it, as written by `python -m tests.campaign "
        "--write-docs`.",
        "",
        f"{datetime.date.today().isoformat()}, commit {_commit()}, seed {about['seed']}. "
        f"**{len(entries):,} cases, {wrong:,} faults.**",
        "",
        ORACLES,
    ]
    for title, header, rows in _tables(entries):
        lines += [f"## {title}", "", _row(header), _row(["---"] + ["---:"] * (len(header) - 1))]
        lines += [*map(_row, rows), ""]
    if wrong:
        lines += ["## Faults", "", _row(("part", "family", "fault", "cases", "first"))]
        lines += [_row(("---", "---", "---", "---:", "---"))]
        lines += [
            _row((*key, f"{len(found):,}", f"`{found[0].id}`")) for key, found in _faults(entries)
        ]
        lines.append("")
    path.write_text("\n".join(lines), encoding="utf-8")


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _tables(entries: Sequence[Entry]) -> list[tuple[str, list[str], list[list[str]]]]:
    """Return title, header and rows of each table that has any."""
    tables = []
    for title, part, what, of in TABLES:
        chosen = [entry for entry in entries if entry.part == part]
        if not chosen:
            continue
        outcomes = sorted({entry.outcome for entry in chosen})
        counts = Counter((of(entry), entry.outcome) for entry in chosen)
        faults = Counter(of(entry) for entry in chosen if entry.fault)
        rows = [
            [name, *(f"{counts[name, o]:,}" for o in outcomes), f"{faults[name]:,}"]
            for name in dict.fromkeys(sorted(map(of, chosen)))
        ]
        sums = [f"{sum(e.outcome == o for e in chosen):,}" for o in outcomes]
        rows.append(["all", *sums, f"{sum(faults.values()):,}"])
        tables.append((title, [what, *outcomes, "faults"], rows))
    return tables


def _faults(entries: Sequence[Entry]) -> list[tuple[tuple[str, str, str], list[Entry]]]:
    found: dict[tuple[str, str, str], list[Entry]] = {}
    for entry in entries:
        if entry.fault:
            found.setdefault((entry.part, entry.family, entry.fault), []).append(entry)
    return sorted(found.items())


def _commit() -> str:
    """Return the commit of the sources, marked where they differ from it."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=10"]
    place = Path(__file__).parent
    result = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
    return result.stdout.strip() or "unknown"
