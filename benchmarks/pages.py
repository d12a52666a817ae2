"""Tables in pages that are made from records or measured anew: each between two marks."""

from __future__ import annotations

from pathlib import Path

from cembench.core.atomic import write_text

ROOT = Path(__file__).parents[1]


def marks(maker: str) -> tuple[str, str]:
    """Return the marks around what a script of this folder makes."""
    return f"<!-- made by benchmarks/{maker}.py -->", f"<!-- end of benchmarks/{maker}.py -->"


def filled(page: str, maker: str, content: str) -> str:
    """Return a page's text with this content between the script's marks."""
    begin, end = marks(maker)
    before, found, rest = page.partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise SystemExit(f"the page lacks the marks {begin} and {end}.")
    return f"{before}{begin}\n\n{content.strip()}\n\n{end}{after}"


def fill(page: Path, maker: str, content: str) -> None:
    """Put content between the marks of a page's file."""
    write_text(page, filled(page.read_text(encoding="utf-8"), maker, content))
