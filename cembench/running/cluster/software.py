"""Do two machines have the same software? Their processors may differ, and have other seconds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

#: The facts of an environment that are the software's. What BLAS was loaded is not among them: a
#: process that has planned a run has loaded more than one that measures.
FACTS = ("cembench", "git", "python", "libraries")


def software_of(environment: Mapping[str, Any]) -> dict[str, Any]:
    """Return what an environment says of versions and of the commit."""
    return {name: environment.get(name) for name in FACTS}


def differences(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> list[str]:
    """Say which versions differ, ours first.

    >>> differences({"python": "3.11.2"}, {"python": "3.12.1"})
    ['python: 3.11.2 / 3.12.1']
    """
    found = []
    for name in FACTS:
        mine, other = ours.get(name), theirs.get(name)
        if isinstance(mine, Mapping) and isinstance(other, Mapping):
            parts = sorted({*mine, *other})
            found += [
                f"{part}: {mine.get(part)} / {other.get(part)}"
                for part in parts
                if mine.get(part) != other.get(part)
            ]
        elif mine != other:
            found.append(f"{name}: {mine} / {other}")
    return found
