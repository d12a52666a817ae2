"""The guide includes the shipped examples, and what it tells to type does what it says."""

import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import write_mesh
from cembench.commands.external import KEYS
from cembench.core.program import INPUTS, OUTPUTS
from cembench.registry import load_registry
from cembench.report.content.evidence import Evidence
from cembench.report.declared import declared_table
from cembench.results.records import FaultKind
from tests.validation.in_this_process import TimerHere, call_here

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples/external"
GUIDE = (ROOT / "docs/external_solvers.md").read_text()
NEEDS = {"lscm_in_c": "cc", "tutte.m": "octave-cli"}


def commands():
    blocks = re.findall(r"```console\n(.*?)```", GUIDE, re.DOTALL)
    return [line.removeprefix("$ ") for block in blocks for line in block.splitlines()]


@pytest.fixture
def typed(cli, monkeypatch):
    """Types a command of the guide in a folder that holds a face and the examples."""
    monkeypatch.setattr("cembench.validation.solver.in_a_process", lambda options: call_here)
    write_mesh(cli.folder / "face.obj", hemi_ellipsoid(400))
    for file in EXAMPLES.iterdir():
        shutil.copy(file, cli.folder)

    def type_(line):
        for word, program in NEEDS.items():
            if word in line and not shutil.which(program):
                pytest.skip(f"there is no {program} on this machine")
        words = shlex.split(line)
        if words[0] == "cembench":
            code, out, err = cli(*words[1:])
            assert code == 0, out + err
            return out
        subprocess.run(words, cwd=cli.folder, check=True)
        return ""

    return type_


def test_the_guide_includes_the_examples():
    included = re.findall(r"```\{literalinclude\} (\S+)", GUIDE)
    files = [(ROOT / "docs" / path).resolve(strict=True) for path in included]
    assert files == [EXAMPLES / "lscm_in_c.c", EXAMPLES / "tutte.m"]


def test_the_c_example_is_valid_as_the_guide_says(typed):
    compile_, map_, validate, *_ = commands()
    typed(compile_)
    printed = typed(map_)
    assert "lscm_in_c (external program) (free boundary)" in printed
    assert "(printed by the program)" in " ".join(printed.split())
    printed = typed(validate)
    assert not re.search(r" fault  ", printed)
    documented = GUIDE.split("exit code is 0:\n\n```\n")[1].split("\n```")[0]
    assert " ".join(documented.split()) in " ".join(printed.split())


def test_the_octave_example_maps_to_the_disk(typed):
    (line,) = (one for one in commands() if "tutte.m" in one)
    row = json.loads(typed(f"{line} --json"))
    assert (row["title"], row["target"]) == ("tutte (external program)", "disk")
    assert (row["status"], row["flipped_triangles"]) == ("ok", 0)
    assert row["external_version"].startswith("GNU Octave")


def test_peers_are_measured_beside_ours_and_libigls_lscm_is_ours(typed, cli, monkeypatch):
    """The report is another test's matter: drawing it takes longer than measuring."""
    monkeypatch.setattr("cembench.running.local.CellTimer", TimerHere)
    monkeypatch.setattr("cembench.api.benchmark.Run.report", lambda run, **_: None)
    (line,) = (one for one in commands() if " peers " in one)
    printed = " ".join(typed(line).split())
    assert "igl-lscm ‡" in printed
    assert "‡ a library of others" in printed
    energies = re.findall(r"(?:igl-)?lscm(?: ‡)? (\d\.\d{4}) ", printed)
    assert len(energies) == 2
    assert energies[0] == energies[1]
    table = declared_table(Evidence.of(cli.folder / "results/peers"), "beside-others")
    by_key = {(row[1].text, row[2].text): row[4].text for row in table.rows}
    assert by_key["free boundary", "LSCM of libigl ‡"] == by_key["free boundary", "LSCM"]
    assert ("disk", "CEM") in by_key


def test_the_guide_names_every_key_format_fault_and_peer():
    for name in KEYS:
        assert f"| `{name}` |" in GUIDE
    for suffix in (*INPUTS, *OUTPUTS):
        assert f"`{suffix[1:]}`" in GUIDE
    for name in load_registry().peers:
        assert f"`{name}`" in GUIDE
    kinds = [kind for kind in FaultKind if re.search("output|program|other_s|cut_s|not_t", kind)]
    assert len(kinds) == 7
    for kind in kinds:
        assert f"`{kind}`" in GUIDE
