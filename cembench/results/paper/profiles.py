"""Profiles: the surfaces and algorithms that `--profile` selects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from cembench.core.errors import RegistryError
from cembench.results import paper

if TYPE_CHECKING:
    from cembench.registry import Algorithm, Registry
    from cembench.results.records import MeshOrigin

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


#: How the paper ran an algorithm on its own models where that is not the default: by algorithm, the
#: parameters with their value there and elsewhere. The printed figures of FDM contain an error of
#: its public program; see docs/paper_models.md.
AS_PRINTED: Mapping[str, Mapping[str, tuple[Any, Any]]] = {"fdm": {"public_program": (True, False)}}


def as_printed(origin: MeshOrigin, algorithms: Iterable[Algorithm]) -> dict[str, Any]:
    """Return the parameters with which the paper ran these algorithms on a surface.

    They are in the form that `plan_cells` takes, and belong to cells on the paper's own models:
    on a stand-in, or another surface, there are none.
    """
    if origin != "model":
        return {}
    return {
        f"{algorithm.name}.{name}": there
        for algorithm in algorithms
        for name, (there, _) in AS_PRINTED.get(algorithm.name, {}).items()
        if name in {parameter.name for parameter in algorithm.parameters}
    }


def as_elsewhere(algorithm: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return a cell's parameters with those of :data:`AS_PRINTED` as on other surfaces.

    >>> as_elsewhere("fdm", {"max_iterations": 5, "public_program": True})
    {'max_iterations': 5, 'public_program': False}
    """
    changed = AS_PRINTED.get(algorithm, {})
    return {
        name: changed[name][1] if name in changed and value == changed[name][0] else value
        for name, value in parameters.items()
    }
