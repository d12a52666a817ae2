"""What errors advise in the shell, followed to the letter: it works, and never leads back."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imsave
from scipy.io import savemat

from cembench.mesh.files import write_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from tests import gallery
from tests.mesh.test_repair_cuts import defective

#: Advice that no command can follow.
BY_HAND = ("divide all coordinates by", "export or download it again")


@pytest.mark.parametrize("verb", ["map", "cut"])
@pytest.mark.parametrize(("V", "F"), [case[1] for case in defective()], ids=dict(defective()))
def test_the_commands_that_an_error_names_end_in_a_map(cli, verb, V, F):
    (cli.folder / "mine.obj").write_text(gallery.obj_text(V, F))
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
            if "--components" in command:
                file = file.replace(".obj", "_1.obj")


@pytest.mark.parametrize("surface", [gallery.flat_rectangle(4, 5), gallery.octahedron()])
def test_the_options_that_an_error_names_end_in_a_map_too(cli, surface):
    """Those of `map`, and the other kind of algorithm."""
    (cli.folder / "mine.obj").write_text(gallery.obj_text(*surface))
    call, advised = ["map", "mine.obj", "-a", "direct-cem-holes"], []
    while True:
        code, _, err = cli(*call)
        if code == 0:
            break
        text = in_options(err)
        option = next(o for o in ("--cut", "algorithm for disks") if o in text)
        assert option not in advised, err
        advised.append(option)
        call = ["map", "mine.obj", *(["--cut"] if option == "--cut" else [])]
    assert advised


def test_a_hole_is_filled_or_kept_as_the_error_says(cli):
    V, F = next(case for name, case in defective() if name == "holes")
    (cli.folder / "mine.obj").write_text(gallery.obj_text(V, F))
    code, _, err = cli("map", "mine.obj", "-a", "cem")
    assert code == 2
    assert "`cembench repair mine.obj -o mine_repaired.obj --fill-holes 6`" in " ".join(err.split())
    assert "or use an algorithm for surfaces with holes" in " ".join(err.split())
    assert cli("map", "mine.obj", "-a", "koebe-cem")[0] == 0


DISK, OTHER, TWO = "mine.obj", "other.obj", "two.obj"
RUN = "run -a harmonic-circle --faces 60 --dry-run"
#: Calls whose options exclude each other, or need another one.
CLASHES = (
    f"map {DISK} -o out.obj --checker --bake texture.png",
    f"map {DISK} {OTHER} -o out.obj --bake texture.png",
    f"map {DISK} --checker",
    f"map {DISK} -o out.vtp --checker",
    f"map {DISK} -o out.stl",
    f"map {DISK} -o nowhere/out.obj",
    f"map {DISK} -o {DISK}",
    f"map {DISK} {OTHER} -o out.obj --uv disk",
    f"map {DISK} {OTHER} -o taken",
    f"map {DISK} folder/{DISK} -o folder",
    f"map {DISK} folder/{DISK} --preview",
    f"map {DISK} {OTHER} --html page.html",
    f"map {DISK} --html page.txt",
    f"map {DISK} --html nowhere/page.html",
    f"map {DISK} --geometry-image samples.tif",
    f"map {DISK} --geometry-image nowhere/samples.npy",
    f"map {DISK} --remesh again.stl",
    f"map {TWO} --html page.html",
    f"map {TWO} -o out.obj --uv disk",
    f"map {DISK} -a direct-cem-holes --cut",
    f"map {DISK} -a cem --overlay",
    f"map {DISK} -a cetm-flips --overlay --cut",
    f"map {DISK} -o out.obj -a cetm-flips --overlay --bake texture.png",
    f"map {DISK} -a cetm-flips --overlay --timeout 9 --memory 4GiB --threads 2",
    f"map {DISK} -a cem --command 'true {{input}} {{output}}'",
    f"map {DISK} --program fit=yes",
    f"cut {DISK} -o cut.stl",
    RUN,
    f"{RUN} --surfaces flat-disk --rounds 7 --precision 5%",
    f"{RUN} --surfaces flat-disk --limit 3",
    f"{RUN} --surfaces flat-disk --same-environment",
    f"{RUN} --surfaces flat-disk --cluster local:1 --pairing process",
    f"{RUN} --surfaces flat-disk --reference cem",
    f"{RUN} --set folder --repair",
    f"{RUN} --mesh-dir empty",
)
OPTION = re.compile(r"(?<![\w-])--?[a-z][\w-]*")
#: Values of options that an error says to add.
VALUES = {
    "--output": ["out.obj"],
    "--mesh-dir": ["folder"],
    "--set": ["folder"],
    "--cluster": ["local:1"],
    "--command": ["true {input} {output}"],
}


def in_options(text):
    """Return a message on one line, with the arguments that it names as options."""
    text = re.sub(r"`(\w+)`", lambda m: f"--{m[1].replace('_', '-')}", " ".join(text.split()))
    text = re.sub(r"\b([a-z_]+)='?([\w.-]*\w)'?", r"--\1 \2", text)
    return text.replace("--memory-bytes", "--memory").replace("--sets", "--set")


def with_options(call, *without, **more):
    """Return a call without some options, and with others: `o` is -o, `mesh_dir` is --mesh-dir."""
    more = {f"-{k}" if len(k) == 1 else f"--{k.replace('_', '-')}": v for k, v in more.items()}
    groups = [[]]
    for word in call:
        groups += [[]] if word.startswith("-") else []
        groups[-1].append(word)
    kept = [word for group in groups if group[0] not in {*without, *more} for word in group]
    return kept + [word for name, values in more.items() for word in (name, *values)]


def added(call, option):
    return [*call, option, *VALUES.get(option, [])]


def one_by_one(call, _):
    meshes = [word for word in call if word.endswith(".obj") and word != "out.obj"]
    return [[w for w in call if w not in meshes or w == mesh] for mesh in meshes]


def each_alone(call, match):
    named = OPTION.findall(match.string)
    return [with_options(call, *{*named} - {one}) for one in named]


def suffix(call, match):
    return [[str(Path(w).with_suffix(match[2])) if w == match[1] else w for w in call]]


def in_a_new_folder(call, match):
    Path(match[1]).mkdir()
    return [call]


def exported_again(call, _):
    shutil.copy(Path("whole") / call[1], call[1])
    return [call]


#: What an error advises, and the calls that follow it to the letter.
ADVICE = (
    (
        r"leave out (--[\w-]+(?:(?:, | and )--[\w-]+)*)(?:, and use (--\w+))?",
        lambda call, m: [with_options(call, *OPTION.findall(m[1])) + [w for w in [m[2]] if w]],
    ),
    (r"leave it out", lambda call, m: [with_options(call, OPTION.findall(m.string)[0])]),
    (r"leave (--[\w-]+) out", lambda call, m: [with_options(call, m[1])]),
    (
        r"(?:needs|is of) (--[\w-]+)(?:: (?:add|name) one| COMMAND)",
        lambda call, m: [added(call, m[1])],
    ),
    (r"(?:add|with) (--output|--overwrite|--repair)", lambda call, m: [added(call, m[1])]),
    (r"choose one|only one of them", each_alone),
    (r"them (?:one by one|one at a time|to different folders)\.", one_by_one),
    (r"(?:use|take) --algorithm ([\w-]+)\.", lambda call, m: [with_options(call, a=[m[1]])]),
    (r"an algorithm for disks", lambda call, m: [with_options(call, a=["direct-cem"])]),
    (r"error: (\S+): (?!unknown).*?(?:the suffix|allowed(?: here)?:|with) (\.\w+)[,.]", suffix),
    (r"there is no folder (\w+)\. Make it first", in_a_new_folder),
    (r"e\.g\. --side (\d+)", lambda call, m: [with_options(call, side=[m[1]])]),
    (r"name a folder with --output", lambda call, m: [with_options(call, o=["folder"])]),
    (r"Name another path", lambda call, m: [with_options(call, o=["another.obj"])]),
    (r"(?:[Ee]xport|download) it again|In MATLAB, save it", exported_again),
    (r"Convert the file to one of these", lambda call, _: [["map", "whole/mine.obj"]]),
    (
        r"not among the algorithms of this run: ([\w-]+)",
        lambda call, m: [with_options(call, reference=[m[1]])],
    ),
    (r"give at least one", lambda call, m: [with_options(call, surfaces=["flat-disk"])]),
    (
        r"or a --profile, (--mesh-dir) or (--set);",
        lambda call, m: [added(call, m[1]), added(call, m[2])],
    ),
    (
        r"name another, or single files",
        lambda call, m: [
            with_options(call, mesh_dir=["folder"]),
            with_options(call, "--mesh-dir", mesh=[DISK]),
        ],
    ),
)


@pytest.fixture
def files(cli):
    """The files that the calls of :data:`CLASHES` name."""
    V, F = gallery.flat_rectangle(4, 5)
    for name in ("folder", "empty"):
        (cli.folder / name).mkdir()
    for name in (DISK, OTHER, f"folder/{DISK}"):
        flat = TriangleMesh.from_arrays(V, F)
        write_mesh(cli.folder / name, flat, V[:, 0] + 1j * V[:, 1])  # with UVs to bake from
    (cli.folder / TWO).write_text(
        gallery.obj_text(np.vstack([V, V + 9]), np.vstack([F, F + len(V)]))
    )
    (cli.folder / "taken").touch()
    imsave(cli.folder / "texture.png", np.zeros((8, 8, 3)))


def walked(cli, call, seen=()):
    """Follow every advice of an error, and of the errors after it; none comes twice on a way."""
    code, _, err = cli(*call)
    if code != 2:
        assert code == 0 or "--command" in call, err  # `true` writes no map
        return
    text = in_options(err)
    assert text not in seen, err
    following = []
    for command in re.findall(r"`cembench ((?:repair|cut) [^`]*)`", text):
        words = shlex.split(command.replace("MESH", DISK))
        before = {*Path().glob("*.obj")}
        assert cli(*words)[0] == 0
        written = {*Path().glob("*.obj")} - before
        assert written
        kept = with_options(call, "--cut")
        following += [[str(f) if word == call[1] else word for word in kept] for f in written]
    for words, follow in ADVICE:
        if match := re.search(words, text):
            following += follow(call, match)
    assert following, err
    for one in following:
        walked(cli, one, (*seen, text))


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("call", CLASHES)
def test_options_that_clash_are_mended_as_the_error_says(cli, call):
    walked(cli, shlex.split(call))


#: Contents of a file instead of what it should hold.
UNREADABLE = {
    "the first half": lambda whole: whole[: len(whole) // 2],
    "all but a tenth": lambda whole: whole[: 9 * len(whole) // 10],
    "nothing": lambda whole: b"",
    "bytes": lambda whole: bytes(range(256)) * 9,
    "text": lambda whole: b"hello world\n" * 9,
    "another format": lambda whole: b"OFF\n3 1 0\n" if whole[:1] != b"O" else b"v 0 0 0\nf 1 2 3\n",
}


def write_any(path, V, F):
    """Write arrays as they are in the format of the suffix."""
    if path.suffix == ".mat":
        savemat(path, {"v": V, "f": F + 1})
    else:
        write_mesh(path, TriangleMesh.trusted(V, F))


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".mat", ".npz"])
def test_a_file_that_cannot_be_read_is_mended_as_the_error_says(cli, suffix):
    V, F = gallery.flat_rectangle(4, 5)
    (cli.folder / "whole").mkdir()
    write_any(cli.folder / "whole" / f"mine{suffix}", V, F)
    write_any(cli.folder / "whole" / "mine.obj", V, F)
    name = cli.folder / f"mine{suffix}"
    for spoiled in UNREADABLE.values():
        name.write_bytes(spoiled((cli.folder / "whole" / name.name).read_bytes()))
        walked(cli, ["map", name.name])
    name.rename(cli.folder / "mine.xyz")
    walked(cli, ["map", "mine.xyz"])
    V[3, 1] = np.nan
    write_any(name, V, F)
    walked(cli, ["map", name.name])
