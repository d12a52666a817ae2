"""A folder of broken meshes: refused with all causes, mended, and mapped after it."""

import pytest
from cembench.algorithms.direct_cem.disk import direct_cem

from cembench import DiskMesh, TriangleMesh
from cembench.conformal.metrics import all_metrics
from cembench.core.notices import NoticeKind
from cembench.mesh.defects import Defect, UnusableMeshError
from cembench.mesh.files import read_mesh, read_soup, repair_soup
from tests import gallery
from tests.mesh.broken import ALONE_AND_IN_PAIRS, DEFECTS, broken, crumb, ear, turned


@pytest.mark.parametrize(
    "defects", ALONE_AND_IN_PAIRS, ids=lambda given: "-".join(d.__name__ for d in given)
)
def test_refused_with_all_causes_then_mended_then_mapped(defects, tmp_path):
    path = tmp_path / "broken.obj"
    draft = broken(*defects)
    path.write_text(gallery.obj_text(draft.points, draft.faces))
    expected = set().union(*(DEFECTS[d] for d in defects))
    if expected:
        with pytest.raises(UnusableMeshError) as refused:
            read_mesh(path)
        named = {p.defect for p in refused.value.problems}
        assert expected <= named
        assert (Defect.orientation in named) >= (turned in defects)
        assert f"cembench repair {path} -o broken_repaired.obj" in str(refused.value)
    else:
        assert read_mesh(path).notices
    repaired = repair_soup(read_soup(path), drop=crumb in defects)
    mesh = DiskMesh.from_arrays(*repaired.surfaces[0])
    assert {notice.kind for notice in mesh.notices} <= (
        {NoticeKind.DEFINITION_1} if ear in defects else set()
    )
    assert repaired.notices or defects == (ear,)
    whole = broken()
    assert abs(mesh.m - len(whole.faces)) <= 4  # what was whole is there still
    metrics = all_metrics(mesh, direct_cem(mesh).uv)
    assert metrics["flipped_triangles"] == 0


def test_the_whole_surface_is_left_alone(tmp_path):
    draft = broken()
    (tmp_path / "whole.obj").write_text(gallery.obj_text(draft.points, draft.faces))
    repaired = repair_soup(read_soup(tmp_path / "whole.obj"))
    assert not any(repaired.steps.values())
    V, F = repaired.surfaces[0]
    assert V.tolist() == draft.points
    assert F.tolist() == draft.faces
    TriangleMesh.from_arrays(V, F)
