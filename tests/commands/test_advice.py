"""What errors advise in the shell, followed to the letter: it works, and never leads back."""

import re
import shlex

import pytest

from tests import gallery
from tests.mesh.test_repair_cuts import defective, sphere

#: Advice that no command can follow.
BY_HAND = ("divide all coordinates by", "export or download it again")


def write_raw(path, V, F):
    """Write arrays as they are, which `write_mesh` refuses."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in V.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (F + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("verb", ["map", "cut"])
@pytest.mark.parametrize(("V", "F"), [case[1] for case in defective()], ids=dict(defective()))
def test_the_commands_that_an_error_names_end_in_a_map(cli, verb, V, F):
    write_raw(cli.folder / "mine.obj", V, F)
    file, seen = "mine.obj", []
    while True:
        code, _, err = cli(verb, file, *(("-o", "disk.obj") if verb == "cut" else ()))
        if code == 0 and verb == "map":
            return
        if code == 0:
            file, verb = "disk.obj", "map"
            continue
        problems = re.sub(r"\d+|`.*", "", err.partition("problems:")[2] or err)
        assert problems not in seen, err
        seen.append(problems)
        commands = re.findall(r"`cembench ((?:repair|cut) [^`]*)`", " ".join(err.split()))
        if not commands:
            assert any(one in " ".join(err.split()) for one in BY_HAND), err
            return
        for command in map(shlex.split, commands):
            code, _, err = cli(*command)
            assert code == 0, err
            file = command[command.index("-o") + 1]


@pytest.mark.parametrize("surface", [gallery.flat_rectangle(4, 5), (sphere().V, sphere().F)])
def test_the_options_that_an_error_names_end_in_a_map_too(cli, surface):
    """Those of `map`, and the other kind of algorithm."""
    write_raw(cli.folder / "mine.obj", *surface)
    call, advised = ["map", "mine.obj", "-a", "direct-cem-holes"], []
    while True:
        code, _, err = cli(*call)
        if code == 0:
            break
        text = " ".join(err.split())
        option = next(o for o in ("--cut", "algorithm for disks") if o in text)
        assert option not in advised, err
        advised.append(option)
        call = ["map", "mine.obj", *(["--cut"] if option == "--cut" else [])]
    assert advised


def test_a_hole_is_filled_or_kept_as_the_error_says(cli):
    V, F = next(case for name, case in defective() if name == "holes")
    write_raw(cli.folder / "mine.obj", V, F)
    code, _, err = cli("map", "mine.obj", "-a", "cem")
    assert code == 2
    assert "`cembench repair mine.obj -o mine_repaired.obj --fill-holes 6`" in " ".join(err.split())
    assert "without --fill-holes, use an algorithm for surfaces with holes" in " ".join(err.split())
    assert cli("repair", "mine.obj", "-o", "mine_repaired.obj")[0] == 0
    assert cli("map", "mine_repaired.obj", "-a", "koebe-cem")[0] == 0
