"""Files of each kind that vtk, meshio, trimesh and NiBabel write: read, or refused with a way."""

import json
import re

import numpy as np
import pytest

from cembench.core.errors import MeshError
from cembench.mesh.files import read_soup
from tests import gallery

pytestmark = pytest.mark.process

pyvista = pytest.importorskip("pyvista")
meshio = pytest.importorskip("meshio")
trimesh = pytest.importorskip("trimesh")
nibabel = pytest.importorskip("nibabel")
vtk = pytest.importorskip("vtk")

V, F = gallery.flat_rectangle(4, 5)
V = V + np.array([0, 0, 0.2]) * np.sin(V[:, :1])
STRIP = [10, *(k for i in range(5) for k in (i, i + 6))]
#: A sound file is never called so, and no library's exception is quoted.
BLAMED = re.compile(r"damaged|Error\b|Exception|Traceback|NoneType|object of type")


def surfaces():
    """Data sets of VTK that hold a surface, and their numbers of points and faces."""
    quads = np.column_stack([F[: len(F) // 2], F[len(F) // 2 :, 2]])
    triangles = np.column_stack([np.full(len(F), 3), F]).ravel()
    poly = pyvista.PolyData(V, faces=triangles)
    yield "triangles", poly, (len(V), len(F))
    quad = pyvista.PolyData(V, faces=np.column_stack([np.full(len(quads), 4), quads]).ravel())
    yield "quads", quad, (len(V), len(quads))
    yield "strips", pyvista.PolyData(V, strips=STRIP), (len(V), 8)
    yield "unstructured", poly.cast_to_unstructured_grid(), (len(V), len(F))
    x, y = np.meshgrid(np.arange(4.0), np.arange(5.0), indexing="ij")
    yield "structured", pyvista.StructuredGrid(x, y, x * y), (20, 12)
    yield "pixel", pyvista.examples.cells.Pixel(), (4, 1)


def others():
    """Data sets that hold none."""
    image = pyvista.ImageData(dimensions=(4, 5, 6))
    image["a"] = np.arange(120.0)
    yield "image", image
    yield "rectilinear", pyvista.RectilinearGrid(*(np.arange(3.0),) * 3)
    axes = np.meshgrid(*(np.arange(3.0),) * 3, indexing="ij")
    yield "solid", pyvista.StructuredGrid(*axes)
    yield "tetrahedron", pyvista.examples.cells.Tetrahedron()
    yield "curved", pyvista.examples.cells.QuadraticTriangle()
    yield "blocks", pyvista.MultiBlock([pyvista.Sphere(), image])


def write_by_vtk(path, data, mode="Binary", version=None, compressor=None):
    if path.suffix == ".vtk":
        writer = vtk.vtkGenericDataObjectWriter()
        (writer.SetFileTypeToBinary if mode == "Binary" else writer.SetFileTypeToASCII)()
        if version:
            writer.SetFileVersion(version)
    else:
        writer = vtk.vtkXMLDataSetWriter()
        getattr(writer, f"SetDataModeTo{mode}")()
        writer.SetCompressor(compressor)
    writer.SetInputData(data)
    writer.SetFileName(str(path))
    assert writer.Write()


SUFFIX = {"PolyData": ".vtp", "UnstructuredGrid": ".vtu", "StructuredGrid": ".vts"}
KNOWN = {name: (data, counts) for name, data, counts in surfaces()}


@pytest.mark.parametrize("mode", ["Binary", "Ascii"])
@pytest.mark.parametrize("name", KNOWN)
def test_every_data_set_of_legacy_vtk_that_is_a_surface_is_read(name, mode, tmp_path):
    data, counts = KNOWN[name]
    write_by_vtk(tmp_path / "a.vtk", data, mode)
    soup = read_soup(tmp_path / "a.vtk")
    assert (len(soup.V), len(soup.sizes)) == counts
    triangles = soup.V[soup.triangles]
    area = np.linalg.norm(np.cross(*np.diff(triangles, axis=1).swapaxes(0, 1)), axis=1).sum() / 2
    assert area == pytest.approx(data.extract_surface(algorithm=None).area, rel=0.05)


@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("name", ["triangles", "unstructured"])
def test_both_versions_of_legacy_vtk_are_read(name, version, tmp_path):
    cls = {"triangles": vtk.vtkPolyDataWriter, "unstructured": vtk.vtkUnstructuredGridWriter}[name]
    writer = cls()
    writer.SetFileVersion(version)
    writer.SetInputData(KNOWN[name][0])
    writer.SetFileName(str(tmp_path / "a.vtk"))
    assert writer.Write()
    assert len(read_soup(tmp_path / "a.vtk").sizes) == len(F)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("compressor", [None, vtk.vtkZLibDataCompressor, vtk.vtkLZ4DataCompressor])
@pytest.mark.parametrize("name", ["triangles", "unstructured", "structured"])
def test_every_way_to_write_xml_is_read(name, mode, compressor, tmp_path):
    data, counts = KNOWN[name]
    path = tmp_path / f"a{SUFFIX[type(data).__name__]}"
    write_by_vtk(path, data, mode, compressor=compressor and compressor())
    soup = read_soup(path)
    assert (len(soup.V), len(soup.sizes)) == counts


@pytest.mark.parametrize(("name", "data"), list(others()), ids=[name for name, _ in others()])
@pytest.mark.parametrize("form", ["legacy", "xml"])
def test_what_is_no_surface_is_refused_with_the_way(name, data, form, tmp_path):
    path = tmp_path / "a.vtk"
    if form == "legacy":
        write_by_vtk(path, data)
    else:
        kinds = {"image": ".vti", "rectilinear": ".vtr", "solid": ".vts", "blocks": ".vtm"}
        path = tmp_path / f"a{kinds.get(name, '.vtu')}"
        data.save(path)
    with pytest.raises(MeshError) as no:
        read_soup(path)
    text = str(no.value).removeprefix(str(path))
    assert not BLAMED.search(text)
    assert re.search(r"pyvista\.read\(file\)|straight triangles", text)


def test_a_truncated_legacy_file_is_damaged(tmp_path):
    write_by_vtk(tmp_path / "a.vtk", KNOWN["triangles"][0])
    content = (tmp_path / "a.vtk").read_bytes()
    for share in (0.2, 0.5, 0.8):
        (tmp_path / "b.vtk").write_bytes(content[: int(share * len(content))])
        with pytest.raises(MeshError, match="cut short"):
            read_soup(tmp_path / "b.vtk")


def by_meshio(folder):
    """One file of each format that meshio writes with triangles."""
    cells = [("triangle", F)], [("triangle", F), ("line", np.array([[0, 1]]))]
    for suffix, kinds in meshio.extension_to_filetypes.items():
        for kind in kinds:
            path = folder / f"{kind}{suffix}"
            for some in cells:
                try:
                    meshio.write(path, meshio.Mesh(V, some), file_format=kind)
                except BaseException:
                    path.unlink(missing_ok=True)
                    continue
                yield path
                break


def test_files_of_meshio_are_read_or_refused_as_unknown(tmp_path):
    read = set()
    for path in by_meshio(tmp_path):
        try:
            assert len(read_soup(path).sizes) >= len(F) or path.suffix == ".ply"
            read.add(path.suffix)
        except MeshError as error:
            text = str(error).removeprefix(str(path))
            assert not BLAMED.search(text), text
            assert "allowed: .obj" in text or "Unpack it" in text
    assert read >= {".obj", ".off", ".ply", ".stl", ".vtk", ".vtu", ".msh", ".mesh", ".inp"}


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "ply", "obj", "off", "glb"])
def test_files_of_trimesh_are_read(kind, tmp_path):
    content = trimesh.Trimesh(V, F, process=False).export(file_type=kind)
    path = tmp_path / f"a.{kind.removesuffix('_ascii')}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert len(read_soup(path).sizes) == len(F)


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_point_clouds_are_called_that(suffix, tmp_path):
    cloud = trimesh.PointCloud(V)
    cloud = trimesh.Scene([cloud]) if suffix == ".glb" else cloud
    (tmp_path / f"a{suffix}").write_bytes(cloud.export(file_type=suffix[1:]))
    with pytest.raises(MeshError, match="point cloud") as no:
        read_soup(tmp_path / f"a{suffix}")
    assert not BLAMED.search(str(no.value))


@pytest.mark.parametrize("encoding", [1, 2, 3])
def test_gifti_of_all_encodings_is_read(encoding, tmp_path):
    arrays = [
        nibabel.gifti.GiftiDataArray(data, intent=f"NIFTI_INTENT_{intent}", encoding=encoding)
        for data, intent in ((V.astype("f4"), "POINTSET"), (F.astype("i4"), "TRIANGLE"))
    ]
    nibabel.save(nibabel.gifti.GiftiImage(darrays=arrays), tmp_path / "a.surf.gii")
    assert len(read_soup(tmp_path / "a.surf.gii").sizes) == len(F)


@pytest.mark.parametrize("name", ["lh.pial", "rh.white.T1", "inflated"])
def test_freesurfer_geometry_is_known_by_its_content(name, tmp_path):
    nibabel.freesurfer.write_geometry(tmp_path / name, V, F)
    soup = read_soup(tmp_path / name)
    assert soup.triangles.tolist() == F.tolist()
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[:-40])
    with pytest.raises(MeshError, match="damaged"):
        read_soup(tmp_path / name)


def test_other_files_of_brain_imaging_name_the_surface(tmp_path):
    image = nibabel.Nifti1Image(np.zeros((3, 3, 3)), np.eye(4))
    for name in ("a.nii", "a.nii.gz"):
        nibabel.save(image, tmp_path / name)
    nibabel.save(nibabel.MGHImage(np.zeros((3, 3, 3), "f4"), np.eye(4)), tmp_path / "a.mgz")
    for name in ("a.nii", "a.nii.gz", "a.mgz"):
        with pytest.raises(MeshError, match=r"volume, not a surface.*marching_cubes"):
            read_soup(tmp_path / name)
    nibabel.freesurfer.write_morph_data(tmp_path / "lh.thickness", np.ones(len(V)))
    with pytest.raises(MeshError, match=r"values of vertices.*lh\.pial"):
        read_soup(tmp_path / "lh.thickness")


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl"])
def test_decimal_commas_are_named(suffix, tmp_path):
    mesh = trimesh.Trimesh(V / 3, F, process=False)
    kind = "stl_ascii" if suffix == ".stl" else suffix[1:]
    more = {"encoding": "ascii"} if suffix == ".ply" else {}
    content = mesh.export(file_type=kind, **more)
    text = content.decode() if isinstance(content, bytes) else content
    head, mark, body = text.rpartition("end_header") if suffix == ".ply" else ("", "", text)
    (tmp_path / f"a{suffix}").write_text(head + mark + body.replace(".", ","))
    with pytest.raises(MeshError, match=r"decimal commas.*replace each comma by a point") as no:
        read_soup(tmp_path / f"a{suffix}")
    assert not BLAMED.search(str(no.value))


def test_faces_with_two_corners_are_lines(tmp_path):
    off = f"OFF\n{len(V)} {len(F) + 1} 0\n"
    off += "\n".join(" ".join(map(str, p)) for p in V.tolist())
    off += "\n2 0 1\n" + "\n".join(f"3 {a} {b} {c}" for a, b, c in F.tolist()) + "\n"
    (tmp_path / "a.off").write_text(off)
    soup = read_soup(tmp_path / "a.off")
    assert len(soup.sizes) == len(F)
    assert [str(n) for n in soup.notices] == [
        "1 faces with two corners, which are lines, were ignored"
    ]


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_uvs_of_a_mesh_without_a_material_are_read(tmp_path, suffix):
    """As Blender writes what was only unwrapped; another part of the scene has a material."""
    uv = V[:, :2] / 5
    plain = trimesh.visual.TextureVisuals(uv=uv)
    other = trimesh.visual.TextureVisuals(uv=uv, material=trimesh.visual.material.PBRMaterial())
    scene = trimesh.Scene(
        [
            trimesh.Trimesh(V + np.array([0, 0, 9 * k]), F, visual=one, process=False)
            for k, one in enumerate((plain, other))
        ]
    )
    path = tmp_path / f"a{suffix}"
    if suffix == ".glb":
        content = without_materials(scene.export(file_type="glb"))
        path.write_bytes(content)
    else:
        for name, content in scene.export(file_type="gltf").items():
            (tmp_path / name).write_bytes(content)
        tree = json.loads((tmp_path / "model.gltf").read_text())
        del tree["meshes"][0]["primitives"][0]["material"]
        path.write_text(json.dumps(tree))
    soup = read_soup(path, uv=True)
    assert np.isfinite(soup.uv).all()
    assert len(soup.uv_triangles) == 2 * len(F)


def without_materials(glb):
    """The binary file without the material of its first mesh; its chunks keep their sizes."""
    size = int.from_bytes(glb[12:16], "little")
    tree = json.loads(glb[20 : 20 + size])
    del tree["meshes"][0]["primitives"][0]["material"]
    text = json.dumps(tree, separators=(",", ":")).encode()
    return glb[:20] + text.ljust(size) + glb[20 + size :]
