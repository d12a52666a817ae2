"""What can go wrong with a program that is not ours, each with its kind."""

from __future__ import annotations

from cembench.core.errors import CembenchError
from cembench.results.records import FaultKind, Status


class ProgramFault(CembenchError):  # noqa: N818 - it is a result's status, not a mistake
    """An external program did not do what was agreed upon; the message is the cause."""

    def __init__(
        self, kind: FaultKind, detail: str, *, status: Status = "failed", said: str = ""
    ) -> None:
        super().__init__(detail)
        self.kind, self.status, self.said = kind, status, said

    @property
    def gave_up(self) -> bool:
        """Whether the program itself ended with a code other than 0, which is a refusal."""
        return self.kind is FaultKind.GAVE_UP
