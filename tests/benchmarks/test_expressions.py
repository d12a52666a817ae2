"""The study of registration on scans, on a made-up surface and its deformation."""

import numpy as np
import pytest
import scipy.io
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from benchmarks.expressions import EYES, TIP, errors_of, expressions, read_scan, told_of
from cembench.core.errors import ParameterError

pytestmark = pytest.mark.usefixtures("one_server")


@pytest.fixture
def files(tmp_path):
    """A cap, the same turned and stretched, and a third one, each with 51 landmarks from 1."""
    mesh = hemi_ellipsoid(800)
    order = mesh.interior[:: len(mesh.interior) // 51][:51] + 1
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    made = []
    for k, V in enumerate((mesh.V, mesh.V @ turn * 3, mesh.V * [1, 1, 1.2])):
        made.append(tmp_path / f"scan-{k}.mat")
        scipy.io.savemat(
            made[-1], {"V": V, "F": (mesh.F + 1).astype(np.uint16), "landmark": order[:, None]}
        )
    return made


def test_a_rigid_motion_and_a_scale_are_registered_exactly(files):
    first, turned, _ = map(read_scan, files)
    assert len(first[1]) == 51
    for told in (told_of(51, 4), [TIP, EYES[0], EYES[1]]):
        assert errors_of(first, turned, told, "direct-cem").max() < 2


def test_the_study_has_a_row_for_each_number_of_landmarks_and_no_picture(files):
    section = expressions(files)
    assert not section.files
    rows = section.parts[1].rows
    assert [row["told"] for row in rows] == [51, 27, 14, 1]
    assert all(row["scans"] == 2 for row in rows), str(section)
    assert rows[0]["median"] < 5
    assert "too few scans" in str(section)


def test_landmarks_that_are_no_vertices_are_refused(files):
    held = scipy.io.loadmat(files[0])
    scipy.io.savemat(files[0], {"V": held["V"], "F": held["F"], "landmark": [[10**5]]})
    with pytest.raises(ParameterError, match=r"landmark holds 1 numbers; give vertices from 1 to"):
        read_scan(files[0])
