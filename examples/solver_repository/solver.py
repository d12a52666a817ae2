"""A solver: the boundary by arc length, the interior harmonic."""

from cembench import DiskMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian


@algorithm("ours", title="Ours", target="disk", conformal=False)
def ours(mesh: DiskMesh) -> Parameterization:
    """Map the boundary by arc length and the interior harmonically."""
    return Parameterization(
        harmonic_extension(laplacian(mesh), mesh.boundary, arc_length_circle(mesh))
    )
