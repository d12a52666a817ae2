"""What became of a case."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Verdict:
    """How the package dealt with a case, and the kind of fault in that, if any."""

    outcome: str
    fault: str | None = None
    detail: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return it for the journal."""
        return asdict(self)
