"""What the harness says of maps to the disk with circular holes."""

import numpy as np
import pytest

from cembench import HoledMesh, Parameterization, algorithm
from cembench.results.records import FaultKind
from cembench.running import map_checks
from cembench.running.map_promises import faults
from cembench.running.measure import check_cell
from cembench.running.plan import MeasurementSettings, plan_cells
from tests import gallery

MESH = gallery.three_holes()
FLAT = MESH.V[:, 0] + 1j * MESH.V[:, 1]


def mapped(uv, target="circular holes"):
    """The outcome of an algorithm that answers with this map."""

    @algorithm("given", title="Given", target=target)
    def given(mesh: HoledMesh) -> Parameterization:
        return Parameterization(uv)

    spec = given.__cembench__
    task = plan_cells([spec], [MESH], {}, MeasurementSettings(repeats=1))[0]
    return check_cell(spec, MESH, task.cell)[0], [f.detail for f in faults(spec, MESH, uv)]


def holes():
    return [loop for loop in MESH.loops if abs(abs(FLAT[loop]) - 1).max() > 1e-6]


def test_round_holes_are_ok_and_reported_with_centres_and_radii():
    outcome, _ = mapped(FLAT)
    assert (outcome.status, outcome.notes) == ("ok", ())
    outer, *found = outcome.boundaries
    assert outer.radius == pytest.approx(1)
    assert sorted(b.radius for b in found) == pytest.approx(sorted(gallery.THREE_HOLES[1]))


def test_a_hole_that_is_no_circle_breaks_the_promise_of_circular_holes_alone():
    uv = FLAT.copy()
    loop = holes()[0]
    middle = uv[loop].mean()
    uv[loop] = middle + 0.999 * (uv[loop] - middle) + 0.02 * np.conj(uv[loop] - middle)
    outcome, _ = mapped(uv)
    assert outcome.status == "invalid"
    assert [fault.kind for fault in outcome.faults] == [FaultKind.HOLES_NOT_CIRCULAR]
    assert f"1 of 3 holes are not circles: that of vertex {loop.min()} is off by" in outcome.cause
    assert outcome.metrics["boundary_circularity"] > 0.01
    outcome, _ = mapped(uv, "disk with holes")
    assert outcome.status == "ok"


def test_an_outer_boundary_off_the_unit_circle_is_invalid():
    outcome, _ = mapped(0.9 * FLAT)
    assert outcome.status == "invalid"
    assert "outer boundary lies off the unit circle by up to 0.1" in outcome.cause


def test_holes_that_cross_are_named():
    uv = FLAT.copy()
    one, other = holes()[:2]
    uv[one] += uv[other].mean() - uv[one].mean() + 0.1
    outcome, problems = mapped(uv)
    assert outcome.status == "invalid"
    assert f"boundary {one.min()} crosses boundary {other.min()}" in problems[0]
    assert "triangles are folded" in outcome.cause


def test_a_mirrored_map_is_invalid():
    outcome, _ = mapped(np.conj(FLAT))
    assert "reverses the surface's orientation" in outcome.cause


def test_a_hole_turned_inside_out_crosses_itself():
    uv = FLAT.copy()
    loop = holes()[0]
    uv[loop[: len(loop) // 2]] = uv[loop[: len(loop) // 2]][::-1]
    _, problems = mapped(uv)
    assert f"boundary {loop.min()} crosses itself" in problems[0]


def test_an_ok_map_does_not_hide_figures_that_are_infinite(monkeypatch):
    found = {"conformal_energy": 1.0, "dirichlet_energy": 2.0, "dilatation_max": float("inf")}
    monkeypatch.setattr(map_checks, "computed", lambda *_: found)
    outcome, _ = mapped(FLAT)
    assert outcome.metrics["dilatation_max"] is None
    (note,) = outcome.notes
    assert note.text.startswith("dilatation_max is inf")
