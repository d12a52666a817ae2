from typing import Any

from cembench.api.benchmark import Run as Run
from cembench.api.benchmark import benchmark as benchmark
from cembench.api.catalogue import Catalogue as Catalogue
from cembench.api.catalogue import catalogue as catalogue
from cembench.api.catalogue import list_algorithms as list_algorithms
from cembench.api.catalogue import list_surfaces as list_surfaces
from cembench.api.catalogue import surface as surface
from cembench.api.compare import VersionsCompared as VersionsCompared
from cembench.api.compare import compare_versions as compare_versions
from cembench.api.cut import cut as cut
from cembench.api.doctor import doctor as doctor
from cembench.api.fetch import PublicSurfaces as PublicSurfaces
from cembench.api.fetch import fetch as fetch
from cembench.api.measure import measure as measure
from cembench.api.measurement import Measurement as Measurement
from cembench.api.merge import MergedRuns as MergedRuns
from cembench.api.merge import merge as merge
from cembench.api.papers import check_paper as check_paper
from cembench.api.parameterize import Result as Result
from cembench.api.parameterize import parameterize as parameterize
from cembench.api.parameterize_many import parameterize_many as parameterize_many
from cembench.api.repair import Repair as Repair
from cembench.api.repair import repair as repair
from cembench.api.reproduce import Reproduction as Reproduction
from cembench.api.reproduce import reproduce as reproduce
from cembench.api.run_status import RunStatus as RunStatus
from cembench.api.terrain import terrain as terrain
from cembench.api.validate import validate as validate
from cembench.core.errors import AlgorithmFailed as AlgorithmFailed
from cembench.core.errors import CembenchError as CembenchError
from cembench.core.errors import DatasetError as DatasetError
from cembench.core.errors import MeshError as MeshError
from cembench.core.errors import NotPositiveDefinite as NotPositiveDefinite
from cembench.core.errors import ParameterError as ParameterError
from cembench.core.errors import RecordError as RecordError
from cembench.core.errors import RegistryError as RegistryError
from cembench.core.errors import RenderError as RenderError
from cembench.core.extras import MissingExtra as MissingExtra
from cembench.core.parameterization import Atlas as Atlas
from cembench.core.parameterization import MapStep as MapStep
from cembench.core.parameterization import Parameterization as Parameterization
from cembench.mesh.files import read_mesh as read_mesh
from cembench.mesh.files import write_mesh as write_mesh
from cembench.mesh.triangle_mesh import DiskMesh as DiskMesh
from cembench.mesh.triangle_mesh import HoledMesh as HoledMesh
from cembench.mesh.triangle_mesh import TriangleMesh as TriangleMesh
from cembench.registry import algorithm as algorithm
from cembench.registry import external_program as external_program
from cembench.registry import surface_family as surface_family
from cembench.running.surfaces import load_surface as load_surface

__version__: str

def __getattr__(name: str) -> Any: ...  # what the entry points of `cembench.verbs` bring
