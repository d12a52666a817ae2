import pytest

from cembench import DiskMesh
from cembench.core.parameterization import Parameterization
from cembench.registry import algorithm, load_registry
from cembench.results.records import Cell
from cembench.running import measure
from cembench.running.map_checks import Checked
from cembench.running.surfaces import generate_surface
from tests.validation.in_this_process import time_cell


@pytest.mark.parametrize(("long", "calls"), [(0.0, 1), (60.0, measure.ENOUGH_CALLS + 1)])
def test_a_long_call_is_timed_at_once_and_a_short_one_after_a_warm_up(monkeypatch, long, calls):
    monkeypatch.setattr(measure, "LONG_CALL", long)
    monkeypatch.setattr(measure, "ENOUGH_SECONDS", 60.0)
    made = []

    @algorithm("counted", title="Counted", target="disk")
    def counted(mesh: DiskMesh) -> Parameterization:
        """How often is this called?"""
        made.append(mesh)
        return Parameterization(mesh.V[:, 0] + 1j * mesh.V[:, 1])

    mesh = generate_surface(load_registry(), "flat-disk", 50)
    cell = Cell(algorithm="counted", code_hash="", mesh="flat-disk", mesh_hash=mesh.hash)
    result = time_cell(counted.__cembench__, mesh, cell, Checked())
    assert len(made) == calls
    assert len(result.calls) == max(1, calls - 1)
