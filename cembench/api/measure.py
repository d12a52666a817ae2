"""Measure how good UVs are, whoever made them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from cembench.core.arguments import checked
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cembench.api.measurement import Measurement
    from cembench.running.surfaces import SurfaceInput


@checked
def measure(
    surface: SurfaceInput | ArrayLike,
    *faces_and_uv: ArrayLike,
    against: Literal["best"] | None = None,
    reporter: Reporter = SILENT,
) -> Measurement:
    """Measure how good UVs are: angles, areas, folds, overlaps, texel density, seams, islands.

    Parameters
    ----------
    surface : path, mesh or arrays
        A file with UVs (OBJ, PLY, OFF, GLB, VTP, NPZ, MAT); a mesh of trimesh or PyVista with
        texture coordinates; or V (n, 3), with F (m, 3) and the UVs as the next arguments; or any
        surface, with the UVs as the next argument.
    *faces_and_uv
        F, if `surface` is V; then UVs of the vertices, float (n, 2) or complex (n,), or of the
        corners, float (m, 3, 2) or complex (m, 3). The unit square is the texture.
    against : "best", optional
        Also map the same islands, and the surface without seams, as well as cembench can.
    reporter : Reporter
        Shows progress.

    Returns
    -------
    Measurement
        ``.verdict`` is the answer in a sentence, ``.metrics`` all figures, ``.islands`` those of
        each island, ``.worst`` the worst places.

    Raises
    ------
    MeshError
        The file cannot be read or holds no UVs, or there is not one finite UV for each vertex or
        corner.

    Examples
    --------
    >>> import cembench
    >>> mesh = cembench.surface("flat-disk", 400)
    >>> found = cembench.measure(mesh.V, mesh.F, mesh.V[:, :2] / 4 + 0.5)
    >>> found.metrics["islands"], found.metrics["flipped_triangles"]
    (1, 0)
    >>> round(found.metrics["symmetric_dirichlet"], 9)
    4.0
    """
    from cembench.api.measurement import measured

    return measured(surface, faces_and_uv, reporter, against=against is not None)
