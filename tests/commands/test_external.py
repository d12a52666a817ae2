"""A program on the command line: what is refused, what is written, what tables say."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh, write_mesh
from cembench.mesh.uvs import read_uv
from cembench.registry import load_registry
from cembench.running.timing import CellTimer

SCRIPT = Path(__file__).parents[1] / "running/external/misbehaves.py"


def command(mode):
    return f"{sys.executable} -I {SCRIPT} {mode} {{input}} {{output}}"


@pytest.fixture
def face(cli):
    write_mesh(cli.folder / "face.obj", flat_disk(200))
    return "face.obj"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("map", "f.obj", "--program", "target=disk"), "needs --command COMMAND"),
        (("map", "f.obj", "--command", "it's {input} {output}"), "cannot be split"),
        (
            ("map", "f.obj", "--command", "x {input} {output}", "--program", "colour=red"),
            "one of: ",
        ),
        (("map", "f.obj", "--command", "x {input} {output}", "--program", "target"), "KEY=VALUE"),
        (("map", "f.obj", "--command", "x {input} {output}", "--program", "fit=1"), "yes or no"),
        (
            ("map", "f.obj", "--command", "x {input} {output}", "--program", "circle=a"),
            "is not a number",
        ),
        (
            ("map", "f.obj", "--command", "x {input} {output}", "-a", "cem"),
            "both name an algorithm",
        ),
        (("map", "f.obj", "--command", "cem {input} {output}"), "--program name=NAME"),
        (("map", "f.obj", "--command", "x {output}"), "where the mesh file goes"),
        (("validate",), "a program with --command COMMAND"),
        (("validate", "cem", "--command", "x {input} {output}"), "name one solver"),
        (("validate", "xatlas"), "xatlas makes an atlas"),
        (
            ("run", "--surfaces", "cone", "-a", "no-such"),
            "unknown algorithm 'no-such'; known: abf++",
        ),
    ],
)
def test_what_cannot_be_meant_is_refused(cli, words, message):
    code, _, err = cli(*words)
    assert code == 2
    assert message in " ".join(err.split())


def test_the_map_of_an_atlas_is_written_with_a_uv_for_each_corner(cli, face):
    how = ("--program", "target=atlas", "--program", "name=cutter")
    code, out, err = cli("map", face, "--command", command("cut"), *how, "-v", "-o", "uv.obj")
    assert code == 0, err
    assert re.search(r"islands +2 *\n", out)
    assert "maximum |mu|" in out
    written = read_uv(cli.folder / "uv.obj")
    assert len(np.unique(written.uv_index)) == len(written.uv) > flat_disk(200).n


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb", ".vtp", ".npz"])
def test_an_atlas_goes_into_every_format_that_holds_uvs(cli, face, suffix):
    words = ("map", face, "--command", command("cut"), "--program", "target=atlas")
    code, _, err = cli(*words, "-o", f"uv{suffix}")
    assert code == 0, err
    assert (cli.folder / f"uv{suffix}").stat().st_size > 1000


@pytest.mark.parametrize("more", [("-o", "uv.off"), ("--remesh", "a.obj"), ("--bake", "a.png")])
def test_what_an_atlas_cannot_give_is_refused_before_it_is_made(cli, face, more):
    words = ("map", face, "--command", command("hangs"), "--program", "target=atlas", *more)
    code, _, err = cli(*words)
    assert code == 2, err
    assert not any(path.suffix in (".off", ".html", ".png") for path in cli.folder.iterdir())


def test_an_atlas_has_a_preview_and_a_page(cli, face):
    words = ("map", face, "--command", command("cut"), "--program", "target=atlas")
    code, out, err = cli(*words, "-o", "uv.obj", "--preview", "--html", "a.html")
    assert code == 0, err
    assert (cli.folder / "uv.png").stat().st_size > 5000
    assert "prepareViews" in (cli.folder / "a.html").read_text()
    assert "uv.png" in out


def test_a_program_that_is_not_there_is_skipped_with_what_brings_it(cli, face):
    code, _, err = cli("map", face, "--command", "no-such-solver {input} {output}")
    assert code == 1
    assert "skipped: there is no program 'no-such-solver' on this machine. Install it" in err


def test_tables_and_rows_mark_the_program_and_tell_its_times(cli, monkeypatch):
    monkeypatch.setattr("cembench.running.local.CellTimer", TimerWithoutForks)
    words = ("run", "--surfaces", "flat-disk", "--faces", 100, "--repeats", 1, "-a", "direct-cem")
    words += ("--command", command("normalised"), "--program", r"seconds=solve: (\S+) s")
    words += ("--program", "name=mine", "--reference", "direct-cem")
    code, out, err = cli(*words)
    assert code == 0, err
    message = " ".join(out.split())
    assert "mine †" in message
    assert "† external program: its seconds are the wall clock of a process" in message
    assert "solve 0.125 s (printed by the program)" in message
    code, out, _ = cli(*words, "--json")
    ours, row = json.loads(out)
    assert (ours["external"], ours["start_seconds"], ours["solve_seconds"]) == (None, None, None)
    assert (row["external"], row["own_seconds"], row["solve_seconds"]) == ("program", 0.125, 0.125)
    assert row["title"] == "mine (external program)"
    assert min(row["seconds"], row["start_seconds"], row["input_bytes"]) > 0
    assert row["external_name"].endswith("misbehaves.py normalised {input} {output}")
    assert row["speedup"] == pytest.approx(0.125 / ours["seconds"] - 1)


class TimerWithoutForks(CellTimer):
    """Starts a process where a server would have to be started for one."""

    def __init__(self, scratch, options):
        super().__init__(scratch, options, forks=False)


@pytest.mark.parametrize(
    ("words", "others"),
    [
        ((), load_registry().usual_algorithms),
        (("-a", "all"), load_registry().algorithms),
        (("-a", "cem"), ["cem"]),
    ],
)
def test_run_measures_the_program_beside_the_algorithms_it_would_measure(cli, words, others):
    program = ("--command", command("good"), "--program", "name=mine")
    surface = ("--surfaces", "flat-disk", "--faces", 100)
    code, out, err = cli("run", *surface, *words, *program, "--dry-run", "--json")
    assert code == 0, err
    planned = {cell["algorithm"] for cell in json.loads(out)["cells"]}
    assert "mine" in planned
    disks = {name for name in others if load_registry().algorithm(name).mesh_type is DiskMesh}
    assert disks <= planned
