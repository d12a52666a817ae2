"""What a campaign has done, a line a case, so that nothing is done twice and a kill loses nothing.

The first line says what the campaign is of: the seed and a fingerprint of the sources. A folder
that holds another campaign is refused, for its counts would be of neither.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from cembench.results.samples import append_line, whole_lines

SOURCES = (
    "cembench",
    "algorithms",
    "meshes_gen",
    "papers",
    "sharing",
    "textures",
    "tests/campaign",
)


@dataclass(frozen=True)
class Entry:
    """One case: the part of the campaign, its number there, and what became of it."""

    part: str
    case: str
    #: The format, the family of surfaces, or the verb.
    family: str
    outcome: str
    fault: str | None = None
    detail: str = ""
    seconds: float = 0.0

    @property
    def id(self) -> str:
        """What ``--replay`` takes."""
        return f"{self.part}:{self.case}"


class WrongFolder(Exception):  # noqa: N818 - it is what the folder is
    """The folder holds a campaign of another seed or of other sources."""


class Journal:
    """The journal in a folder; made there if it is new.

    Raises
    ------
    WrongFolder
        It is of another seed or of other sources.
    """

    def __init__(self, folder: Path, about: dict[str, object]) -> None:
        self.path = folder / "journal.jsonl"
        self.about = about
        self.entries: list[Entry] = []
        data = self.path.read_bytes() if self.path.exists() else b""
        first, *others = whole_lines(data).splitlines() or [b""]
        if not first:
            append_line(self.path, folder, json.dumps(about))
        elif json.loads(first) != about:
            raise WrongFolder(
                f"{self.path} is of another campaign ({first.decode()}); this one is "
                f"{json.dumps(about)}. Name another folder with --out."
            )
        self.entries += [Entry(**json.loads(line)) for line in others]
        self._done = {entry.id for entry in self.entries}

    def __contains__(self, id: str) -> bool:
        return id in self._done

    def add(self, entry: Entry) -> None:
        """Write down what became of a case."""
        append_line(self.path, self.path.parent, json.dumps(asdict(entry)))
        self.entries.append(entry)
        self._done.add(entry.id)


def fingerprint(root: Path) -> str:
    """Hash the sources that a campaign tests and is made of."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]
