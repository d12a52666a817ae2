import numpy as np
import pytest
from cembench.algorithms.direct_cem.gauge_walk import MIN_GAIN, STEPS, gauge_walk

from cembench import DiskMesh
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_energy import EnergyModel
from cembench.conformal.circle_domain import CircleDomain
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import all_metrics
from tests import gallery


@pytest.fixture(scope="module")
def hill():
    mesh = DiskMesh.from_arrays(*gallery.hill_in_a_corner())
    bordered = BorderedLaplacian(mesh, laplacian(mesh), (mesh.boundary,))
    domain = CircleDomain.of_arcs(edge_lengths(mesh, mesh.boundary))
    weights = domain.outer_measure
    return mesh, bordered, EnergyModel(bordered.dirichlet_to_neumann(), domain, weights)


def test_energy_falls_while_angles_stay(hill):
    mesh, bordered, here = hill
    uv, walked = gauge_walk(here, bordered.harmonic_extension, lambda uv: 1.0)
    energies = (here.energy, *walked)
    assert 1 < len(energies) <= STEPS + 1
    assert (-np.diff(energies) > MIN_GAIN * np.array(energies[:-1])).all()
    assert energies[-1] == pytest.approx(all_metrics(mesh, uv)["conformal_energy"], rel=1e-9)


@pytest.mark.parametrize("growth", [0.01, np.nan])
def test_it_stays_where_angles_would_suffer(hill, growth):
    _, bordered, here = hill
    errors = iter([1.0, 1.0 + growth])
    uv, walked = gauge_walk(here, bordered.harmonic_extension, lambda uv: next(errors))
    assert len((here.energy, *walked)) == 1
    np.testing.assert_array_equal(uv, bordered.harmonic_extension(here.domain.points))


def test_no_angle_is_measured_where_there_is_nothing_to_gain():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(6, 6))
    bordered = BorderedLaplacian(mesh, laplacian(mesh), (mesh.boundary,))
    domain = CircleDomain.of_arcs(np.ones(len(mesh.boundary)))  # symmetric: no Moebius map helps

    def measured(uv):
        raise AssertionError("not asked for")

    model = EnergyModel(bordered.dirichlet_to_neumann(), domain, domain.outer_measure)
    assert len((model.energy, *gauge_walk(model, bordered.harmonic_extension, measured)[1])) == 1
