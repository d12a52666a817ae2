"""Small files that unpack to more than memory holds, in every format that compresses."""

import base64
import json
import struct
import zipfile
import zlib

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from scipy.io import savemat

from cembench.core import loading
from cembench.core.errors import MeshError
from cembench.mesh.files import read_mesh, read_soup, write_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.mesh.uvs import read_uv

pytestmark = pytest.mark.process

#: Bytes that each bomb unpacks to, and that may be free in these tests.
SIZE, FREE = 48 * 2**20, 2**20


@pytest.fixture
def little_memory(monkeypatch):
    """A machine with little free memory, on which a reader that unpacks first is caught."""
    monkeypatch.setattr(loading, "free_memory", lambda: FREE)


def npz_member(shape, content, descr="<f8"):
    head = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    head = head.ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + content


def zipped(path, members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def npz(path, *names):
    zipped(path, {f"{n}.npy": npz_member((SIZE // 24, 3), bytes(SIZE)) for n in names})


@pytest.mark.usefixtures("little_memory")
def test_arrays_that_memory_cannot_hold_are_not_unpacked(tmp_path, monkeypatch):
    path = tmp_path / "bomb.npz"
    npz(path, "v", "f")
    assert path.stat().st_size < SIZE / 50
    unpacked = []
    monkeypatch.setattr(np.lib.format, "read_array", unpacked.append)
    with pytest.raises(MeshError, match=r"bomb.*declares [\d,]+ bytes, more than memory can hold"):
        read_mesh(path)
    npz(path, "uv")
    with pytest.raises(MeshError, match="more than memory can hold"):
        read_uv(path)
    assert not unpacked


@pytest.mark.usefixtures("little_memory")
def test_small_arrays_beside_large_ones_are_read(tmp_path):
    disk = flat_disk(100)
    large = np.zeros((SIZE // 24, 3))
    np.savez_compressed(tmp_path / "a.npz", V=disk.V, F=disk.F, large=large)
    savemat(tmp_path / "a.mat", {"v": disk.V, "f": disk.F + 1, "large": large}, do_compression=True)
    for path, names in (("a.npz", ("V", "F")), ("a.mat", None)):
        assert read_mesh(tmp_path / path, TriangleMesh, arrays=names).hash == disk.hash


def test_a_header_that_is_long_and_sizes_that_are_lies(tmp_path):
    start = b"\x93NUMPY\x02\x00"
    long = start + struct.pack("<I", 2**28) + bytes(2**22)
    zipped(tmp_path / "header.npz", {"v.npy": long, "f.npy": long})
    zipped(tmp_path / "lie.npz", {"v.npy": npz_member((10**12, 3), b""), "f.npy": b""})
    content = bytearray((tmp_path / "lie.npz").read_bytes())
    at = content.rfind(b"PK\x01\x02", 0, content.rfind(b"f.npy"))
    content[at + 24 : at + 28] = struct.pack("<I", 2**32 - 2)  # the size when unpacked
    (tmp_path / "lie2.npz").write_bytes(content)
    for name in ("header.npz", "lie.npz", "lie2.npz"):
        with pytest.raises(MeshError, match="cannot be read as NPZ"):
            read_mesh(tmp_path / name)


def test_memory_that_ends_later_is_an_error_that_says_so(tmp_path, monkeypatch):
    write_mesh(tmp_path / "a.obj", flat_disk(100))

    def ends(*_, **__):
        raise MemoryError

    monkeypatch.setattr(TriangleMesh, "from_arrays", ends)
    with pytest.raises(MeshError, match=r"a\.obj: memory does not suffice"):
        read_mesh(tmp_path / "a.obj", TriangleMesh)


# --- formats that libraries read -------------------------------------------------------------

#: Bytes that these bombs unpack to, and the memory of the process that reads them.
LARGE, ROOM = 2**30, 2**28


@pytest.fixture
def little_room(monkeypatch):
    """Let the process that reads through a library reserve little more than it has."""
    code = (
        "import sys; from cembench.mesh.formats import isolated\n"
        f"isolated.free_memory = lambda: {ROOM}\n"
        "sys.exit(isolated._main(*sys.argv[4:]))"
    )
    from cembench.mesh.formats import isolated

    run = isolated.subprocess.run

    def little(words, **options):
        return run([words[0], "-c", code, *words], **options)

    monkeypatch.setattr(isolated.subprocess, "run", little)


def vtk_block(size):
    """Zeros as VTK packs them, in blocks."""
    block = 2**24
    packed = zlib.compress(bytes(block), 9)
    count = size // block
    head = struct.pack(f"<{3 + count}I", count, block, 0, *[len(packed)] * count)
    return (base64.b64encode(head) + base64.b64encode(packed * count)).decode()


def vtk_xml(path, kind, attributes, cells):
    points = vtk_block(LARGE)
    path.write_text(
        f'<?xml version="1.0"?><VTKFile type="{kind}" version="0.1" byte_order="LittleEndian" '
        f'header_type="UInt32" compressor="vtkZLibDataCompressor"><{kind}><Piece '
        f'NumberOfPoints="{LARGE // 12}" {attributes}><Points><DataArray type="Float32" '
        f'Name="Points" NumberOfComponents="3" format="binary">{points}</DataArray></Points>'
        f"<{cells}></{cells}></Piece></{kind}></VTKFile>"
    )


def vtu(path):
    vtk_xml(path, "UnstructuredGrid", 'NumberOfCells="0"', "Cells")


def vtp(path):
    vtk_xml(path, "PolyData", 'NumberOfPolys="0"', "Polys")


def mat(path, *names):
    zeros = np.broadcast_to(0.0, (LARGE // 24, 3))
    savemat(path, dict.fromkeys(names or ("v", "f"), zeros), do_compression=True)


def gii(path):
    packed = base64.b64encode(zlib.compress(bytes(LARGE), 9)).decode()
    path.write_text(
        '<?xml version="1.0"?><GIFTI Version="1.0" NumberOfDataArrays="1"><DataArray '
        'Intent="NIFTI_INTENT_POINTSET" DataType="NIFTI_TYPE_FLOAT32" '
        'ArrayIndexingOrder="RowMajorOrder" Dimensionality="2" '
        f'Dim0="{LARGE // 16}" Dim1="4" Encoding="GZipBase64Binary" Endian="LittleEndian" '
        f'ExternalFileName="" ExternalFileOffset=""><Data>{packed}</Data></DataArray></GIFTI>'
    )


def gltf(path):
    """A file that declares points and stores none: they are zero."""
    points = {"componentType": 5126, "count": LARGE, "type": "VEC3"}
    path.write_text(
        json.dumps(
            {
                "asset": {"version": "2.0"},
                "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "accessors": [points],
                "bufferViews": [],
            }
        )
    )


@pytest.mark.usefixtures("little_room")
@pytest.mark.parametrize(
    ("make", "module"),
    [(vtu, "meshio"), (vtp, "vtk"), (gii, "nibabel"), (gltf, "trimesh"), (mat, "scipy")],
)
def test_a_library_that_runs_out_of_memory_is_an_error_and_not_the_end(tmp_path, make, module):
    pytest.importorskip(module)
    path = tmp_path / f"bomb.{make.__name__}"
    make(path)
    assert path.stat().st_size < LARGE / 50
    with pytest.raises(MeshError, match="memory"):
        read_soup(path)


@pytest.mark.usefixtures("little_room")
def test_uvs_of_a_matlab_file_that_memory_cannot_hold_are_an_error(tmp_path):
    mat(tmp_path / "a.mat", "uv")
    with pytest.raises(MeshError, match=r"[mM]emory"):
        read_uv(tmp_path / "a.mat")


def test_a_count_that_no_memory_holds_does_not_end_the_process(tmp_path):
    pytest.importorskip("vtk")
    write_mesh(tmp_path / "a.vtp", flat_disk(100))
    text = (tmp_path / "a.vtp").read_bytes()
    n = flat_disk(100).n
    changed = text.replace(b'NumberOfPoints="%d"' % n, b'NumberOfPoints="1000000000000"')
    assert changed != text
    (tmp_path / "a.vtp").write_bytes(changed)
    with pytest.raises(MeshError, match="more than memory can hold"):
        read_soup(tmp_path / "a.vtp")


def test_gifti_names_no_other_file(tmp_path):
    pytest.importorskip("nibabel")
    np.zeros(1000, "f4").tofile(tmp_path / "private.bin")
    gii(tmp_path / "a.gii")
    text = (tmp_path / "a.gii").read_text()
    text = text.replace("GZipBase64Binary", "ExternalFileBinary").replace(
        'ExternalFileName=""', f'ExternalFileName="{tmp_path}/private.bin"'
    )
    (tmp_path / "a.gii").write_text(text)
    with pytest.raises(MeshError, match="cannot be read as GIFTI"):
        read_soup(tmp_path / "a.gii")
