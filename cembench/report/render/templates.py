"""The templates of the report's forms, and what stands in them between braces."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from cembench.report.document import (
    ORIGINS,
    SUSPECTS,
    Claim,
    Figure,
    Gallery,
    Gap,
    Table,
    Text,
    Verdict,
    csv_of,
    heading,
    marked,
)

FOLDER = Path(__file__).parents[1] / "templates"
#: The sign before each verdict, so that it does not rely on colour alone.
SIGNS: dict[Verdict, str] = {
    "does not hold here": "✗",
    "holds in part": "◐",
    "holds": "✓",
    "too few rounds": "…",
    "not tested here": "○",
}


def environment(escape: Callable[[str], str] | None = None, **more: Any) -> jinja2.Environment:
    """Return the templates; what stands between braces is escaped, by default for HTML."""

    def escaped(value: Any) -> Any:
        return value if escape is None or isinstance(value, Markup) else Markup(escape(str(value)))

    forms = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        autoescape=True,
        finalize=escaped,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        **more,
    )
    kinds = (Claim, Figure, Gallery, Gap, Table, Text)
    forms.tests |= {kind.__name__.lower(): lambda it, k=kind: isinstance(it, k) for kind in kinds}
    forms.filters |= {"heading": heading, "csv": csv_of}
    forms.globals |= {"ORIGINS": ORIGINS, "SIGNS": SIGNS, "SUSPECTS": SUSPECTS}
    forms.globals |= {"Counter": Counter, "marked": marked}
    return forms
