import textwrap
from pathlib import Path
from types import SimpleNamespace

import pytest

from cembench import (
    DiskMesh,
    ParameterError,
    Parameterization,
    RegistryError,
    algorithm,
    registry,
    surface_family,
)
from cembench.registry import Algorithm, load_algorithm, load_registry, program_from

GOOD = """
    from typing import Annotated
    from pydantic import Field
    from cembench import DiskMesh, Parameterization, algorithm, surface_family

    @algorithm("mine", title="Mine", target="disk")
    def mine(mesh: DiskMesh, *, steps: Annotated[int, Field(ge=0)] = 3) -> Parameterization:
        '''Is it better?

        It says so.
        '''
        raise NotImplementedError

    @surface_family("plate", title="Plate")
    def plate(faces: int = 100, *, seed: int = 0) -> DiskMesh:
        raise NotImplementedError
"""


@pytest.fixture
def plugin(tmp_path):
    def write(text, name="plugin.py"):
        path = tmp_path / name
        path.write_text(textwrap.dedent(text))
        return str(path)

    return write


def test_an_entry_point_is_loaded_when_it_is_asked_for(monkeypatch):
    entries = {
        name: SimpleNamespace(name=name, value=name, group="g") for name in ("cem", "broken")
    }
    for entry in entries.values():
        entry.load = lambda: load_registry().algorithm("cem").function
    entries["broken"].load = lambda: 1 / 0
    declared = registry._Declared(entries, Algorithm)
    assert list(declared) == ["cem", "broken"]
    assert "broken" in declared
    assert declared["cem"].name == "cem"
    with pytest.raises(RegistryError, match="division by zero"):
        declared["broken"]


def test_the_built_in_ones_come_by_entry_points():
    registry = load_registry()
    assert {"cem", "harmonic-circle", "lscm"} <= set(registry.algorithms)
    assert registry.algorithm("lscm").target == "free boundary"
    assert registry.algorithm("cem").mesh_type is DiskMesh
    assert registry.algorithm("cem").notes.startswith("Faithful to Algorithm 1")
    assert registry.algorithm("cem").origin == "cembench.algorithms.cem:cem"


def test_the_families_of_the_field_are_not_measured_unless_named():
    """The default of a run, a profile and `reproduce`."""
    registry = load_registry()
    assert registry.usual_algorithms == [
        "cem",
        "direct-cem",
        "direct-cem-holes",
        "fdm",
        "harmonic-circle",
        "harmonic-filled",
        "koebe-cem",
        "ldm",
        "lscm",
        "qiem",
    ]
    assert not registry.algorithm("scp").usual


def test_a_file_adds_its_algorithms_and_surfaces(plugin):
    registry = load_registry([plugin(GOOD)])
    mine = registry.algorithm("mine")
    assert mine.arguments({}) == {"steps": 3}
    assert mine.arguments({"steps": "7"}) == {"steps": 7}
    assert mine.notes == "It says so."
    assert registry.surface("plate").arguments({})["faces"] == 100
    assert "mine" not in load_registry().algorithms


def test_a_module_adds_what_is_named():
    with pytest.raises(
        RegistryError, match=r"declared twice: by cembench.algorithms.cem:cem and by"
    ):
        load_registry(["cembench.algorithms.cem:cem"])


def test_a_name_is_declared_once(plugin):
    with pytest.raises(RegistryError, match=r"'cem' is declared twice.*Rename one"):
        load_registry([plugin(GOOD.replace('"mine"', '"cem"'))])
    with pytest.raises(RegistryError, match="'mine' is declared twice"):
        load_registry([plugin(GOOD), plugin(GOOD, "other.py")])


@pytest.mark.parametrize("name", ["a,b", " a", ""])
def test_a_name_that_no_option_can_choose_is_refused(plugin, name):
    with pytest.raises(RegistryError, match=f"the name '{name}' cannot be chosen: options sep"):
        load_registry([plugin(GOOD.replace('"mine"', f'"{name}"'))])
    with pytest.raises(RegistryError, match="cannot be chosen"):
        surface_family(name, title="A")(lambda faces=2: None)
    if name:
        with pytest.raises(RegistryError, match="cannot be chosen"):
            program_from({"command": "a {input} {output}", "name": name}, Path())


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(RegistryError, match=r"unknown algorithm 'qqq'; known: .*cem"):
        load_registry().algorithm("qqq")
    with pytest.raises(RegistryError, match=r"Did you mean flat-disk\?"):
        load_registry().surface("flat-dsik")
    with pytest.raises(RegistryError, match="Its stand-in is left-hand-stand-in") as public:
        load_registry().surface("left-hand")
    assert "`dataset` or `load_surface` reads it" in str(public.value)
    with pytest.raises(RegistryError, match=r"unknown surface 'qqq'; known: .*flat-disk"):
        load_registry().surface("qqq")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("import cembench_is_not_here", "cannot be imported: ModuleNotFoundError"),
        ("1 +", "cannot be imported: SyntaxError"),
        ("import sys; sys.exit(0)", "cannot be imported: SystemExit: 0"),
        ("class Mine(BaseException): pass\nraise Mine('x')", "cannot be imported: Mine: x"),
        ("from cembench import algorithm", "declares nothing; decorate a function"),
        ("from cembench.algorithms.cem import cem", "declares nothing"),
        (GOOD.replace('"disk"', '"plane"'), "target 'plane' is unknown; allowed: 'disk'"),
        (GOOD.replace("mesh: DiskMesh, ", "mesh, "), "must be annotated as DiskMesh"),
        (GOOD.replace("] = 3", "]"), "parameter 'steps' needs a type annotation and a default"),
    ],
)
def test_a_wrong_plugin_says_what_is_wrong(plugin, text, message):
    with pytest.raises(RegistryError, match=message):
        load_registry([plugin(text)])


def test_parameters_are_checked(plugin):
    mine = load_registry([plugin(GOOD)]).algorithm("mine")
    with pytest.raises(ParameterError, match=r"mine has no parameter 'stops'.*are: steps"):
        mine.arguments({"stops": 1})
    with pytest.raises(ParameterError, match=r"mine: steps=-1 is not allowed.*\(default 3\)"):
        mine.arguments({"steps": -1})
    with pytest.raises(ParameterError, match=r"steps='many' is not allowed"):
        mine.arguments({"steps": "many"})


def test_decorators_leave_the_function_alone():
    @algorithm("local", title="Local", target="disk")
    def local(mesh: DiskMesh) -> Parameterization:
        """Is it called?"""
        return "called"  # type: ignore[return-value]

    @surface_family("here", title="Here")
    def here(faces: int = 10) -> DiskMesh:
        """Is it called?"""
        return faces  # type: ignore[return-value]

    assert local(None) == "called"
    assert here(3) == 3


def test_one_algorithm_can_be_loaded_alone(plugin):
    path = plugin(GOOD)
    assert load_algorithm("cem") is load_registry().algorithm("cem")
    assert load_algorithm("mine", [path]).title == "Mine"
    with pytest.raises(RegistryError, match=r"unknown algorithm 'none'; known: .*cem"):
        load_algorithm("none", [path])
