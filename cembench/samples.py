"""What was measured so far of a cell that is not finished: one file for each process that ended.

Samples are kept by environment: rounds of two machines, or of two commits, never come together in
one record.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.atomic import read_model, write, write_model
from cembench.records import Outcome, Round


@dataclass(frozen=True)
class Samples:
    """The samples of one cell in one environment."""

    folder: Path

    def save_check(self, outcome: Outcome, uv: NDArray[np.complex128] | None) -> None:
        """Keep what the checked call came to: the map first, so that it is there with it."""
        if uv is not None:
            write(self.folder / "uv.npz", lambda file: np.savez(file, uv=uv))
        write_model(self.folder / "check.json", outcome)

    def check(self) -> Outcome | None:
        """What the checked call came to; None where there was none yet."""
        path = self.folder / "check.json"
        return read_model(path, Outcome) if path.exists() else None

    def uv(self) -> NDArray[np.complex128] | None:
        """The map of the checked call (n,)."""
        return read_map(self.folder / "uv.npz")

    def save_round(self, number: int, measured: Round) -> None:
        """Keep one round; rounds are numbered from 0."""
        write_model(self.folder / f"round-{number}.json", measured)

    def rounds(self) -> dict[int, Round]:
        """The rounds that are there, by number, in order."""
        paths = self.folder.glob("round-*.json")
        found = {int(path.stem.removeprefix("round-")): path for path in paths}
        return {number: read_model(found[number], Round) for number in sorted(found)}


def read_map(path: Path) -> NDArray[np.complex128] | None:
    """A map (n,) that was kept as ``uv`` in an archive; None where there is none."""
    if not path.exists():
        return None
    with np.load(path) as archive:
        return np.asarray(archive["uv"])
