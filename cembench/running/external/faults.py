"""Faults of external programs, each with its kind."""

from __future__ import annotations

from cembench.core.errors import CembenchError
from cembench.results.records import FaultKind, Status


class ProgramFault(CembenchError):  # noqa: N818 - it is a result's status, not a mistake
    """An external program did not do what was expected; the message is the cause."""

    def __init__(
        self, kind: FaultKind, detail: str, *, status: Status = "failed", said: str = ""
    ) -> None:
        super().__init__(detail)
        self.kind, self.status, self.said = kind, status, said

    @property
    def gave_up(self) -> bool:
        """Whether the program ended with a nonzero code, which counts as giving up."""
        return self.kind is FaultKind.GAVE_UP
