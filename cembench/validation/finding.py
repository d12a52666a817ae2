"""What one check has found."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

Stage = Literal["contract", "correctness", "quality", "scaling"]


class ValidationFinding(BaseModel):
    """One check: what was measured, what is allowed, and what to do where it is not ok.

    `measured` is a clause that a sentence can quote; `allowed` and `remedy` are sentences.
    """

    model_config = ConfigDict(frozen=True)

    stage: Stage
    name: str
    ok: bool
    measured: str
    allowed: str
    remedy: str
