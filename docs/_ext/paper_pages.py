"""Write a page for each paper: the report of its kept run, printed figures beside measured ones."""

from __future__ import annotations

import os
from pathlib import Path

import cembench

ROOT = Path(__file__).parents[2]
#: Kept runs, one for each paper, named as it is.
KEPT = ROOT / "reports/papers"


def write_pages(folder: Path) -> None:
    """Write the reports of all kept runs into a folder, unless they are younger than those."""
    for run in sorted(KEPT.iterdir()):
        page = folder / run.name / "index.html"
        youngest = max(file.stat().st_mtime for file in run.rglob("*.json"))
        if not page.is_file() or page.stat().st_mtime < youngest:
            # A relative path: a page says which run it shows, and not on which machine.
            shown = Path(os.path.relpath(run))
            cembench.Run(shown).report(page.parent, paper=run.name)
