import os
import pickle
import zipfile

import numpy as np
import pytest
from pydantic import TypeAdapter

from cembench.core.errors import RecordError
from cembench.core.loading import files_in, is_there, read_arrays, read_bytes, read_json
from tests.file_modes import bound_by_modes


def bomb(path, shape="(1000000000000,)", content=b"\0" * 1000):
    """An archive whose header declares terabytes."""
    header = f"{{'descr': '<c16', 'fortran_order': False, 'shape': {shape}, }}".encode()
    header = header.ljust(117, b" ") + b"\n"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        data = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + content
        archive.writestr("uv.npy", data)


def test_arrays_are_read_as_they_were_written(tmp_path):
    written = {"uv": np.arange(3) * 1j, "name": np.array("disk")}
    np.savez_compressed(tmp_path / "a.npz", **written)
    read = read_arrays(tmp_path / "a.npz", written)
    assert all(np.array_equal(read[name], written[name]) for name in written)


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda p: p.write_bytes(b""), "not a zip file"),
        (lambda p: p.write_bytes(b"PK\x03\x04"), "not a zip file"),
        (lambda p: np.savez(p, other=[1]), "uv.npy"),
        (lambda p: np.savez(p, uv=np.array([{"a": 1}], dtype=object)), "pickled"),
        (lambda p: p.write_bytes(pickle.dumps(print)), "not a zip file"),
        (bomb, "declares 16,000,000,000,000 bytes"),
        (lambda p: bomb(p, "(-5,)"), "declares"),
        (lambda p: p.mkdir(), "not a regular file"),
        (os.mkfifo, "not a regular file"),
        (lambda p: None, "No such file"),
    ],
)
def test_what_is_no_archive_of_arrays_is_an_error_that_names_it(tmp_path, make, why):
    path = tmp_path / "a.npz"
    make(path)
    with pytest.raises(RecordError, match=r"a\.npz") as refused:
        read_arrays(path, ["uv"])
    assert why in str(refused.value)


def test_an_array_that_memory_cannot_take_is_not_read(tmp_path, monkeypatch):
    class Little:
        available = 100

    np.savez_compressed(tmp_path / "a.npz", uv=np.zeros(1000, dtype=complex))
    monkeypatch.setattr("cembench.core.loading.psutil.virtual_memory", lambda: Little)
    with pytest.raises(RecordError, match="more than memory can hold"):
        read_arrays(tmp_path / "a.npz", ["uv"])


def test_a_cut_archive_is_damaged_wherever_it_is_cut(tmp_path):
    path = tmp_path / "a.npz"
    np.savez_compressed(path, uv=np.exp(1j * np.arange(50)))
    content = path.read_bytes()
    for length in range(0, len(content), 13):
        path.write_bytes(content[:length])
        with pytest.raises(RecordError, match=r"a\.npz"):
            read_arrays(path, ["uv"])


@pytest.mark.parametrize("text", ["", "{", "[1]", '"x"', "\xff", "[" * 10_000])
def test_json_of_another_kind_is_an_error_that_says_what_it_should_be(tmp_path, text):
    (tmp_path / "a.json").write_text(text, encoding="latin-1")
    with pytest.raises(RecordError, match=r"a\.json is not an environment: "):
        read_json(tmp_path / "a.json", TypeAdapter(dict[str, int]), "an environment")


def test_names_that_no_file_can_have(tmp_path):
    for name in ("a\0b", "x" * 5000):
        for look in (read_bytes, is_there):
            with pytest.raises(RecordError, match="cannot be read"):
                look(tmp_path / name)
    assert not is_there(tmp_path / "none")
    assert files_in(tmp_path / "none", "*") == []


@pytest.mark.process
def test_what_may_not_be_read_is_not_taken_for_empty(tmp_path):
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    (hidden / "a.json").write_text("{}")
    hidden.chmod(0)
    script = (
        "from pathlib import Path; from cembench.core.errors import RecordError\n"
        "from cembench.core.loading import *\n"
        "for look in (lambda p: files_in(p, '*'), lambda p: is_there(p / 'a.json'),\n"
        "             lambda p: read_bytes(p / 'a.json')):\n"
        "    try: look(Path('hidden')); print('read')\n"
        "    except RecordError as error: print(error)\n"
    )
    code, out, err = bound_by_modes(tmp_path, lambda: exec(script))
    hidden.chmod(0o755)
    assert code == 0, err
    assert out.count("Permission denied") == 3
