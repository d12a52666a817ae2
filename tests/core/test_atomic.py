import os
import stat

import pytest

from cembench.core.atomic import write
from cembench.core.errors import RecordError


def test_who_may_read_a_file_is_up_to_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write(tmp_path / "new", lambda file: file.write(b"whole"))
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640


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
