"""What README and the start pages tell people to type works after `pip install .` alone."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import cembench
from cembench.core.extras import MODULES

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs/start").glob("*.md"))]
#: What needs a network, minutes, or an extra, and says so on its page.
ELSEWHERE = ("fetch", "reproduce", "--dataset", "left-hand", "--profile", "human-face")
#: The file of the algorithm that a page has; that of README where it has none.
SOLVER = "mine.py"
#: The program that a page names.
PROGRAM = f"""#!/bin/sh
exec {shlex.quote(sys.executable)} -m cembench map "$1" -o "$3" -a harmonic-circle --uv disk
"""
#: Variables that examples take for granted, as files or arrays.
GIVEN = """
import cembench
V, F = (lambda mesh: (mesh.V, mesh.F))(cembench.surface("hemi-ellipsoid", 400))
face = other = cembench.surface("hemi-ellipsoid", 400)
"""


def blocks(page, *languages):
    """The blocks of code of a page in these languages."""
    found = re.findall(r"```(\w*)\n(.*?)```", page.read_text(), re.DOTALL)
    return [code for language, code in found if language in languages]


def commands(page):
    """The command lines of a page that start with cembench."""
    code = "\n".join(blocks(page, "", "console")).splitlines()
    lines = [line.removeprefix("$ ") for line in code]
    typed = [line.partition("    #")[0] for line in lines if line.startswith("cembench ")]
    return [line for line in typed if not any(word in line for word in ELSEWHERE)]


def solver_of(page):
    """The algorithm that a page writes; nothing where it has none."""
    return "\n".join(code for code in blocks(page, "python") if "@algorithm(" in code)


@pytest.fixture
def bare(tmp_path):
    """A folder with the files that the pages name, and what runs Python without any extra."""
    blocked = sorted({module for modules in MODULES.values() for module in modules})
    site = f"import sys\nsys.modules |= dict.fromkeys({blocked!r})\n"
    (tmp_path / "site").mkdir()
    (tmp_path / "site/sitecustomize.py").write_text(site)
    (tmp_path / "meshes").mkdir()
    disk = cembench.surface("hemi-ellipsoid", 400)
    for name in ("face", "scan", "head", "torus", "meshes/one"):
        cembench.write_mesh(tmp_path / f"{name}.obj", disk)
    (tmp_path / SOLVER).write_text(solver_of(ROOT / "README.md"))
    (tmp_path / "mysolver").write_text(PROGRAM)
    (tmp_path / "mysolver").chmod(0o755)

    def run(*words):
        environment = os.environ | {"PYTHONPATH": str(tmp_path / "site")}
        return subprocess.run(
            [sys.executable, *words],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )

    return run


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_of_a_page_works_in_the_default_installation(page, bare):
    for line in commands(page):
        if line.startswith("cembench run") and "--rounds" not in line:
            line += " --rounds 1"
        done = bare("-m", "cembench", *shlex.split(line)[1:])
        refused = line.startswith("cembench validate")  # README's solver is not conformal
        assert done.returncode == refused, f"{line}\n{done.stdout}\n{done.stderr}"


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_python_of_a_page_works_in_the_default_installation(page, bare):
    done = bare("-c", "\n".join([GIVEN, *blocks(page, "python"), 'print("to the end")']))
    assert not done.returncode, done.stderr
    assert done.stdout.endswith("to the end\n")


@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if solver_of(p)], ids=lambda page: page.stem)
def test_the_algorithm_of_a_page_maps_a_surface(page, bare, tmp_path):
    (tmp_path / SOLVER).write_text(solver_of(page))
    done = bare(
        "-m", "cembench", *["map", "face.obj", "--plugin", "mine.py", "-a", "mine", "-o", "uv.obj"]
    )
    assert not done.returncode, done.stderr
    assert "vt " in (tmp_path / "uv.obj").read_text()


def test_a_report_needs_no_extra_and_has_still_plots(bare):
    code = """
import cembench
run = cembench.benchmark([cembench.surface("cone", 100)], ["lscm", "scp"], rounds=1)
report = run.report()
page = report.page.read_text()
assert "<img" in page and 'id="plotly"' not in page
print(repr(report))
"""
    done = bare("-c", code)
    assert not done.returncode, done.stderr
    assert len(done.stdout.splitlines()) == 2
    assert done.stdout.rstrip().endswith("index.html")
