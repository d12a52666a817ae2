"""The machines of a run: seconds of two machines cannot be compared, ratios within one can."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from string import ascii_uppercase
from typing import Any

from cembench.results.records import Record

Environments = Mapping[str, Mapping[str, Any]]


def machine_of(environment: Mapping[str, Any]) -> str:
    """Return the name of a machine; in older records, which have none, its processor.

    >>> machine_of({"machine": "node-1", "cpu": "x"})
    'node-1'
    """
    named = environment.get("machine")
    if named:
        return str(named)
    cpu = environment.get("cpu")
    return f"{cpu}, {environment.get('cores')} cores" if cpu else ""


def machine_of_record(record: Record, environments: Environments) -> str:
    """Return the machine that a record was measured on; "" if unknown."""
    return machine_of(environments.get(record.environment, {}))


@dataclass(frozen=True)
class Marks:
    """A letter for each machine if there are several; with one machine nothing is marked."""

    #: By the machines' names, most cells first; capitals, as small ones mark notes.
    letters: Mapping[str, str]
    counts: Mapping[str, int]
    #: By environment.
    by_environment: Mapping[str, str]

    def of(self, record: Record) -> str:
        """Return the mark of a record's seconds; "" if all are from one machine."""
        return self.by_environment.get(record.environment, "")

    def explained(self) -> list[str]:
        """Return what the letters mean and what cannot be compared; nothing without letters."""
        if not self.letters:
            return []
        named = "; ".join(
            f"{letter}: {name or 'not named'}, {self.counts[name]} "
            f"{'cell' if self.counts[name] == 1 else 'cells'}"
            for name, letter in self.letters.items()
        )
        return [
            f"Seconds of {len(self.letters)} machines ({named}) do not compare with one another: "
            "only speedups do, each within a machine."
        ]


def marks(records: Iterable[Record], environments: Environments) -> Marks:
    """Give each machine of these records a letter, if there are several.

    Examples
    --------
    >>> marks([], {}).explained()
    []
    """
    chosen = list(records)
    counts = Counter(machine_of_record(record, environments) for record in chosen)
    if len(counts) < 2:
        return Marks({}, counts, {})
    ordered = [name for name, _ in counts.most_common()]
    letters = {name: letter(k) for k, name in enumerate(ordered)}
    used = {record.environment for record in chosen}
    by = {key: letters[machine_of(environments.get(key, {}))] for key in used}
    return Marks(letters, counts, by)


def letter(number: int) -> str:
    """Return the mark of a number: A, B, ..., Z, AA, AB, ..."""
    more, this = divmod(number, len(ascii_uppercase))
    return (letter(more - 1) if more else "") + ascii_uppercase[this]


def software_differences(records: Sequence[Record], environments: Environments) -> list[str]:
    """Return how the versions or the commit of each machine differ from the main one's."""
    counts = Counter(record.environment for record in records)
    if len(counts) < 2:
        return []
    first, *others = [key for key, _ in counts.most_common()]
    sentences = []
    for key in others:
        base, other = environments.get(first, {}), environments.get(key, {})
        changed = differences(base, other)
        if changed:
            sentences.append(f"{machine_of(other) or key}: {'; '.join(changed)}")
    return list(dict.fromkeys(sentences))


#: The facts of an environment that are the software's. What BLAS was loaded is not among them: a
#: process that has planned a run has loaded more than one that measures.
SOFTWARE = ("cembench", "git", "python", "libraries")
#: The facts that must agree for the seconds of two runs to be compared, of whatever commits.
COMPARED = (
    *("machine", "cpu", "cores", "memory_bytes", "allocator"),
    *("platform", "python", "libraries", "blas"),
)


def differences(
    ours: Mapping[str, Any], theirs: Mapping[str, Any], facts: Sequence[str] = SOFTWARE
) -> list[str]:
    """Return which of these facts of two environments differ, ours first.

    >>> differences({"python": "3.11.2"}, {"python": "3.12.1"})
    ['python: 3.11.2 / 3.12.1']
    """
    changed = []
    for name in facts:
        mine, other = ours.get(name), theirs.get(name)
        older = [{} if fact is None else fact for fact in (mine, other)]  # some facts are lacking
        if mine != other and all(isinstance(fact, Mapping) for fact in older):
            mine, other = older
            changed += [
                f"{part}: {mine.get(part)} / {other.get(part)}"
                for part in sorted({*mine, *other})
                if mine.get(part) != other.get(part)
            ]
        elif mine != other:
            changed.append(f"{name}: {mine} / {other}")
    return changed
