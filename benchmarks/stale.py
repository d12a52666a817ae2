"""Which kept reports and tables in pages are older than the code that their figures depend on?"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from typing import Any

from benchmarks.origins import changed, origins, working_tree
from benchmarks.pages import ROOT, Section, Table
from cembench.results.report_records import text_rows
from cembench.results.store import Store

PAGE = "reports/README.md"
LAYOUT = """
| what | made at | on | changed since | made again by | took |
|---|---|---|---|---|---:|
| {what} | `{commit}` | {date} | {changed} | `{command}` | {took} |
"""
#: What reads records alone, and no figure of which depends on anything but the kept reports.
OF_RECORDS = ("peers_summary", "cem_speedups", "readme_answer")


def made_tables() -> list[str]:
    """Return the tables in pages that studies fill: the page and the study."""
    docs = ROOT / "docs"  # made pages are in folders that begin with an underscore
    written = [*docs.glob("*.md"), *docs.glob("[!_]*/**/*.md")]
    pages = [ROOT / "README.md", *sorted(written)]
    tables = []
    for page in pages:
        text = page.read_text(encoding="utf-8")
        for study in re.findall(r"<!-- made by benchmarks/(\w+)\.py -->", text):
            tables.append(f"{page.relative_to(ROOT).as_posix()} {study}")
    return tables


def kept_reports() -> list[str]:
    """Return the folders of kept reports and kept runs."""
    files = (*ROOT.glob("reports/*/report.md"), *ROOT.glob("reports/papers/*/cembench.json"))
    return sorted(path.parent.relative_to(ROOT).as_posix() for path in files)


def took(seconds: float | None) -> str:
    """Return a time in words.

    >>> took(40), took(5400), took(None)
    ('40 s', '1.5 h', 'not recorded')
    """
    if seconds is None:
        return "not recorded"
    for unit, size in (("h", 3600), ("min", 120)):
        if seconds >= size:
            return f"{seconds / (3600 if unit == 'h' else 60):.2g} {unit}"
    return f"{seconds:.0f} s"


def measured_seconds(report: str) -> float:
    """Return the seconds of one call in each round of a kept report: what a run takes at least."""
    if (ROOT / report / "records").is_dir():  # a kept run
        outcomes = [one.outcome for one in Store(ROOT / report).records()]
        return sum(sum(each.calls) for one in outcomes for each in one.rounds)
    return sum(sum(json.loads(row["seconds_raw"] or "[]")) for row in text_rows(ROOT / report))


def confirmed_words(how: Mapping[str, Any] | None) -> str:
    """Return when a kept report was confirmed by a shorter run, and by how much of it."""
    if how is None:
        return ""
    verdicts = how["same_verdict"] + how["one_decides"]
    by = f"{how['cells']} cells and {verdicts} verdicts"
    return f"; confirmed {how['date']} at `{how['commit']}` by {by}"


def stale(*, check: bool = False, refresh: bool = False) -> Section:
    """List kept reports and tables in pages, with what has changed since they were made.

    `check` exits with 1 if something is stale; `refresh` lists the commands that make it again.
    """
    known, now = origins(), working_tree()
    rows: list[dict[str, Any]] = []
    for what in [*kept_reports(), *(t for t in made_tables() if not t.endswith(OF_RECORDS))]:
        about = known.get(what)
        if about is None:
            about = {"commit": "-", "date": "-", "command": "-", "seconds": None}
            differing = ["unknown: nothing is recorded"]
        else:
            differing = changed(about, now)
        seconds, words = about["seconds"], took(about["seconds"])
        if seconds is None and what.startswith("reports/"):
            words = f"at least {took(measured_seconds(what))}"
        rows.append(
            {
                "what": what,
                **{name: about[name] for name in ("commit", "command")},
                "date": about["date"] + confirmed_words(about.get("confirmed")),
                "changed": ", ".join(differing) or "nothing",
                "took": words,
                "seconds": seconds,
            }
        )
    old = [row for row in rows if row["changed"] != "nothing"]
    sentence = f"{len(old)} of {len(rows)} are older than the code that their figures depend on."
    if refresh:
        by_command = {row["command"]: row for row in old}
        lines = [f"{row['command']:70}  # {row['took']}" for row in by_command.values()]
        sure = sum(row["seconds"] or 0 for row in by_command.values())
        rest = sum(row["seconds"] is None for row in by_command.values())
        print("\n".join(lines))
        print(f"# {took(sure)} for those that were timed; {rest} were not.\n")
    elif check and old:
        print(
            "\n".join(
                f"{row['what']}: changed since {row['commit']}: {row['changed']}" for row in old
            )
        )
        sys.exit(sentence)
    return Section([sentence, Table(rows, LAYOUT)], page=PAGE)
