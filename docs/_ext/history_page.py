"""Write the page of the kept history from its figures."""

from __future__ import annotations

import sys
from pathlib import Path

from cembench.core.atomic import write_text

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
from benchmarks.history import history  # noqa: E402 - after the path

HEAD = """\
# The history of this project's speed

Made from the figures in `benchmarks/kept_history`; [tracking.md](tracking.md) says how they were
measured. Commits are those of the main line, figures milliseconds.
"""


def write_page(path: Path) -> None:
    """Write the page, and the picture beside it."""
    section = history()
    write_text(path, f"{HEAD}\n{section}\n")
    section.write_files(path.parent)
