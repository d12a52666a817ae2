"""Two versions of a solver: commits, environments, plug-in files."""

import json
import os
import subprocess
import sys
from xml.etree import ElementTree as Xml

import pytest

import cembench
from cembench.core.errors import ParameterError, RegistryError

HEAD = """
import time

from cembench import DiskMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
"""
SOLVER = """

@algorithm({name!r}, title="Mine", target="disk")
def solve_{name}(mesh: DiskMesh) -> Parameterization:
    "Map a disk."
    print("a solver may print what it likes")
    {first}
    uv = harmonic_extension(laplacian(mesh), mesh.boundary, arc_length_circle(mesh))
    {last}
    return Parameterization(uv)
"""
#: What becomes of each solver in the later version: its first and its last step.
LATER = {
    "same": ("", ""),
    "slow": ("time.sleep(1e-4 * mesh.n)", ""),
    "worse": ("", "uv = uv * (1.5 - 0.5 * abs(uv))"),
    "fails": ("raise ValueError('not today')", ""),
    "ends": ("__import__('os')._exit(3)", ""),
}


def solver(name, steps=("", "")):
    first, last = (step or "pass" for step in steps)
    return SOLVER.format(name=name, first=first, last=last)


@pytest.fixture
def files(tmp_path):
    """The earlier and the later version, as files of one name."""
    for folder, steps in (("old", {}), ("new", LATER)):
        (tmp_path / folder).mkdir()
        text = HEAD + "".join(solver(name, steps.get(name, ("", ""))) for name in LATER)
        (tmp_path / folder / "solvers.py").write_text(text)
    return [str(tmp_path / folder / "solvers.py") for folder in ("old", "new")]


def test_a_worse_version_and_one_that_fails_are_found(files):
    names = ("same", "worse", "fails", "ends")
    found = cembench.compare_versions(
        *files, algorithms=names, surfaces=["cone"], faces=120, rounds=1
    )
    bad = found.regressions()
    assert [(one.kind, one.algorithm) for one in bad if one.kind == "worse"] == [
        ("worse", "worse"),
        ("worse", "worse"),
    ]
    failed = {one.algorithm: one.detail for one in bad if one.kind == "invalid"}
    assert "ValueError: not today" in failed["fails"]
    assert "ended with code 3" in failed["ends"]
    assert {one.algorithm for one in bad} == {"worse", "fails", "ends"}
    record = found.run.records()[0]
    assert record.outcome.peak_memory_bytes is None, "it would be that of another process"
    assert not any("behind" in str(note) for r in found.run.records() for note in r.outcome.notes)


def test_a_surface_that_the_later_version_does_not_take_does_not_pass(tmp_path):
    text = """
from cembench import {kind}, Parameterization, algorithm


@algorithm("flat", title="Flat", target="free boundary")
def flat(mesh: {kind}) -> Parameterization:
    "Leave the plane as it is."
    return Parameterization(mesh.V[:, 0] + 1j * mesh.V[:, 1])
"""
    files = []
    for folder, kind in (("old", "TriangleMesh"), ("new", "DiskMesh")):
        (tmp_path / folder).mkdir()
        files.append(str(tmp_path / folder / "flat.py"))
        (tmp_path / folder / "flat.py").write_text(text.format(kind=kind))
    found = cembench.compare_versions(
        *files, algorithms=["flat"], surfaces=["holed-disk"], faces=500, rounds=1
    )
    (lost,) = found.regressions(["invalid"])
    assert str(lost) == (
        "invalid: flat on holed-disk: skipped: the later version does not take such a surface"
    )


@pytest.mark.slow
def test_a_slower_version_is_found_and_the_same_one_twice_is_not(files):
    found = cembench.compare_versions(
        *files, algorithms=["same", "slow"], surfaces=["cone"], faces=200, rounds=7
    )
    assert [(c.after["algorithm"], c.comparison.rounds) for c in found.changes] == [
        ("same", 7),
        ("slow", 7),
    ]
    assert [(one.kind, one.algorithm) for one in found.regressions()] == [("slower", "slow")]


def git(folder, *words):
    me = ["-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run(["git", *me, *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A repository with a package in a subdirectory, in which the later solver is worse."""
    project = tmp_path / "part"
    (project / "code").mkdir(parents=True)
    entry = '[project.entry-points."cembench.algorithms"]\nworse = "mine.inner:solve_worse"\n'
    places = '[tool.setuptools.package-dir]\nmine = "code"\n'
    (project / "pyproject.toml").write_text(entry + places)
    (project / "code/__init__.py").write_text("")
    git(tmp_path, "init", "-q")
    for steps in (("", ""), LATER["worse"]):
        (project / "code/inner.py").write_text(HEAD + solver("worse", steps))
        (project / "plug.py").write_text(HEAD + solver("plugged", steps))
        git(tmp_path, "add", "-A")
        git(tmp_path, "commit", "-qm", "a version")
    monkeypatch.chdir(project)
    return tmp_path


def test_two_commits_of_a_package_in_a_subdirectory_are_compared(repository):
    found = cembench.compare_versions(
        *("HEAD~1", "HEAD"),
        algorithms=["worse", "plugged"],
        plugins=["plug.py"],
        surfaces=["cone"],
        faces=120,
        rounds=1,
    )
    assert {(one.kind, one.algorithm) for one in found.regressions(["worse"])} == {
        ("worse", "worse"),
        ("worse", "plugged"),
    }
    assert found.versions[0].startswith("HEAD~1 (")
    listed = subprocess.run(["git", "worktree", "list"], capture_output=True, text=True, check=True)
    assert len(listed.stdout.splitlines()) == 1, "the copies are removed"


def test_two_environments_are_compared_and_the_exit_code_and_junit_say_what_is_worse(files, cli):
    words = ["compare", *files, "-a", "worse", "--surfaces", "cone", "--faces", "120"]
    words += ["--rounds", "1", "-o", "run"]
    code, out, err = cli(*words, "--fail-on", "worse,invalid", "--junit", "j.xml")
    assert code == 1
    assert "error: worse: worse on cone: E_C" in err
    assert "before: " in out
    root = Xml.parse(cli.folder / "j.xml").getroot()
    assert [suite.get("failures") for suite in root] == ["1", "0"]
    env = ["--env", f"old={sys.executable}", "--env", f"new={sys.executable}", "--plugin", files[0]]
    code, out, _ = cli("compare", *env, *words[3:-1], "two", "--fail-on", "worse", "--json")
    assert code == 0
    assert [one["status_after"] for one in json.loads(out)["maps"]] == ["ok"]


@pytest.mark.parametrize(
    ("given", "more", "message"),
    [
        ((), {}, "name two versions"),
        (("HEAD",), {}, "name two versions"),
        (("HEAD~1", "HEAD"), {"env": {"a": "b", "c": "d"}}, "name two versions"),
        (("HEAD", "nowhere"), {}, "has no commit 'nowhere'"),
        (("HEAD", "--all"), {}, "has no commit '--all'"),
        (("HEAD", "HEAD"), {"algorithms": ()}, "name the solvers to compare"),
    ],
)
def test_versions_that_cannot_be_compared_are_named(repository, given, more, message):
    with pytest.raises(ParameterError, match=message):
        cembench.compare_versions(*given, **({"algorithms": ["worse"]} | more))


def test_a_folder_in_no_repository_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(os.environ, "GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    with pytest.raises(ParameterError, match="the current folder is in no repository of git"):
        cembench.compare_versions("HEAD~1", "HEAD", algorithms=["cem"])


def test_a_version_without_the_solver_is_named(repository):
    with pytest.raises(RegistryError, match=r"HEAD~1 \(\w+\) has no solver 'other' that can be"):
        cembench.compare_versions("HEAD~1", "HEAD", algorithms=["other"])


@pytest.mark.parametrize(
    ("python", "message"),
    [
        ("/nowhere/python", "/nowhere/python cannot be started"),
        ("/bin/false", r"old \(/bin/false\): /bin/false ended with code 1"),
    ],
)
def test_an_environment_that_does_not_start_is_named(python, message):
    env = {"old": python, "new": sys.executable}
    with pytest.raises(RegistryError, match=message):
        cembench.compare_versions(algorithms=["cem"], env=env)
