"""OBJ files of plain lines are read and changed in blocks, with the result of the careful way."""

import random
from pathlib import Path

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import MeshError
from cembench.mesh.files import read_soup
from cembench.mesh.formats import obj
from cembench.mesh.soup import Soup
from tests.campaign.mutations import mutate

NUMBERS = (
    *("0", "-0.0", "+1", ".5", "1.", "1e400", "-1e-400", "1e5", "1E+05", "1-2", "e5", "1.2.3"),
    *("0.1", "123456789012345678901234567890", "2.2250738585072014e-308", "nan", "1_0"),
)


def outcome(read):
    try:
        soup = read()
    except MeshError as error:
        return str(error)
    return (soup.V.tobytes(), soup.corners.tolist(), soup.sizes.tolist(), soup.notices)


def plain_file(rng):
    lines = ["# made for a test", "o part one"] * rng.randint(0, 1)
    gap = rng.choice((" ", " ", "\t", "  "))
    n = rng.randint(3, 9)
    for _ in range(n):
        point = [rng.choice((repr(rng.uniform(-9, 9)), rng.choice(NUMBERS[:8]))) for _ in "xyz"]
        lines.append(gap.join(["v", *point]))
    corner = rng.choice(("{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}", "{0}/"))
    for _ in range(rng.randint(1, 6)):
        face = [corner.format(rng.randint(1, n)) for _ in range(rng.randint(3, 5))]
        lines.append(gap.join(["f", *face]) + rng.choice(("", "", " ")))
        lines += rng.choice(([], [], ["g a"], [""], ["usemtl b"], ["v 0 0 1"], ["vn 0 0 1"]))
    ending = rng.choice(("\n", "\r\n"))
    return (ending.join(lines) + rng.choice((ending, ""))).encode()


def both_ways(path, content):
    path.write_bytes(content)
    return outcome(lambda: obj.read(path)), outcome(lambda: obj._read_statements(path, uv=False))


def test_blocks_and_statements_give_the_same_soup_or_error(tmp_path):
    fast = 0
    for number in range(1500):
        rng = random.Random(number)
        content = plain_file(rng)
        if rng.random() < 0.6:
            content, _ = mutate(content, rng)
        if rng.random() < 0.2:
            content = content.replace(b" 1", b" " + rng.choice(NUMBERS).encode(), 1)
        fast += obj._plain_blocks(content) is not None
        one, other = both_ways(tmp_path / "a.obj", content)
        assert one == other, content
    assert fast > 500


@pytest.mark.parametrize("number", NUMBERS)
def test_every_number_is_read_as_python_reads_it(tmp_path, number):
    content = f"v {number} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".encode()
    one, other = both_ways(tmp_path / "a.obj", content)
    assert one == other


def test_texture_coordinates_are_replaced_in_blocks_as_by_statements(monkeypatch):
    texts = []
    for number in range(300):
        content = plain_file(random.Random(number)).decode().replace("vn", "vt")
        texts.append(content.replace("\r\n", "\n"))
    uv = np.arange(40) * (0.1 + 1j)
    fast = [obj.with_uv(text, uv) for text in texts]
    monkeypatch.setattr(obj, "_plain_blocks", lambda content: None)
    assert fast == [obj.with_uv(text, uv) for text in texts]


def test_what_is_written_is_plain(tmp_path):
    mesh = flat_disk(200)
    for uv in (None, mesh.V[:, 0] + 1j * mesh.V[:, 1]):
        content = obj.write(Soup.of_triangles(mesh.V, mesh.F, uv))
        assert obj._plain_blocks(content) is not None
        Path(tmp_path / "a.obj").write_bytes(content)
        assert np.array_equal(read_soup(tmp_path / "a.obj").V, mesh.V)
