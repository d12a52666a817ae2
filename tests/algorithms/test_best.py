import ast
from pathlib import Path

import cembench.algorithms
import numpy as np
import pytest
from cembench.algorithms.best.choice import Candidate, best_of
from cembench.algorithms.best.disk import CANDIDATES, best
from cembench.algorithms.best.holes import CANDIDATES as OF_HOLES
from cembench.algorithms.best.holes import best_holes
from cembench.algorithms.cetm.flips import cetm_flips
from cembench.surfaces.catalogue import nefertiti
from cembench.surfaces.holed_disk import holed_disk
from cembench.surfaces.sheets import swiss_roll

import cembench
import cembench.conformal
from cembench import AlgorithmFailed, Parameterization
from cembench.conformal.angle_gauge import angle_gauge
from cembench.conformal.even_weights import evened
from cembench.conformal.graded_meshes import USUAL_STEPS
from cembench.conformal.metrics import angle_errors, flipped_triangles
from tests.conformal.test_even_weights import graded
from tests.hard_surfaces import hard_surface


def error_of(mesh, uv):
    return float(angle_errors(mesh, uv).mean())


def errors_of(result):
    tried = result.extras["tried"].values()
    return [one["angle_error_mean_deg"] for one in tried if not isinstance(one, str)]


@pytest.mark.parametrize(
    "mesh", [hard_surface(1), hard_surface(4), swiss_roll(2000), nefertiti()], ids=lambda m: m.name
)
def test_it_is_as_good_as_the_best_candidate(mesh):
    result = best(mesh)
    assert result.extras["chosen"] in CANDIDATES
    assert list(result.extras["tried"]) == list(CANDIDATES)
    chosen = CANDIDATES[result.extras["chosen"]].call(mesh).uv
    assert error_of(mesh, chosen) <= 1.01 * min(errors_of(result))
    uv, taken = evened(mesh, angle_gauge(mesh, chosen), result.extras["even_steps"])
    assert taken == result.extras["even_steps"]
    np.testing.assert_array_equal(result.uv, uv)
    assert error_of(mesh, uv) <= 1.01**2 * min(errors_of(result))
    assert not flipped_triangles(mesh, result.uv)


def test_on_a_graded_mesh_all_candidates_have_taken_even_steps():
    mesh = graded(decades=3)
    own = cetm_flips(mesh).uv
    after = error_of(mesh, evened(mesh, own, USUAL_STEPS)[0])
    assert after < 0.999 * error_of(mesh, own)
    tried = best(mesh).extras["tried"]["cetm-flips"]
    assert tried["angle_error_mean_deg"] == pytest.approx(after, rel=1e-12)


def test_with_holes_it_is_as_good_as_the_best_candidate():
    mesh = holed_disk(1500)
    result = best_holes(mesh)
    assert set(result.extras["tried"]) == set(OF_HOLES)
    assert error_of(mesh, result.uv) <= 1.01 * min(errors_of(result))
    turned = best_holes(mesh, outer=int(mesh.loops[1][0]))
    assert abs(turned.uv[mesh.loops[1]]) == pytest.approx(1)


def of(value, fails=""):
    def call(mesh):
        if fails:
            raise AlgorithmFailed(fails)
        return Parameterization(value(mesh))

    return call


FLAT = of(lambda mesh: mesh.V[:, 0] + 1j * mesh.V[:, 1])
STRETCHED = of(lambda mesh: mesh.V[:, 0] + 2j * mesh.V[:, 1])
FOLDED = of(lambda mesh: mesh.V[:, 0] - 1j * mesh.V[:, 1])
FAILS = of(None, "it gave up")


def test_failures_and_folds_are_passed_over():
    mesh = cembench.surface("flat-disk", 200)
    ways = {"fails": FAILS, "folded": FOLDED, "stretched": STRETCHED, "flat": FLAT}
    result = best_of(mesh, [{name: Candidate(way) for name, way in ways.items()}], 1e6)
    assert result.extras["chosen"] == "flat"
    tried = result.extras["tried"]
    assert tried["fails"] == "it gave up"
    assert tried["folded"] == f"{mesh.m:,} folds"
    assert errors_of(result)[1] < 1e-9 < errors_of(result)[0]


def test_of_equal_angles_the_more_even_area_wins():
    mesh = cembench.surface("flat-disk", 5000)
    uneven = of(lambda mesh: (z := mesh.V[:, 0] + 2j * mesh.V[:, 1]) + 0.2 * z**2)
    even = of(lambda mesh: mesh.V[:, 0] + 2.01j * mesh.V[:, 1])
    result = best_of(mesh, [{"uneven": Candidate(uneven), "even": Candidate(even)}], 1e6)
    assert result.extras["chosen"] == "even"
    errors = errors_of(result)
    assert errors[0] < errors[1] < 1.01 * errors[0]
    assert result.extras["tried"]["uneven"]["texel_density_ratio"] > 2


def test_no_algorithm_reads_a_clock():
    """A map must not depend on the load of the machine; phases are timed by `cembench.core`."""
    rooms = (Path(cembench.algorithms.__file__).parent, Path(cembench.conformal.__file__).parent)
    files = [path for room in rooms for path in room.rglob("*.py") if "peers" not in path.parts]
    assert len(files) > 60
    reading = [
        path.name
        for path in files
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Import | ast.ImportFrom)
        and {"time", "datetime"} & {getattr(node, "module", ""), *(one.name for one in node.names)}
    ]
    assert reading == []


def test_what_may_take_too_long_is_left_out_by_the_size_of_the_surface():
    mesh = cembench.surface("flat-disk", 200)
    ways = {"stretched": Candidate(STRETCHED), "flat": Candidate(FLAT, cost=1e12)}
    result = best_of(mesh, [ways], 1e9)
    assert result.extras["chosen"] == "stretched"
    assert "not tried" in result.extras["tried"]["flat"]


def test_without_a_map_every_cause_is_named_and_a_folded_one_is_left_to_the_judge():
    mesh = cembench.surface("flat-disk", 200)
    with pytest.raises(AlgorithmFailed) as failed:
        best_of(mesh, [{"fails": Candidate(FAILS), "too": Candidate(FAILS)}], 1e6)
    assert "fails: it gave up; too: it gave up" in str(failed.value)
    result = best_of(mesh, [{"fails": Candidate(FAILS), "folded": Candidate(FOLDED)}], 1e6)
    assert result.extras["chosen"] == "folded"


def test_the_name_stands_for_disks_and_for_surfaces_with_holes():
    for name, surface in (("best", "cone"), ("best-holes", "holed-disk")):
        result = cembench.parameterize(cembench.surface(surface, 600), "best")
        assert result.algorithm.name == name
        assert result.extras["chosen"] in {**CANDIDATES, **OF_HOLES}
