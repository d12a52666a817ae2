"""Parameters belong to cells: how the paper ran an algorithm holds on its own models only."""

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.registry import load_registry
from cembench.results.papers import NO_PAPER, find_paper
from cembench.running.plan import MeasurementSettings, Provenance, plan_cells

ROLES = {
    "model": Provenance("Nefertiti", "model"),
    "stand-in": Provenance("Nefertiti", "stand-in"),
}
MESHES = [flat_disk(200 + 20 * k).renamed(name) for k, name in enumerate([*ROLES, "own"])]


def public_program(parameters, algorithms=("cem", "fdm"), paper="cem"):
    """Whether FDM is the public program, by surface."""
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in algorithms]
    asked = find_paper(paper) if paper else NO_PAPER
    tasks = plan_cells(
        chosen, MESHES, parameters, MeasurementSettings(), standing=ROLES, paper=asked
    )
    fdm = [task.cell for task in tasks if task.algorithm.name == "fdm"]
    return {cell.mesh: cell.parameters["public_program"] for cell in fdm}


def test_fdm_is_the_public_program_on_the_paper_s_own_model_alone():
    assert public_program({}) == {"model": True, "stand-in": False, "own": False}


@pytest.mark.parametrize("paper", [None, "ldm2018"])
def test_a_run_for_another_paper_or_none_has_our_reading_everywhere(paper):
    assert public_program({}, paper=paper) == dict.fromkeys([*ROLES, "own"], False)


@pytest.mark.parametrize("name", ["public_program", "fdm.public_program"])
@pytest.mark.parametrize("value", [False, True])
def test_what_the_user_asks_for_holds_on_every_surface(name, value):
    assert public_program({name: value}) == dict.fromkeys([*ROLES, "own"], value)
