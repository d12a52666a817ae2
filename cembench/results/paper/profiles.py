"""Profiles: the surfaces and algorithms that `--profile` selects."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from cembench.core.errors import RegistryError
from cembench.results import paper

if TYPE_CHECKING:
    from cembench.registry import Registry

#: Number of smallest models in `quick`, and the most triangles in `standard`.
QUICK_MODELS = 8
STANDARD_FACES = 210_000


class Profile(StrEnum):
    """Selections from the paper's list of models."""

    quick = "quick"
    standard = "standard"
    paper = "paper"


def models(profile: Profile) -> list[str]:
    """Return the models of the profile, smallest first."""
    ordered = sorted(paper.table(1), key=paper.faces)
    chosen: dict[Profile, Callable[[], list[str]]] = {
        Profile.quick: lambda: ordered[:QUICK_MODELS],
        Profile.standard: lambda: [m for m in ordered if paper.faces(m) <= STANDARD_FACES],
        Profile.paper: lambda: ordered,
    }
    return chosen[profile]()


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
            "name --surfaces or --mesh instead, or declare one with "
            '@surface_family(..., paper_row="...").'
        )
    for model in wanted:
        if len(standing[model]) > 1:
            raise RegistryError(
                f"two surfaces stand in for {model}: {', '.join(standing[model])}; only one can. "
                "Leave out a --plugin, or name --surfaces."
            )
    return [standing[model][0] for model in wanted]


def algorithms_of(profile: Profile, registry: Registry) -> list[str]:
    """Return the default algorithms of a profile.

    `quick` uses those of the paper's tables, to be quick; the others use the usual ones.
    """
    if profile is Profile.quick:
        return [name for name in paper.ALGORITHMS if name in registry.algorithms]
    return registry.usual_algorithms


def paper_parameters(algorithms: Iterable[str]) -> dict[str, Any]:
    """Return the parameters that reproduce the paper's tables, in the form `plan_cells` takes.

    The printed figures of FDM contain an error of its public program; see docs/paper_models.md.

    >>> paper_parameters(["cem", "fdm"])
    {'fdm.public_program': True}
    """
    return {"fdm.public_program": True} if "fdm" in algorithms else {}
