import numpy as np
import pytest

import cembench
from cembench.conformal.metrics import all_metrics
from tests.running.test_local import FAULTY


def disks():
    return [cembench.surface("cone", faces) for faces in (80, 120, 160)]


def test_maps_are_those_of_single_calls_and_come_in_order():
    surfaces = disks()
    results = list(cembench.parameterize_many(surfaces))
    for mesh, result in zip(surfaces, results, strict=True):
        alone = cembench.parameterize(mesh)
        assert result.mesh.hash == mesh.hash
        np.testing.assert_array_equal(result.z, alone.z)
        assert dict(result.metrics) == dict(alone.metrics)


def test_several_processes_give_the_same():
    surfaces = [(mesh.V, mesh.F) for mesh in disks()] * 4
    results = list(cembench.parameterize_many(surfaces, "cem", jobs=2, tolerance=1e-6))
    for (V, F), result in zip(surfaces, results, strict=True):
        alone = cembench.parameterize(V, F, algorithm="cem", tolerance=1e-6)
        np.testing.assert_array_equal(result.z, alone.z)
        assert result.algorithm is alone.algorithm
        assert not result.mesh.V.flags.writeable


def test_surfaces_are_taken_as_they_are_needed():
    taken = []

    def endless():
        while True:
            taken.append(None)
            yield cembench.surface("cone", 60)

    many = cembench.parameterize_many(endless())
    assert next(many).ok
    assert len(taken) == 1


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_ends_the_iteration_or_stands_in_place_of_a_result(jobs, tmp_path):
    missing = str(tmp_path / "none.obj")
    surfaces = [disks()[0], missing, disks()[1]]
    first, error, last = cembench.parameterize_many(surfaces, jobs=jobs, errors="yield")
    assert first.ok
    assert last.ok
    assert isinstance(error, cembench.MeshError)
    assert missing in str(error)
    with pytest.raises(cembench.MeshError, match="there is no such file"):
        list(cembench.parameterize_many(surfaces, jobs=jobs))


def test_a_fast_check_finds_faults_and_leaves_figures_for_later():
    mesh = disks()[0]
    fast = cembench.parameterize(mesh, check="fast")
    assert fast.outcome.metrics == {}
    assert fast.outcome.peak_memory_bytes is None
    assert dict(fast.metrics) == all_metrics(mesh, fast.z)
    with pytest.raises(cembench.AlgorithmFailed, match="invalid"):
        cembench.parameterize(mesh, "mirrored", check="fast", plugins=[FAULTY])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"jobs": 0}, "allowed is 1 or more"),
        ({"errors": "ignore"}, "allowed: 'raise', 'yield'"),
        ({"check": "slow"}, "allowed: 'full', 'fast'"),
    ],
)
def test_unknown_options_are_refused(options, told):
    with pytest.raises(cembench.ParameterError, match=told):
        list(cembench.parameterize_many(disks(), **options))
