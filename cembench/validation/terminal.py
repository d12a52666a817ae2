"""A validation, printed on a terminal."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.text import Text

from cembench.validation.document import stage_sections
from cembench.validation.verdict import Validation, sentence


def validation_text(validation: Validation) -> RenderableType:
    """Return the findings, the figures, and the verdict at the end."""
    parts = [
        part
        for section in stage_sections(validation, {})
        if section.items
        for part in (section, "")
    ]
    style = "bold green" if validation.passed else "bold red"
    return Group(*parts, Text(f"{validation.title}: {sentence(validation)}.", style=style))
