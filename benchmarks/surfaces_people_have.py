"""What cembench answers on small inputs of the kinds that people ask about in public.

Each input is made here: exporters' copies of vertices, soups, pieces, T-junctions, strips, formats
of other programs, objects of a notebook. Each is given to `map` as a user would, or to Python.
"""

from __future__ import annotations

import re
import shlex
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cembench
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.core.atomic import write_bytes, write_text

LAYOUT = """
| input | given to | answer | what it says or does |
|---|---|---|---|
| {input} | {given} | {answer} | {words} |"""

Points = NDArray[np.float64]
Indices = NDArray[np.int64]
Arrays = tuple[Points, Indices]
#: An input: its kind, the suffix of its file, what writes it, and the options of `map`.
Case = tuple[str, str, Callable[[Path], object], str]


def surfaces_people_have() -> Section:
    """Give each kind of input to `map` or to Python, and note the answer."""
    with tempfile.TemporaryDirectory() as name:
        rows = [_of_file(Path(name), k, *case) for k, case in enumerate(progress(list(files())))]
    rows += [_of_object(name, make) for name, make in objects()]
    counts = {row["answer"]: 0 for row in rows}
    for row in rows:
        counts[row["answer"]] += 1
    summary = ", ".join(f"{n} {answer}" for answer, n in counts.items())
    return Section([f"{len(rows)} inputs: {summary}.", Table(rows, LAYOUT)], "docs/repair.md")


def _of_file(
    folder: Path, number: int, kind: str, suffix: str, write: Callable[[Path], object], options: str
) -> dict[str, Any]:
    """Return the row of a file: mapped, or refused with commands, which are tried."""
    path = folder / f"input{number}{suffix}"
    write(path)
    row = {"input": kind, "given": f"`map FILE {options}`".replace(" `", "`")}
    notes: list[str] = []
    words = shlex.split(options)
    keywords: dict[str, Any] = {"repair": "--repair" in words, "cut": "--cut" in words}
    if "-a" in words:
        keywords["algorithm"] = words[words.index("-a") + 1]
    try:
        maps = cembench.map_files(path, **keywords)
        for mapped in maps:
            notes += [str(n) for n in (*mapped.surface.mesh.notices, *mapped.record.outcome.notes)]
            if not mapped.ok:
                words = _short(mapped.record.outcome.cause)
                return {**row, "answer": "no map, way named", "words": words}
        worst = max(m.record.outcome.metrics["angle_error_mean_deg"] for m in maps.done)
        pieces = f"{len(maps)} surfaces, " if len(maps) > 1 else ""
        said = [n for n in notes if not n.startswith("Definition 1")]
        said = [n for n in said if "repaired: " in n or "weld=" in n] or said
        note = f"; {_short(said[-1])}" if said else ""
        return {**row, "answer": "mapped", "words": f"{pieces}{worst:.2f} degrees{note}"}
    except cembench.CembenchError as error:
        text = str(error).replace(str(path), "FILE").replace(path.stem, "FILE")
        return {**row, "answer": _followed(path, error), "words": _short(text)}


def _followed(path: Path, error: cembench.CembenchError) -> str:
    """Return whether the options that an error names lead to a map."""
    options = getattr(error, "options", None)
    if options is None:
        return "refused, cause named"
    problems = {str(p.remedy) for p in getattr(error, "problems", ())}
    meshes = cembench.repair(path, **options).meshes
    if "cut" in problems:
        meshes = tuple(cembench.cut(mesh).mesh for mesh in meshes)  # type: ignore[misc]
    ok = all(cembench.parameterize(mesh, keep_invalid=True).ok for mesh in meshes)
    return "refused, remedy works" if ok else "refused, remedy fails"


def _of_object(name: str, make: Callable[[], object]) -> dict[str, Any]:
    """Return the row of an object of a notebook."""
    row = {"input": name, "given": "`parameterize`"}
    try:
        error = cembench.parameterize(make()).metrics["angle_error_mean_deg"]
    except cembench.MeshError as refused:
        return {**row, "answer": "refused, cause named", "words": _short(str(refused))}
    return {**row, "answer": "mapped", "words": f"{error:.2f} degrees"}


def _short(text: str | None, most: int = 170) -> str:
    """Return a message on one line of a table, the middle left out where it is long."""
    line = re.sub(r"\s+", " ", (text or "").replace("|", "\\|"))
    return line if len(line) <= most else f"{line[: most // 2]} ... {line[-most // 2 :]}"


def hill(rows: int = 12, columns: int = 9) -> Arrays:
    """Return a hilly patch on [0, 1]^2."""
    u, v, F = _grid(rows, columns)
    return np.stack([u, v, 0.3 * np.sin(3 * u) * np.cos(2 * v)], axis=1), F


def _grid(rows: int, columns: int) -> tuple[Points, Points, Indices]:
    i, j = (k.ravel() for k in np.mgrid[0 : rows + 1, 0 : columns + 1])
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b, d = a + columns + 1, a + 1
    F = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, d], 1)])
    return i / rows, j / columns, F


def sphere(rows: int = 16, columns: int = 10) -> Arrays:
    """Return a sphere as exporters write it, with copies of vertices at its seam and poles."""
    u, v, F = _grid(rows, columns)
    east, south = 2 * np.pi * u, np.pi * v
    V = [np.cos(east) * np.sin(south), np.sin(east) * np.sin(south), np.cos(south)]
    return np.stack(V, axis=1), F


def tube(rows: int = 16, columns: int = 6, copies: int = 1) -> Arrays:
    """Return a tube; with copies of the vertices of its seam."""
    u, v, F = _grid(rows, columns)
    V = np.stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 2 * v], axis=1)
    n = rows * (columns + 1)
    return (V, F) if copies else (V[:n], F % n)


def soup(noise: float) -> Arrays:
    """Return triangles without common vertices, whose corners differ by up to `noise`."""
    V, F = hill()
    away = np.random.default_rng(0).uniform(-noise, noise, (F.size, 3))
    return V[F].reshape(-1, 3) + away, np.arange(F.size).reshape(-1, 3)


def pieces(count: int, apart: float = 1.0) -> Arrays:
    """Return patches in a row, a distance apart."""
    V, F = hill(4, 4)
    V[:, 2] = 0.3 * np.cos(2 * V[:, 1])  # so that neighbours meet where they are not apart
    all_V = np.vstack([V + np.array([k * (1 + apart), 0, 0]) for k in range(count)])
    return all_V, np.vstack([F + k * len(V) for k in range(count)])


def bow_tie() -> Arrays:
    """Return two triangles that touch in one vertex."""
    V = np.array([[0.0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]])
    return V, np.array([[0, 2, 1], [0, 3, 4]])


def t_junctions() -> Arrays:
    """Return two flat patches that meet along a line, with 3 and 8 edges there."""
    (u, v, F), (s, t, G) = _grid(4, 3), _grid(4, 8)
    V = np.concatenate([np.stack([u, v, 0 * u], 1), np.stack([1 + s, t, 0 * s], 1)])
    return V, np.concatenate([F, G + len(u)])


def strip(count: int = 30) -> Arrays:
    """Return a bent strip without interior vertices."""
    x = np.linspace(0, 20, count + 1)
    V = np.stack([np.repeat(x, 2), np.tile([0.0, 1.0], count + 1), np.repeat(np.sin(x), 2)], 1)
    a = 2 * np.arange(count)
    return V, np.concatenate([np.stack([a, a + 2, a + 1], 1), np.stack([a + 1, a + 2, a + 3], 1)])


def klein_bottle(rows: int = 24, columns: int = 12) -> Arrays:
    """Return a closed one-sided surface."""
    i, j = (k.ravel() for k in np.mgrid[0:rows, 0:columns])

    def at(i: Indices, j: Indices) -> Indices:
        return (i % rows) * columns + np.where(i >= rows, -j, j) % columns

    a, b, c, d = at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)
    u, v = 2 * np.pi * i / rows, 2 * np.pi * j / columns
    rho = 3 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    V = np.stack([rho * np.cos(u), rho * np.sin(u), z], axis=1)
    return V, np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def text(V: Points, F: Indices) -> str:
    """Return an OBJ file of any triangles."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in V.tolist()]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in (F + 1).tolist())]) + "\n"


def files() -> Iterator[Case]:
    """Yield the inputs that are files."""

    def obj(V: Points, F: Indices) -> Callable[[Path], object]:
        return lambda path: write_text(path, text(V, F))

    V, F = hill()
    yield "sphere of an exporter, seam and poles copied", ".obj", obj(*sphere()), "--repair --cut"
    yield "tube of an exporter, seam copied", ".obj", obj(*tube()), "--repair"
    yield "soup, corners exactly equal", ".obj", obj(*soup(0)), "--repair"
    yield "soup, corners differ by 1e-7", ".obj", obj(*soup(1e-7)), "--repair"
    yield "soup, corners differ by 1e-5", ".obj", obj(*soup(1e-5)), ""
    yield "101 pieces", ".obj", obj(*pieces(101)), ""
    yield "101 pieces", ".obj", obj(*pieces(101)), "--repair"
    yield "two pieces 1e-6 apart", ".obj", obj(*pieces(2, 1e-6)), ""
    yield "T-junctions, 3 edges on 8", ".obj", obj(*t_junctions()), "--repair"
    yield "T-junctions, 3 edges on 8", ".obj", obj(*t_junctions()), ""
    yield "bow-tie", ".obj", obj(*bow_tie()), "--repair"
    stray = np.vstack([[[9, 9, 9]], V])
    yield "stray vertex", ".obj", obj(stray, F + 1), ""
    yield "strip without interior vertices", ".obj", obj(*strip()), ""
    yield "strip without interior vertices", ".obj", obj(*strip()), "-a abf-linear"
    yield "tube without interior vertices", ".obj", obj(*tube(12, 1, copies=0)), ""
    yield "tube without interior vertices", ".obj", obj(*tube(12, 1, copies=0)), "--cut -a lscm"
    yield "Klein bottle", ".obj", obj(*klein_bottle()), ""
    yield "Klein bottle", ".obj", obj(*klein_bottle()), "--repair --cut"
    far = (V + np.array([5e5, 4.5e6, 0])).astype(np.float32).astype(float)
    yield "single precision far from the origin", ".obj", obj(far, F), "--repair"
    earth = V * [0.5, 0.4, 3000] + [7.2, 46.3, 500]
    yield "degrees and metres", ".obj", obj(earth, F), ""
    thin = np.vstack([V, V + np.array([0, 0, 1e-7])]), np.vstack([F, F + len(V)])
    yield "two sheets 1e-7 apart", ".obj", obj(*thin), ""
    yield "decimal commas", ".obj", lambda path: write_text(path, text(V, F).replace(".", ",")), ""
    yield "compressed", ".obj.gz", lambda path: write_bytes(path, b"\x1f\x8b"), ""
    yield "point cloud", ".ply", lambda path: write_text(path, POINTS), ""
    yield "volume", ".nii.gz", lambda path: write_bytes(path, b"\x1f\x8b"), ""
    yield from _of_libraries(V, F)


POINTS = "ply\nformat ascii 1.0\nelement vertex 1\n" + "".join(
    f"property float {axis}\n" for axis in "xyz"
) + "end_header\n0 0 0\n"  # fmt: skip


def _of_libraries(V: Points, F: Indices) -> Iterator[Case]:
    """Yield files that VTK and NiBabel write."""
    import nibabel
    import pyvista

    poly = pyvista.PolyData(V, faces=np.insert(F, 0, 3, axis=1).ravel())
    x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 7), indexing="ij")
    grid = pyvista.StructuredGrid(x, y, 0.2 * np.sin(3 * x) * y)
    image = pyvista.ImageData(dimensions=(4, 5, 6))
    yield "legacy VTK, PolyData", ".vtk", poly.save, ""
    yield "legacy VTK, structured grid", ".vtk", grid.save, ""
    yield "structured grid", ".vts", grid.save, ""
    yield "legacy VTK, image data", ".vtk", image.save, ""
    geometry = nibabel.freesurfer.write_geometry
    yield "FreeSurfer geometry", ".pial", lambda path: geometry(path, V, F), ""


def objects() -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield the objects of a notebook."""
    V, F = hill()
    half = len(F) // 2
    quads = np.column_stack([F[:half], F[half:, 2]])
    z = V[:, 2].reshape(13, 10)
    yield "Open3D mesh", lambda: SimpleNamespace(vertices=V, triangles=F)
    yield "quadrilaterals as F", lambda: (V, quads)
    yield "floating-point F", lambda: (V, F.astype(float))
    yield "floating-point F that counts from 1", lambda: (V, F + 1.0)
    yield "dictionary of loadmat", lambda: {"v": V, "f": F + 1}
    yield "array of heights", lambda: z
    yield "`cembench.terrain(z, x, y)`", lambda: cembench.terrain(z, 0.1, 0.1)
