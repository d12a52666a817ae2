"""The result of one check."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

Stage = Literal["contract", "correctness", "quality", "scaling"]


class ValidationFinding(BaseModel):
    """Result of a check: what was measured, what is allowed, and what to do if it is not ok.

    `measured` is a clause that a sentence can quote; `allowed` and `remedy` are sentences.
    """

    model_config = ConfigDict(frozen=True)

    stage: Stage
    name: str
    #: The surface that it is about, if it is one.
    surface: str = ""
    ok: bool
    #: Of a figure under refinement: its order, and the least that a conformal map's has.
    orders: tuple[float, float] | None = None
    #: Whether the figures do not show if it is a fault; `ok` is true then.
    undecided: bool = False
    measured: str
    allowed: str
    remedy: str

    @property
    def title(self) -> str:
        """The check, with its surface."""
        return f"{self.name} on {self.surface}" if self.surface else self.name


def finding(
    stage: Stage,
    name: str,
    measured: str,
    *,
    ok: bool,
    **known: Any,
) -> ValidationFinding:
    """Return the finding of a check of `findings.toml`.

    What is known beside is a field of the finding, or stands in its text in braces.
    """
    said = {key: text.format_map(known) for key, text in _declared()[stage][name].items()}
    fields = {key: known[key] for key in known.keys() & ValidationFinding.model_fields.keys()}
    parts: dict[str, Any] = fields | said
    return ValidationFinding(stage=stage, name=name, measured=measured, ok=ok, **parts)


@cache
def _declared() -> dict[str, dict[str, dict[str, str]]]:
    file = files("cembench.validation") / "findings.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))
