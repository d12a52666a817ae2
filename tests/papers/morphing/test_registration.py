import numpy as np
import pytest
from cembench.algorithms.cem import cem
from cembench.papers.cem.morphing.align import centred
from cembench.papers.cem.morphing.registration import NEAR, first_fold, radially_stretched, register
from cembench.surfaces.flat_disk import flat_disk
from scipy import sparse

from cembench import AlgorithmFailed
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import dilatations, flipped_triangles
from cembench.linear_algebra.cholesky import Cholesky
from tests.papers.morphing.reliefs import NEUTRAL, relief, vertices_of


@pytest.fixture(scope="module")
def face():
    mesh = relief()
    landmarks = np.array(list(vertices_of(mesh, NEUTRAL).values()))
    return mesh, centred(mesh, cem(mesh).uv, landmarks), landmarks


def test_with_radius_zero_it_is_the_minimiser_of_the_registration_energy(face):
    """(34) to the letter: its gradient vanishes at every vertex inside."""
    mesh, z, landmarks = face
    targets, lam = z[landmarks] + 0.01, 0.3
    registration = register(mesh, z, landmarks, targets, lam=lam, reach=0.0)
    assert registration.lambdas == (lam,)
    gradient = laplacian(mesh) @ registration.uv
    gradient[landmarks] += 2 * lam * (registration.uv[landmarks] - targets)
    assert np.abs(gradient[mesh.interior]).max() < 1e-10
    np.testing.assert_array_equal(registration.uv[mesh.boundary], z[mesh.boundary])


def test_it_is_one_solve_where_nothing_folds(face, count_calls):
    mesh, z, landmarks = face
    factored, solved = count_calls(Cholesky, "__init__"), count_calls(Cholesky, "solve")
    registration = register(mesh, z, landmarks, z[landmarks] + 0.05j)
    assert registration.lambdas == (100.0,)
    assert (len(factored), len(solved)) == (1, 1)
    assert flipped_triangles(mesh, registration.uv) == 0


def test_more_lambda_meets_the_landmarks_better_and_costs_energy(face):
    mesh, z, landmarks = face
    L = laplacian(mesh)
    errors, energies = [], []
    for lam in (1.0, 10.0, 100.0):
        registration = register(mesh, z, landmarks, z[landmarks] * 1.1 + 0.02, lam=lam)
        errors.append(registration.landmark_error)
        energies.append(np.vdot(registration.uv, L @ registration.uv).real / 2)
    assert errors == sorted(errors, reverse=True)
    assert energies == sorted(energies)
    assert errors[-1] < NEAR


def test_folds_are_repaired_by_smaller_lambdas_step_by_step(face):
    """Eyes and mouth turned about the nose so far that one solve folds."""
    mesh, z, landmarks = face
    targets = z[landmarks] * np.exp(1.2j)
    registration = register(mesh, z, landmarks, targets)
    assert len(registration.lambdas) > 1
    assert all(lam < 100 for lam in registration.lambdas[:-1])
    assert flipped_triangles(mesh, registration.uv) == 0
    assert registration.landmark_error <= NEAR
    np.testing.assert_array_equal(registration.uv[mesh.boundary], z[mesh.boundary])


def test_a_face_of_another_size_in_the_disk_is_stretched_before(face):
    """One radial stretch of even dilatation, instead of many steps that wear triangles thin."""
    mesh, z, landmarks = face
    at = z[landmarks]
    registration = register(mesh, z, landmarks, at * np.abs(at) ** 2)
    assert registration.exponent == pytest.approx(3, rel=1e-6)
    assert len(registration.lambdas) == 1
    assert registration.landmark_error <= NEAR
    assert flipped_triangles(mesh, registration.uv) == 0


def test_the_stretch_keeps_the_boundary_and_has_even_dilatation(face):
    mesh, z, landmarks = face
    stretched, exponent = radially_stretched(
        mesh, z, landmarks, z[landmarks] * np.abs(z[landmarks])
    )
    assert exponent == pytest.approx(2)
    np.testing.assert_allclose(stretched, z * np.abs(z), atol=1e-12)
    np.testing.assert_allclose(stretched[mesh.boundary], z[mesh.boundary], rtol=1e-12)
    flat = type(mesh).trusted(np.stack([z.real, z.imag, 0 * z.real], 1), mesh.F)
    away = np.abs(z[mesh.F]).min(axis=1) > 0.2
    np.testing.assert_allclose(dilatations(flat, stretched)[away], 2, rtol=0.25)


def test_the_landmarks_disk_lets_one_solve_go_further(face):
    """A single vertex has no capacity: alone it folds long before its disk does."""
    mesh, z, landmarks = face
    targets = z[landmarks] + 0.12
    assert len(register(mesh, z, landmarks, targets).lambdas) == 1
    assert len(register(mesh, z, landmarks, targets, reach=0.0).lambdas) > 1


def test_landmarks_that_cannot_meet_are_an_error(face):
    """Two that should change places in a mesh far too coarse for it."""
    mesh = flat_disk(60)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    pair = mesh.interior[np.argsort(np.abs(z[mesh.interior]))[1:3]]
    with pytest.raises(AlgorithmFailed, match=r"flat-disk: after \d+ steps .* smaller lambda"):
        register(mesh, z, pair, z[pair[::-1]])


def test_without_landmarks_the_map_is_untouched(face):
    mesh, z, _ = face
    nothing = np.empty(0, dtype=np.int64)
    assert register(mesh, z, nothing, nothing.astype(complex)).uv is z


def test_the_first_fold_is_where_an_area_vanishes(face):
    mesh, z, landmarks = face
    new = z.copy()
    new[landmarks[0]] += 0.5
    share = first_fold(z, new, mesh.F)
    assert 0 < share < 1
    assert flipped_triangles(mesh, z + 0.999 * share * (new - z)) == 0
    assert flipped_triangles(mesh, z + 1.001 * share * (new - z)) > 0
    assert first_fold(z, 1.1 * z, mesh.F) == np.inf


def test_the_answer_does_not_depend_on_the_numbering(face):
    mesh, z, landmarks = face
    order = np.random.default_rng(0).permutation(mesh.n)
    place = np.argsort(order)
    other = type(mesh).from_arrays(mesh.V[order], place[mesh.F])
    targets = z[landmarks] * 0.9
    one = register(mesh, z, landmarks, targets).uv
    two = register(other, z[order], place[landmarks], targets).uv
    np.testing.assert_allclose(two, one[order], atol=1e-10)


def test_the_matrix_is_symmetric_positive_definite(face):
    """What Cholesky is given, by a dense eigenvalue solver on a small surface."""
    mesh = relief(faces=150)
    L = sparse.csr_array(laplacian(mesh))[mesh.interior][:, mesh.interior].toarray()
    pulled = np.zeros(len(L))
    pulled[3] = 200.0
    assert np.linalg.eigvalsh(L + np.diag(pulled)).min() > 0
