import numpy as np
import pytest

import cembench
from cembench.conformal.metrics import all_metrics
from cembench.conformal.texel_density import (
    extent_of,
    needs_islands,
    texel_density_ratio,
    texture_words,
    undersampled_share,
)
from cembench.core.errors import CembenchError


def test_an_even_map_has_one_density_and_no_part_without_texels():
    disk = cembench.surface("flat-disk", 600)
    metrics = all_metrics(disk, disk.V[:, 0] + 1j * disk.V[:, 1])
    assert metrics["texel_density_ratio"] == pytest.approx(1)
    assert metrics["undersampled_share"] == 0
    assert texture_words(metrics) == "texel density varies 1 : 1"


def test_a_hundredth_at_either_end_does_not_count():
    areas, images = np.full(1000, 1.0), np.full(1000, 1.0)
    images[:5], images[5:10] = 1e-12, 1e12
    assert texel_density_ratio(areas, images) == 1
    images[:30], images[30:60] = 1 / 16, 4.0
    assert texel_density_ratio(areas, images) == pytest.approx(8)


def test_the_unit_of_surface_and_map_does_not_matter():
    rng = np.random.default_rng(3)
    areas, images = rng.random((2, 500)) + 0.1
    ratio, share = texel_density_ratio(areas, images), undersampled_share(areas, images**9, 70.0)
    assert texel_density_ratio(9 * areas, 1e6 * images) == pytest.approx(ratio)
    assert 0 < share < 1
    assert undersampled_share(9 * areas, 1e6 * images**9, 7e4) == pytest.approx(share)


def test_a_part_without_texels_is_told_by_its_share():
    areas, images = np.full(100, 1.0), np.full(100, 1.0)
    images[:18] = 1e-9
    found = {
        "texel_density_ratio": texel_density_ratio(areas, images),
        "undersampled_share": undersampled_share(areas, images, 10.0),
    }
    assert found["undersampled_share"] == pytest.approx(0.18)
    assert "18 % of the surface gets less than 1 texel" in texture_words(found)
    assert needs_islands(found)


def test_more_than_a_hundredth_collapsed_has_no_bound():
    areas, images = np.full(100, 1.0), np.full(100, 1.0)
    images[:2] = 0
    assert texel_density_ratio(areas, images) == np.inf
    assert needs_islands({"texel_density_ratio": None, "undersampled_share": 0.02})
    assert "no bound" in texture_words({"texel_density_ratio": None, "undersampled_share": 0.02})


def test_a_map_that_collapsed_to_a_point_has_no_texel():
    disk = cembench.surface("flat-disk", 200)
    metrics = all_metrics(disk, np.full(disk.n, 0.3 + 0.1j))
    assert metrics["texel_density_ratio"] == np.inf
    assert metrics["undersampled_share"] == 1


@pytest.mark.parametrize("metrics", [{}, {"conformal_energy": 1.0}])
def test_records_without_the_figures_say_nothing(metrics):
    assert texture_words(metrics) == ""
    assert not needs_islands(metrics)


def test_the_extent_is_that_of_the_unit_square_of_the_uvs():
    assert extent_of(np.array([1, 1j, -0.5])) == 2
    assert extent_of(np.array([0, 3, 3 + 1j])) == 3


def test_a_long_finger_needs_islands_and_a_hemisphere_does_not():
    finger = cembench.surface("hemi-ellipsoid", 4000)
    V = finger.V * [1, 1, 8]
    long = cembench.parameterize(V, finger.F)
    assert needs_islands(long.metrics)
    assert any("islands" in notice for notice in long.notices)
    assert not needs_islands(cembench.parameterize(finger).metrics)


def test_a_map_without_figures_has_no_advice_until_asked():
    result = cembench.parameterize(cembench.surface("flat-disk", 200), check="fast")
    assert result.notices == ()
    with pytest.raises((KeyError, CembenchError)):
        result.metrics["texel"]
