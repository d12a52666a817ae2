"""The structure of the tree: layers import downwards, and every package is installed."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "cembench"
#: Where the packages that are installed below ``cembench`` lie in the tree.
ELSEWHERE = {
    "cembench.algorithms": "algorithms",
    "cembench.papers": "papers",
    "cembench.sharing": "sharing",
    "cembench.surfaces": "meshes_gen",
    "cembench.textures": "textures",
}

#: What these are called below ``cembench``.
AT_THE_EDGE = [name.partition(".")[2] for name in ELSEWHERE]


def layers():
    """The rooms of ``cembench/`` in the order that docs/architecture.md gives them."""
    text = (ROOT / "docs/architecture.md").read_text()
    tree = text.partition("```\n")[2].partition("```")[0].partition("cembench/")[2]
    inside = tree.partition("\nalgorithms/")[0]
    return re.findall(r"(?m)^  (\w+)(?:/|\.py)? ", inside)


def imported(file):
    """Every cembench module or name that a file imports, also inside functions."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def room_of(dotted):
    parts = dotted.split(".")
    return parts[1] if parts[0] == "cembench" and len(parts) > 1 else None


def violations(rooms, package=PACKAGE):
    for file in sorted(package.rglob("*.py")):
        here = file.relative_to(package).parts[0].removesuffix(".py")
        if here not in rooms:
            continue  # the package's own __init__ offers names of all layers
        for name in imported(file):
            there = room_of(name)
            if name.startswith("cembench.__"):
                yield f"{file.relative_to(package)} imports {name} of the package's face"
            if there in AT_THE_EDGE:
                yield f"{file.name} imports {name}, of a room at the edge, by name"
            elif there in rooms and rooms.index(there) > rooms.index(here):
                yield f"{file.relative_to(package)} imports {name}"


def test_the_document_names_every_room_and_they_are_few():
    there = {p.name for p in PACKAGE.iterdir() if p.is_dir() and p.name != "__pycache__"}
    there |= {p.stem for p in PACKAGE.glob("*.py") if not p.stem.startswith("__")}
    assert set(layers()) == there
    assert len(there) <= 13


def test_a_layer_imports_only_from_those_above_it_in_the_document():
    assert list(violations(layers())) == []


#: Most lines of Python in each room, lowered after every cut.
BUDGETS = {
    "core": 2_050,
    "mesh": 6_780,
    "linear_algebra": 1_530,
    "conformal": 6_680,
    "registry": 970,
    "results": 4_990,
    "running": 8_010,
    "drawing": 1_410,
    "report": 7_780,
    "validation": 2_260,
    "api": 4_850,
    "commands": 2_730,
}


def lines_of(room):
    files = [PACKAGE / f"{room}.py", *(PACKAGE / room).rglob("*.py")]
    return sum(len(file.read_text().splitlines()) for file in files if file.is_file())


@pytest.mark.parametrize("room", BUDGETS)
def test_a_room_keeps_to_its_lines_and_its_budget_follows_a_cut(room):
    assert BUDGETS[room] - 150 < lines_of(room) <= BUDGETS[room]


def test_every_room_has_a_budget():
    assert set(BUDGETS) == set(layers())


def test_an_upward_import_would_be_found(tmp_path):
    (tmp_path / "mesh").mkdir()
    (tmp_path / "mesh/files.py").write_text("def f():\n    from cembench.report import html\n")
    assert len(list(violations(layers(), tmp_path))) == 1


def test_an_import_of_the_package_s_face_would_be_found(tmp_path):
    (tmp_path / "report").mkdir()
    (tmp_path / "report/page.py").write_text("from cembench import __version__\n")
    assert len(list(violations(layers(), tmp_path))) == 1


def folders_of_packages():
    """The folder of each package of the tree, by the name it has once installed."""
    return {
        ".".join([name, *init.parent.relative_to(ROOT / folder).parts]): init.parent
        for name, folder in {"cembench": "cembench", **ELSEWHERE}.items()
        for init in (ROOT / folder).rglob("__init__.py")
    }


def test_every_package_of_the_tree_is_installed():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    assert declared["package-dir"] == ELSEWHERE
    assert set(declared["packages"]) == set(folders_of_packages())


def test_every_data_file_of_the_packages_is_installed():
    """A file that code reads beside itself is missed in an installation, never in the tree."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    folders = folders_of_packages()
    data = declared["package-data"]
    installed = {file for name in data for one in data[name] for file in folders[name].glob(one)}
    there = {
        file
        for folder in ("cembench", *ELSEWHERE.values())
        for file in (ROOT / folder).rglob("*")
        if file.is_file() and file.suffix not in (".py", ".pyc")
    }
    assert there - installed == set()


@pytest.mark.parametrize("folder", ELSEWHERE.values())
def test_rooms_at_the_edge_import_what_is_theirs_relatively(folder):
    """They have one name in the tree and another once installed."""
    for file in (ROOT / folder).rglob("*.py"):
        for name in imported(file):
            assert room_of(name) not in AT_THE_EDGE, file
            assert name.split(".")[0] not in ELSEWHERE.values(), file


def test_nobody_imports_sharing_and_textures():
    """They take what they like from everybody, and nobody knows them."""
    for folder in ELSEWHERE.values():
        for file in (ROOT / folder).rglob("*.py"):
            depth = len(file.relative_to(ROOT / folder).parts)
            for node in ast.walk(ast.parse(file.read_text())):
                if isinstance(node, ast.ImportFrom) and node.level > depth:
                    room = (node.module or "").partition(".")[0]
                    assert room not in ("sharing", "textures"), file
