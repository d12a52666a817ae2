"""How the command line ends: pipes, signals, full disks, read-only folders, faults."""

import errno
import os
import resource
import signal
import subprocess
import sys
import time

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.commands.exit_codes import CLOSED_PIPE, FAULT, SYSTEM
from cembench.mesh.files import write_mesh
from tests.file_modes import command_bound_by_modes
from tests.results.test_verify import write_pair

CEMBENCH = [sys.executable, "-m", "cembench.commands.cli"]


def run(command, folder, **options):
    return subprocess.run(
        [*CEMBENCH, *map(str, command)],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | options.pop("env", {}),
        check=False,
        **options,
    )


@pytest.mark.parametrize("verb", [["list", "--verbose"], ["list", "--json"]])
def test_a_closed_pipe_ends_a_verb_quietly(tmp_path, verb):
    reading, writing = os.pipe()
    os.close(reading)  # `head` has gone
    started = subprocess.Popen(
        [*CEMBENCH, *verb], cwd=tmp_path, stdout=writing, stderr=subprocess.PIPE, text=True
    )
    os.close(writing)
    _, err = started.communicate()
    assert (started.returncode, err) == (CLOSED_PIPE, "")


def test_the_first_line_of_a_list_is_there_before_the_pipe_closes(tmp_path):
    command = f"{' '.join(CEMBENCH)} list | head -1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    first, code = done.stdout.splitlines()
    assert first.startswith("algorithm")
    assert code in ("0", str(CLOSED_PIPE))  # 0 where all fitted into the pipe before it closed
    assert done.stderr == ""


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")  # noqa: PTH110
def test_output_that_cannot_be_written_is_told(tmp_path):
    with open("/dev/full", "w", encoding="utf-8") as full:  # noqa: PTH123
        done = subprocess.run(
            [*CEMBENCH, "list", "--json"],
            cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == SYSTEM
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_signal_ends_a_verb_and_nothing_temporary_is_left(tmp_path, name):
    """The solver makes a file when it is called, and then hangs: the file tells when to stop it."""
    write_mesh(tmp_path / "disk.obj", flat_disk(100))
    (tmp_path / "temporary").mkdir()
    called = tmp_path / "called"
    number = signal.Signals[name]
    (tmp_path / "hangs.py").write_text(
        "from cembench import DiskMesh, Parameterization, algorithm\n"
        "@algorithm('hangs', title='Hangs', target='disk')\n"
        "def hangs(mesh: DiskMesh) -> Parameterization:\n"
        f"    open({str(called)!r}, 'w').close()\n"
        "    import time; time.sleep(600)\n"
    )
    command = [*CEMBENCH, "map", "disk.obj", "--plugin", "hangs.py", "-a", "hangs"]
    started = subprocess.Popen(
        command,
        cwd=tmp_path,
        env=os.environ | {"TMPDIR": str(tmp_path / "temporary")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # a shell may have it ignored
    )
    while not called.exists():
        assert started.poll() is None, started.communicate()
        time.sleep(0.02)
    started.send_signal(number)
    _, err = started.communicate()
    assert started.returncode == 128 + number
    assert "Traceback" not in err
    assert list((tmp_path / "temporary").iterdir()) == []


def test_an_ignored_signal_stays_ignored(cli):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert cli("list")[0] == 0
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_fault_of_our_own_is_asked_to_be_reported_with_its_traceback(cli, monkeypatch):
    def broken(plugins=()):
        raise EOFError("in the middle")

    monkeypatch.setattr("cembench.registry.load_registry", broken)
    monkeypatch.setattr("tempfile.tempdir", str(cli.folder))
    code, out, err = cli("list")
    assert (code, out) == (FAULT, "")
    assert "internal error in cembench: EOFError: in the middle" in err
    (kept,) = cli.folder.iterdir()
    assert str(kept) in err
    assert "raise EOFError" in kept.read_text()
    monkeypatch.setenv("CEMBENCH_DEBUG", "1")
    assert "raise EOFError" in cli("list")[2]


def test_a_temporary_folder_that_is_full_is_told(tmp_path):
    write_mesh(tmp_path / "disk.obj", flat_disk(20_000))

    def little():
        """No file may be larger than 64 KiB, as on a disk that is nearly full."""
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (2**16, 2**16))

    done = run(["map", "disk.obj", "-a", "cem", "--timeout", 60], tmp_path, preexec_fn=little)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "temporary folder cannot be used: File too large" in done.stderr
    assert "TMPDIR" in done.stderr


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "No space left on device. Free some space"),
        (errno.ENOENT, "No such file or directory. It, or a folder above it, is gone"),
        (errno.EACCES, "Permission denied. The operating system refused the access."),
    ],
)
def test_what_the_system_says_of_a_file_is_told_as_it_is(cli, monkeypatch, number, words):
    def broken(plugins=()):
        raise OSError(number, os.strerror(number), "run/scratch-1/a.npy")

    monkeypatch.setattr("cembench.registry.load_registry", broken)
    code, _, err = cli("list")
    assert code == SYSTEM
    assert f"'run/scratch-1/a.npy': {words}" in " ".join(err.split())


def test_a_temporary_folder_that_is_not_there_is_told(tmp_path):
    write_mesh(tmp_path / "disk.obj", flat_disk(100))
    script = (
        "import tempfile, sys; tempfile.tempdir = '/nowhere'; sys.argv[0] = 'cembench'\n"
        "from cembench.commands.cli import main; main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, "map", "disk.obj", "--timeout", "60"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "temporary folder" in done.stderr


def test_status_of_a_read_only_run(tmp_path):
    store = write_pair(tmp_path / "run")
    (store.folder / "lock").touch()
    for place in [store.folder, *store.folder.rglob("*")]:
        place.chmod(0o555 if place.is_dir() else 0o444)
    code, out, err = command_bound_by_modes(tmp_path, "status", "run")
    for place in [store.folder, *store.folder.rglob("*")]:
        place.chmod(0o755)
    assert (code, err) == (0, "")
    assert "     2  ok" in out
    assert "the folder is read-only" in out


@pytest.mark.parametrize(
    "verb",
    [
        ["theory", "flat-disk", "--faces", "100", "--run", "run"],
        ["report", "run"],
        ["export", "run"],
        ["run", "--surfaces", "flat-disk", "--faces", "100", "-a", "cem", "-o", "run"],
        ["merge", "run", "-o", "run/all"],
    ],
)
def test_a_folder_that_may_not_be_written_to_is_told(tmp_path, verb):
    store = write_pair(tmp_path / "run")
    for place in [store.folder, *store.folder.rglob("*")]:
        place.chmod(0o555 if place.is_dir() else 0o444)
    code, _, err = command_bound_by_modes(tmp_path, *verb)
    for place in [store.folder, *store.folder.rglob("*")]:
        place.chmod(0o755)
    assert code == 2
    assert "cannot be written" in err
    assert "Permission denied" in err


@pytest.mark.parametrize(
    "verb", [["status", "run"], ["report", "run"], ["show", "disk/cem", "--run", "run"]]
)
@pytest.mark.parametrize("hidden", ["", "records"])
def test_a_folder_that_may_not_be_read_is_told(tmp_path, verb, hidden):
    store = write_pair(tmp_path / "run")
    (store.folder / hidden).chmod(0)
    code, out, err = command_bound_by_modes(tmp_path, *verb)
    (store.folder / hidden).chmod(0o755)
    assert (code, out) == (2, "")
    assert "Permission denied" in err or "not readable" in err


def test_a_mesh_folder_that_may_not_be_read_is_not_called_empty(tmp_path):
    (tmp_path / "meshes").mkdir(mode=0)
    code, _, err = command_bound_by_modes(tmp_path, "run", "--mesh-dir", "meshes", "--dry-run")
    assert code == 2
    assert "not readable" in err


def test_a_fifo_is_neither_missing_nor_waited_for(tmp_path, cli):
    os.mkfifo(cli.folder / "disk.obj")
    for verb in (
        ("map", "disk.obj"),
        ("run", "--mesh", "disk.obj"),
        ("theory", "disk.obj"),
        ("holes", "disk.obj"),
        ("morph", "disk.obj", "disk.obj"),
    ):
        code, _, err = cli(*verb)
        assert code == 2
        assert "disk.obj" in err
