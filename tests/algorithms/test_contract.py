"""What every registered algorithm must keep to, whoever wrote it."""

import re

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed, DiskMesh, HoledMesh
from cembench.conformal.laplacian import non_delaunay_share
from cembench.conformal.metrics import all_metrics
from cembench.conformal.planar import signed_areas
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.registry import load_registry
from cembench.validation import surfaces
from tests import gallery

ALGORITHMS = load_registry().algorithms
DISKS = sorted(name for name, one in ALGORITHMS.items() if one.mesh_type is not HoledMesh)
#: They have no map before they have converged.
CONVERGING = ("abf++", "bff", "cetm", "cetm-flips", "cetm-free", "circle-packing", "qiem", "scp")

#: How far the figures may move, relatively, when the same surface is given another way.
SAME_FIGURES = 1e-6
#: How far the map may move when factors are not kept.
SAME_MAP = 1e-9
COMPARED = (
    "dirichlet_energy",
    "image_area",
    "conformal_energy",
    "angle_error_mean_deg",
    "angle_error_sd_deg",
    "dilatation_mean",
)


def flat_ring():
    i, j, F = gallery.grid(1, 8, wrap_columns=True)
    z = (1 + i) * np.exp(2j * np.pi * j / 8)
    return np.stack([z.real, z.imag, 0 * z.real], 1), F


@pytest.fixture(params=sorted(ALGORITHMS))
def spec(request):
    return ALGORITHMS[request.param]


@pytest.fixture
def mesh(spec):
    return surfaces.uneven(load_registry(), surfaces.mesh_kind(spec))


def has(spec, parameter):
    return parameter in {one.name for one in spec.parameters}


def run(spec, mesh):
    return spec.function(mesh, **spec.arguments({}))


def assert_same_figures(spec, mesh, other):
    expected = all_metrics(mesh, run(spec, mesh).uv)
    metrics = all_metrics(other, run(spec, other).uv)
    for name in COMPARED:
        scale = expected["image_area"] if name.endswith(("energy", "area")) else expected[name]
        assert abs(metrics[name] - expected[name]) <= SAME_FIGURES * scale, name
    assert metrics["flipped_triangles"] == expected["flipped_triangles"]


def test_the_map_is_complex_finite_and_keeps_orientation(spec, mesh):
    uv = run(spec, mesh).uv
    assert uv.shape == (mesh.n,)
    assert uv.dtype == np.complex128
    assert np.isfinite(uv).all()
    assert (signed_areas(uv, mesh.F) > 0).all()


def test_the_boundary_lies_where_the_target_says(spec, mesh):
    uv = run(spec, mesh).uv
    if spec.target == "disk":
        assert abs(abs(uv[mesh.boundary]) - 1).max() <= 1e-12
    elif spec.target == "free boundary":
        assert all_metrics(mesh, uv)["image_area"] == pytest.approx(np.pi)
    else:
        outer = max(mesh.loops, key=lambda loop: np.abs(uv[loop]).max())
        assert abs(abs(uv[outer]) - 1).max() <= 1e-12


def test_what_is_reported_beside_the_map_fits_it(spec, mesh):
    result = run(spec, mesh)
    assert result.iterations >= 0
    assert np.isfinite(result.energy_history).all()
    if result.energy_history:
        assert len(result.energy_history) == result.iterations + 1


def test_the_same_call_gives_the_same_bits(spec, mesh):
    assert run(spec, mesh.fresh()).uv.tobytes() == run(spec, mesh.fresh()).uv.tobytes()


def test_the_mesh_is_left_as_it_was(spec, mesh):
    before = mesh.fresh().hash
    run(spec, mesh)
    assert mesh.fresh().hash == before


def test_rotation_translation_and_scale_do_not_matter(spec, mesh):
    assert_same_figures(spec, mesh, surfaces.moved(mesh))


def test_numbering_does_not_matter(spec, mesh):
    assert_same_figures(spec, mesh, surfaces.renumbered(mesh)[0])


def test_both_ways_of_solving_give_the_same_map(spec, mesh):
    with linear_algebra("reuse"):
        reused = run(spec, mesh.fresh()).uv
    with linear_algebra("backslash"):
        fresh = run(spec, mesh.fresh()).uv
    assert abs(reused - fresh).max() <= SAME_MAP


def test_a_surface_without_interior_gives_a_map_or_its_cause(spec):
    kind = HoledMesh if spec.mesh_type is HoledMesh else DiskMesh
    strip = kind.from_arrays(*(flat_ring() if kind is HoledMesh else gallery.flat_rectangle(1, 6)))
    alone = {"last_resort": False} if has(spec, "last_resort") else {}
    try:
        uv = spec.function(strip, **spec.arguments(alone)).uv
    except AlgorithmFailed as error:
        uv, why = np.zeros(0), str(error)
    assert np.isfinite(uv).all()
    assert len(uv) or re.search("no interior vertex|edges inside join boundary vertices", why)


@pytest.mark.parametrize("name", CONVERGING)
def test_too_few_steps_are_a_failure_that_names_what_allows_more(name):
    spec = ALGORITHMS[name]
    steps = "max_sweeps" if has(spec, "max_sweeps") else "max_iterations"
    few = {steps: 1} | ({"last_resort": False} if has(spec, "last_resort") else {})
    with pytest.raises(AlgorithmFailed, match=rf"after 1 .*[Aa]llow more with {steps}"):
        spec.function(hemi_ellipsoid(600), **spec.arguments(few))


@pytest.mark.parametrize("noise", [0, 0.03])
@pytest.mark.parametrize("name", [n for n in DISKS if has(ALGORITHMS[n], "delaunay")])
def test_delaunay_weights_change_only_what_is_not_delaunay(name, noise):
    spec, mesh = ALGORITHMS[name], flat_disk(600)
    V = mesh.V + noise * np.random.default_rng(0).standard_normal(mesh.V.shape)
    mesh = DiskMesh.from_arrays(V, mesh.F)
    assert (non_delaunay_share(mesh) > 0) == (noise > 0)
    own, delaunay = (
        spec.function(mesh.fresh(), **spec.arguments({"delaunay": on})).uv for on in (False, True)
    )
    apart = abs(delaunay - own).max()
    assert apart > 1e-4 if noise else apart < 1e-9
