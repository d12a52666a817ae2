"""Profiles: the surfaces and algorithms that `--profile` selects.

The command line loads this module for its choices, so it imports nothing large.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from cembench.core.errors import RegistryError

if TYPE_CHECKING:
    from cembench.registry import Registry
    from cembench.results.papers import Paper


class Profile(StrEnum):
    """Selections from a paper's list of models."""

    quick = "quick"
    standard = "standard"
    paper = "paper"


def _usual() -> Paper:
    from cembench.results.papers import usual_paper

    return usual_paper()


def models(profile: Profile) -> list[str]:
    """Return the models of the profile, smallest first."""
    paper = _usual()
    ordered = sorted(paper.models, key=paper.faces)
    if profile is Profile.quick:
        return ordered[: paper.profiles.quick]
    largest = paper.profiles.standard if profile is Profile.standard else float("inf")
    return [model for model in ordered if paper.faces(model) <= largest]


def surfaces_of(profile: Profile, registry: Registry) -> list[str]:
    """Return the names of the stand-ins for the profile's models, smallest model first.

    Raises
    ------
    RegistryError
        A model has no registered stand-in, or two.
    """
    standing: dict[str, list[str]] = {}
    for surface in registry.surfaces.values():
        if surface.paper_row:
            standing.setdefault(surface.paper_row, []).append(surface.name)
    wanted = models(profile)
    missing = [model for model in wanted if model not in standing]
    if missing:
        raise RegistryError(
            f"profile {profile.value!r}: no surface stands in for {', '.join(missing)}; "
            "name surfaces or mesh files instead, or declare one with "
            '@surface_family(..., paper_row="...").'
        )
    for model in wanted:
        if len(standing[model]) > 1:
            raise RegistryError(
                f"two surfaces stand in for {model}: {', '.join(standing[model])}; only one can. "
                "Leave out a plug-in, or name the surfaces."
            )
    return [standing[model][0] for model in wanted]


def algorithms_of(profile: Profile, registry: Registry) -> list[str]:
    """Return the default algorithms of a profile.

    `quick` uses those of the paper's tables, to be quick; the others use the usual ones.
    """
    if profile is Profile.quick:
        return [name for name in _usual().algorithms if name in registry.algorithms]
    return registry.usual_algorithms
