"""The result of one check."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

Stage = Literal["contract", "correctness", "quality", "scaling"]


class ValidationFinding(BaseModel):
    """Result of a check: what was measured, what is allowed, and what to do if it is not ok.

    `measured` is a clause that a sentence can quote; `allowed` and `remedy` are sentences.
    """

    model_config = ConfigDict(frozen=True)

    stage: Stage
    name: str
    ok: bool
    #: Whether the figures do not show if it is a fault; `ok` is true then.
    undecided: bool = False
    measured: str
    allowed: str
    remedy: str
