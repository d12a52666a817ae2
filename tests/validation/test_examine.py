"""What a solver is compared with takes the same surfaces."""

import pytest

from cembench.registry import load_registry
from cembench.validation.examine import _GROWTH_REFERENCE, baselines, usual_rival
from cembench.validation.surfaces import mesh_kind

REGISTRY = load_registry()


@pytest.mark.parametrize("name", REGISTRY.algorithms)
def test_a_baseline_by_default_takes_the_surfaces_of_the_solver(name):
    solver = REGISTRY.algorithm(name)
    growth = usual_rival(solver, REGISTRY, _GROWTH_REFERENCE)
    for baseline in (*baselines(solver, REGISTRY, None), *growth):
        assert issubclass(mesh_kind(solver), REGISTRY.algorithm(baseline).mesh_type)


def test_there_is_none_where_the_usual_one_takes_disks_alone():
    assert baselines(REGISTRY.algorithm("plane"), REGISTRY, None) == ("lscm",)
    assert baselines(REGISTRY.algorithm("plane-holes"), REGISTRY, None) == ()
