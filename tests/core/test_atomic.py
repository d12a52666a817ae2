import gc
import os
import stat
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from PIL import Image
from pyarrow import parquet

from cembench.core.atomic import is_draft, write, write_by, write_bytes
from cembench.core.errors import MeshError, RecordError
from tests.limits import files_of_at_most, tree


def test_who_may_read_a_file_is_up_to_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write(tmp_path / "new", lambda file: file.write(b"whole"))
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640


def test_a_file_that_is_replaced_keeps_who_may_read_it(tmp_path):
    private, modes = tmp_path / "private", []
    private.write_bytes(b"older")
    private.chmod(0o600)

    def make(draft):
        modes.append(stat.S_IMODE(draft.stat().st_mode))
        draft.write_bytes(b"newer")

    write_by(private, make)
    write_bytes(private, b"newest")
    assert [*modes, stat.S_IMODE(private.stat().st_mode)] == [0o600, 0o600]
    (tmp_path / "link").symlink_to(private)
    write_bytes(tmp_path / "link", b"of its own")
    assert private.read_bytes() == b"newest"
    assert stat.S_IMODE((tmp_path / "link").stat().st_mode) != 0o600


def test_the_draft_is_closed_before_it_is_deleted(tmp_path):
    """Python 3.13 shows what goes wrong while a file is closed by its deletion."""
    kept = []
    write(tmp_path / "new", kept.append)
    assert kept[0].closed


def test_what_breaks_off_leaves_the_older_file_and_no_draft(tmp_path):
    (tmp_path / "kept").write_bytes(b"older")

    def breaks(file):
        file.write(b"half")
        raise ValueError("half")

    with pytest.raises(ValueError, match="half"):
        write(tmp_path / "kept", breaks)
    assert [p.name for p in tmp_path.iterdir()] == ["kept"]
    assert (tmp_path / "kept").read_bytes() == b"older"


def test_a_place_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match=r"file/new cannot be written"):
        write(tmp_path / "file" / "new", lambda file: file.write(b""))


@pytest.mark.parametrize("size", [0, 100, 5000])
@pytest.mark.parametrize(
    "fill",
    [
        lambda file: file.write(bytes(20_000)),
        lambda file: np.savez(file, a=np.arange(1000.0), b=np.arange(2000)),
        lambda file: np.savez_compressed(file, a=np.random.default_rng(0).random(3000)),
        lambda file: parquet.write_table(pa.table({"a": np.arange(9000.0)}), file),
        lambda file: noise().save(file, "PNG"),
        lambda file: noise().save(file, "GIF", save_all=True, append_images=[noise()] * 3),
        lambda file: swallowing(file),
    ],
)
def test_a_full_disk_leaves_the_older_file_whatever_library_writes(fill, size, tmp_path):
    (tmp_path / "kept").write_bytes(b"older")
    with files_of_at_most(size), pytest.raises(RecordError, match="kept cannot be written"):
        write(tmp_path / "kept", fill)
    gc.collect()  # an archive that is completed only now would complain
    assert tree(tmp_path) == {Path("kept"): b"older"}
    write(tmp_path / "kept", fill)
    assert (tmp_path / "kept").stat().st_size > 5000


def noise():
    pixels = np.random.default_rng(0).integers(0, 256, (100, 100, 3), dtype=np.uint8)
    return Image.fromarray(pixels)


def swallowing(file):
    """A library that drops errors."""
    for _ in range(100):
        with suppress(OSError):
            file.write(bytes(200))


def test_a_library_that_opens_the_file_itself_is_checked(tmp_path):
    (tmp_path / "kept").write_bytes(b"older")

    def check(draft):
        if draft.stat().st_size < 10:
            raise OSError("too short")

    with pytest.raises(MeshError, match="too short"):
        write_by(
            tmp_path / "kept", lambda draft: draft.write_bytes(b"x"), check=check, error=MeshError
        )
    assert tree(tmp_path) == {Path("kept"): b"older"}


def test_a_folder_that_is_missing_is_made_or_refused(tmp_path):
    with pytest.raises(RecordError, match="cannot be written: No such file"):
        write_bytes(tmp_path / "a/b", b"x", parents=False)
    assert not list(tmp_path.iterdir())
    write_bytes(tmp_path / "a/b", b"x")
    assert (tmp_path / "a/b").read_bytes() == b"x"


def test_what_is_not_a_regular_file_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/null")
    for name in ("pipe", "link"):
        with pytest.raises(RecordError, match="it is not a regular file"):
            write_bytes(tmp_path / name, b"x")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_a_link_is_replaced_and_what_it_leads_to_is_left(tmp_path):
    (tmp_path / "thesis").write_bytes(b"mine")
    (tmp_path / "link").symlink_to("thesis")
    write_bytes(tmp_path / "link", b"new")
    assert tree(tmp_path) == {Path("thesis"): b"mine", Path("link"): b"new"}


KILLED = """
import os, sys
from pathlib import Path
from cembench.core.atomic import draft_folder, write
place = Path(sys.argv[1])
def end(file):
    file.write(b"half")
    file.flush()
    os.kill(os.getpid(), 9)
if sys.argv[2] == "file":
    write(place, end)
with draft_folder(place) as folder:
    (folder / "part").write_text("half")
    os.kill(os.getpid(), 9)
"""


@pytest.mark.process
@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_a_kill_left_is_cleared_by_the_next_write_of_the_same_file(what, tmp_path):
    ended = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path / "a"), what], check=False)
    assert ended.returncode == -9
    (left,) = tmp_path.iterdir()
    assert is_draft(left)
    pid = left.name.split("-")[2]
    mine = tmp_path / left.name.replace(f"-{pid}-", f"-{os.getpid()}-")
    mine.touch()  # of a process that runs
    write_bytes(tmp_path / "b", b"another file")
    assert left.exists()
    write_bytes(tmp_path / "a", b"whole")
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b", mine.name}
