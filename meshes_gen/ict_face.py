"""Faces of the ICT face model, in any number and in exact correspondence."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import scipy
from pydantic import Field

from cembench.core.arrays import Indices, Real
from cembench.core.errors import ParameterError
from cembench.core.extras import Extra, require
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import surface_family

from .ict_model import EXPRESSIONS, IDENTITIES, FaceModel, load_model

Part = Literal["face", "narrow", "head", "disk"]

#: Number of available expressions that a random expression mixes.
MIXED = 3


@dataclass(frozen=True)
class Extent:
    """The number of the model's first polygons and vertices that form a part, and its mesh type."""

    polygons: int
    vertices: int
    triangles: int
    kind: type[TriangleMesh]


#: The first three have holes at the eyes and the mouth; the disk has sockets instead.
PARTS: Mapping[str, Extent] = {
    "narrow": Extent(6_560, 6_706, 13_120, HoledMesh),
    "face": Extent(9_230, 9_409, 18_460, HoledMesh),
    "head": Extent(11_144, 11_248, 22_288, HoledMesh),
    "disk": Extent(14_034, 14_062, 28_068, DiskMesh),
}
#: Twenty of the model's 68 landmarks, most important first; they are vertices of every part.
LANDMARKS: Mapping[str, int] = {
    "nose_tip": 4_857,
    "eye_outer_right": 1_507,
    "eye_outer_left": 3_721,
    "mouth_corner_right": 5_708,
    "mouth_corner_left": 6_213,
    "chin": 966,
    "eye_inner_right": 1_528,
    "eye_inner_left": 3_742,
    "nose_bridge": 978,
    "nose_base": 1_147,
    "brow_outer_right": 268,
    "brow_inner_right": 1_401,
    "brow_inner_left": 3_615,
    "brow_outer_left": 2_509,
    "upper_lip": 0,
    "lower_lip": 5_518,
    "jaw_right": 1_719,
    "jaw_left": 3_924,
    "nostril_right": 1_140,
    "nostril_left": 3_360,
}


@dataclass(frozen=True)
class Triangulation:
    """The triangles of a part, the same for all samples.

    Parameters
    ----------
    kept : int64 (n,)
        The model's vertex that each vertex is.
    F : int64 (m, 3)
        Triangles.
    """

    kept: Indices
    F: Indices


def landmarks(mesh: TriangleMesh) -> dict[str, int]:
    """Return the vertex of each landmark on a sample of any part and size.

    On a decimated sample it is the vertex that is nearest on the neutral face.
    """
    if (mesh.n, mesh.m) in [(one.vertices, one.triangles) for one in PARTS.values()]:
        return dict(LANDMARKS)
    for name in PARTS:
        made = triangulation(name, mesh.m)
        if np.array_equal(made.F, mesh.F):
            return landmarks_of(made)
    raise ParameterError(f"{mesh.name} has no landmarks: it is not a sample of the ICT face model.")


def landmarks_of(made: Triangulation) -> dict[str, int]:
    """Return the vertex of each landmark in a triangulation."""
    V = load_model().V
    at = V[made.kept]
    return {
        name: int(np.argmin(((at - V[vertex]) ** 2).sum(axis=1)))
        for name, vertex in LANDMARKS.items()
    }


@surface_family(
    "ict-face",
    title="ICT face",
    source="Li et al., CVPR 2020; github.com/ICT-VGL/ICT-FaceKit, MIT",
    landmarks=landmarks,
)
def ict_face(
    faces: Annotated[int, Field(ge=2_000)] = 28_068,
    *,
    seed: Annotated[int, Field(ge=0)] = 0,
    expression: str = "neutral",
    part: Part = "disk",
) -> TriangleMesh:
    """A face of a statistical model of scanned people; each seed gives another face.

    Every sample of a part has the same triangles, and a vertex is the same anatomical point on all
    of them. `part` "disk" is the head with eye and mouth sockets and one boundary at the neck
    (28,068 triangles); "head", "face" and "narrow" end at the eyes and the mouth, with three holes
    (22,288, 18,460 and 13,120). A smaller `faces` decimates the neutral face (with pymeshlab) and
    takes the remaining vertices from the sample; these correspond too, even between different
    values of `faces`.

    The identity's coefficients are independent standard normal numbers, as the model prescribes;
    the k-th belongs to identity k, even if others are missing. `expression` is "neutral", "random"
    (three of the available expressions, with weights between 0 and 1), or published names with
    weights: "jawOpen", "mouthSmile" for both sides, "mouthSmile_L:0.5+jawOpen:0.3".

    The model's files are fetched once (``cembench fetch --group ict-face``), or are in the folder
    `CEMBENCH_ICT_FACE`. If some of the modes are missing, the faces vary less.
    """
    extent, model = PARTS[part], load_model()
    made = triangulation(part, faces)
    V = sample(model, seed, expression)[made.kept]
    name = "ict-face" + (f"-{seed}" if seed else "")
    name += "" if expression == "neutral" else f"-{expression}"
    return extent.kind.from_arrays(V, made.F, name=name)


def sample(model: FaceModel, seed: int, expression: str = "neutral") -> Real:
    """Return the model's vertices (14062, 3) for a seed and an expression.

    Raises
    ------
    ParameterError
        The expression is unknown or not available, or a weight is not between 0 and 1.
    """
    coefficients = np.random.default_rng([seed, 0]).standard_normal(len(IDENTITIES))
    V = model.V.copy()
    for name, c in zip(IDENTITIES, coefficients, strict=True):
        if name in model.identities:
            V += c * model.identities[name]
    for name, weight in expression_weights(model, expression, seed).items():
        V += weight * model.expressions[name]
    return V


def expression_weights(model: FaceModel, expression: str, seed: int = 0) -> dict[str, float]:
    """Return the weight of each published expression in an expression as users write it.

    Raises
    ------
    ParameterError
        The expression is unknown or not available, or a weight is not between 0 and 1.
    """
    if expression == "neutral":
        return {}
    if expression == "random":
        rng = np.random.default_rng([seed, 1])
        order, weights = rng.permutation(len(EXPRESSIONS)), rng.random(len(EXPRESSIONS))
        there = [k for k in order.tolist() if EXPRESSIONS[k] in model.expressions]
        return {EXPRESSIONS[k]: float(weights[k]) for k in there[:MIXED]}
    by_name: dict[str, float] = {}
    for term in expression.split("+"):
        name, _, value = term.strip().partition(":")
        weight = _weight(value, expression) if value else 1.0
        sides = [one for one in (name, f"{name}_L", f"{name}_R") if one in model.expressions]
        if not sides:
            known = name in EXPRESSIONS or f"{name}_L" in EXPRESSIONS
            why = "is not among the available files" if known else "is unknown"
            raise ParameterError(
                f"ict-face: expression {name!r} {why}; available are: neutral, random"
                f"{''.join(f', {one}' for one in sorted(model.expressions))}."
            )
        by_name |= dict.fromkeys(sides, weight)
    return by_name


def _weight(value: str, expression: str) -> float:
    """Return a weight between 0 and 1 from text."""
    try:
        weight = float(value)
    except ValueError:
        weight = -1.0
    if not 0 <= weight <= 1:
        raise ParameterError(
            f"ict-face: expression={expression!r}: the weight {value!r} is not a number from 0 to "
            "1, as in jawOpen:0.5+mouthSmile:0.3."
        )
    return weight


@functools.lru_cache(maxsize=16)
def triangulation(part: str, faces: int) -> Triangulation:
    """Return the triangles of a part, decimated to about `faces` if it has more.

    Edges of the neutral face are collapsed to one of their ends (quadric error metric), so the
    remaining vertices are vertices of the model.

    Raises
    ------
    MissingExtra
        pymeshlab, which decimates, is not installed.
    """
    extent, model = PARTS[part], load_model()
    sizes = model.sizes[: extent.polygons]
    soup = Soup(model.V[: extent.vertices], model.corners[: sizes.sum()], sizes)
    F = soup.triangles
    if faces >= len(F):
        return Triangulation(np.arange(extent.vertices), F)
    return Triangulation(*_decimated(soup.V, F, faces))


def _decimated(V: Real, F: Indices, faces: int) -> tuple[Indices, Indices]:
    """Collapse edges to one of their ends; return the remaining vertices and the triangles."""
    require(Extra.STANDINS, "an ICT face of fewer triangles", "pymeshlab")
    import pymeshlab  # slow to import

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(V, F))
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=faces,
        optimalplacement=False,  # the remaining vertices are vertices of the model
        preserveboundary=True,
        preservenormal=True,
        preservetopology=True,
    )
    made = meshes.current_mesh()
    made.compact()
    apart, nearest = scipy.spatial.KDTree(V).query(made.vertex_matrix())
    assert apart.max() == 0, "a vertex of the decimated face is not a vertex of the model"
    return nearest.astype(np.int64), made.face_matrix().astype(np.int64)
