import pytest

from cembench import DiskMesh, RegistryError, surface_family
from cembench.registry import Registry, load_registry
from cembench.results.papers import find_paper
from cembench.results.profiles import Profile, algorithms_of, models, surfaces_of

PAPER = find_paper("cem")


def registry_of(rows):
    def declared(name, row):
        @surface_family(name, title=name, paper_row=row)
        def plate(faces: int = 100) -> DiskMesh:
            raise NotImplementedError

        return plate.__cembench__

    return Registry({}, {name: declared(name, row) for name, row in rows.items()})


ALL = {f"stand-in-{k}": model for k, model in enumerate(sorted(PAPER.models))} | {"plain": ""}


@pytest.mark.parametrize(
    ("profile", "count", "last"),
    [
        (Profile.quick, 8, "Stanford Bunny"),
        (Profile.standard, 17, "Liu's Wry Face"),
        (Profile.paper, 20, "Knit Cap Man"),
    ],
)
def test_a_profile_takes_the_smallest_models_in_order(profile, count, last):
    chosen = models(profile)
    assert (len(chosen), chosen[0], chosen[-1]) == (count, "Nefertiti", last)
    assert [ALL[name] for name in surfaces_of(profile, registry_of(ALL))] == chosen


def test_a_model_without_a_surface_is_said():
    rows = {name: row for name, row in ALL.items() if row != "Foot"}
    with pytest.raises(RegistryError, match="profile 'quick': no surface stands in for Foot; name"):
        surfaces_of(Profile.quick, registry_of(rows))


def test_a_model_with_two_surfaces_is_said():
    with pytest.raises(RegistryError, match=r"two surfaces stand in for Foot: .*, again; only one"):
        surfaces_of(Profile.quick, registry_of(ALL | {"again": "Foot"}))


def test_quick_takes_the_paper_s_algorithms_and_the_others_all():
    known = load_registry()
    assert algorithms_of(Profile.quick, known) == ["qiem", "fdm", "ldm", "cem"]
    assert algorithms_of(Profile.paper, known) == known.usual_algorithms
    assert set(PAPER.algorithms) < set(PAPER.tables[1]["Foot"])
