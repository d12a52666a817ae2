import numpy as np
import pytest
from cembench.papers.cem.morphing.landmarks import check_order, common_landmarks, read_landmarks
from cembench.surfaces.flat_disk import flat_disk

from cembench import ParameterError

MESHES = [flat_disk(200), flat_disk(300)]
INSIDE = [mesh.interior for mesh in MESHES]
EDGE = int(MESHES[1].boundary[0])
GOOD = f"name, a, b\n# from 0\n\nnose, {INSIDE[0][0]}, {INSIDE[1][0]}\neye, {INSIDE[0][1]}, tip\n"
KNOWN = [{}, {"tip": int(INSIDE[1][5])}]


def read(text, tmp_path):
    path = tmp_path / "marks.csv"
    path.write_text(text)
    return read_landmarks(path, MESHES, KNOWN)


def test_a_file_has_indices_names_remarks_and_a_heading(tmp_path):
    surface = read(GOOD, tmp_path)
    assert surface.names == ("nose", "eye")
    assert surface.vertices.tolist() == [
        [INSIDE[0][0], INSIDE[1][0]],
        [INSIDE[0][1], INSIDE[1][5]],
    ]


i, j, k, l = INSIDE[0][0], INSIDE[1][0], INSIDE[0][1], INSIDE[1][1]  # noqa: E741
BAD = {
    "out of range": (f"nose,{i},99999\n", r"'nose' on .*: vertex 99999 is out of range; .* 0 to"),
    "negative": (f"nose,-1,{j}\n", "vertex -1 is out of range"),
    "name twice": (f"nose,{i},{j}\nnose,{k},{l}\n", "'nose' is named twice"),
    "vertex twice": (f"nose,{i},{j}\neye,{k},{j}\n", r"'eye' on .* is also landmark 'nose'"),
    "too few": (f"nose,{i}\n", r"line 1 \('nose'\): 1 vertices for 2 surfaces"),
    "too many": (f"nose,{i},{j},{j}\n", "3 vertices for 2 surfaces"),
    "unknown name": (f"nose,{i},chin\n", "'chin' is neither .* its landmarks are: tip"),
    "no names": (f"nose,tip,{j}\n", "'tip' is neither .* it has no named landmarks"),
    "a fraction": (f"nose,1.5,{j}\n", "'1.5' is neither a vertex index"),
    "boundary": (f"nose,{i},{EDGE}\n", "is on the boundary"),
    "empty": ("name,a,b\n", "has no rows"),
}


@pytest.mark.parametrize("case", BAD)
def test_each_bad_landmark_has_its_own_message(case, tmp_path):
    text, message = BAD[case]
    with pytest.raises(ParameterError, match=message):
        read(text, tmp_path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ParameterError, match=r"landmarks .*nothing.csv cannot be read"):
        read_landmarks(tmp_path / "nothing.csv", MESHES, KNOWN)


def test_names_that_all_surfaces_have_are_common():
    known = [
        {"nose": int(INSIDE[0][0]), "ear": int(INSIDE[0][1])},
        {"chin": int(INSIDE[1][3]), "nose": int(INSIDE[1][4])},
    ]
    common = common_landmarks(MESHES, known)
    assert common.names == ("nose",)
    assert common.vertices.tolist() == [[INSIDE[0][0], INSIDE[1][4]]]
    assert len(common_landmarks(MESHES, [{}, {}])) == 0


AROUND = np.array([0, 0.5, 0.4j, -0.6])


def test_the_same_order_is_accepted_whatever_the_turn():
    check_order("abcd", AROUND, 0.2 * AROUND * np.exp(2j), ("one", "two"))


@pytest.mark.parametrize("other", [AROUND.conj(), AROUND[[0, 2, 1, 3]]])
def test_a_contradictory_order_is_refused(other):
    """A mirror image, or left and right exchanged."""
    message = r"from 'b' to 'c' it goes counter-clockwise about 'a' on one, but clockwise on two"
    with pytest.raises(ParameterError, match=message):
        check_order("abcd", AROUND, other, ("one", "two"))


def test_landmarks_in_nearly_one_direction_may_change_places():
    first = np.array([0, 0.5, 0.6 * np.exp(0.1j)])
    check_order("abc", first, first.conj(), ("one", "two"))
