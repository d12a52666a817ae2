"""cembench: benchmarking and reproducibility suite for conformal surface parameterization."""

from importlib.metadata import version

from cembench.core.errors import (
    AlgorithmFailed,
    CembenchError,
    MeshError,
    ParameterError,
    RegistryError,
)
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import algorithm, surface

__version__ = version("cembench")

__all__ = [
    "AlgorithmFailed",
    "CembenchError",
    "DiskMesh",
    "HoledMesh",
    "MeshError",
    "ParameterError",
    "Parameterization",
    "RegistryError",
    "TriangleMesh",
    "__version__",
    "algorithm",
    "surface",
]
