"""cembench: benchmarking and reproducibility suite for conformal surface parameterization.

Map a surface and look at the result::

    import cembench

    result = cembench.parameterize("face.obj")
    result.uv, result.metrics, result.save("face_uv.obj")

Names are loaded when they are first used, so that importing the package costs little.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cembench.api.benchmark import Run as Run
    from cembench.api.benchmark import benchmark as benchmark
    from cembench.api.catalogue import Catalogue as Catalogue
    from cembench.api.catalogue import catalogue as catalogue
    from cembench.api.catalogue import list_algorithms as list_algorithms
    from cembench.api.catalogue import list_surfaces as list_surfaces
    from cembench.api.catalogue import surface as surface
    from cembench.api.cut import cut as cut
    from cembench.api.fetch import PublicSurfaces as PublicSurfaces
    from cembench.api.fetch import fetch as fetch
    from cembench.api.map_files import map_files as map_files
    from cembench.api.measure import measure as measure
    from cembench.api.morph_surfaces import morph as morph
    from cembench.api.papers import check_paper as check_paper
    from cembench.api.parameterize import Result as Result
    from cembench.api.parameterize import parameterize as parameterize
    from cembench.api.parameterize_many import parameterize_many as parameterize_many
    from cembench.api.repair import Repair as Repair
    from cembench.api.repair import repair as repair
    from cembench.api.reproduce import Reproduction as Reproduction
    from cembench.api.reproduce import reproduce as reproduce
    from cembench.api.submissions import check_submissions as check_submissions
    from cembench.api.submissions import submit as submit
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
    from cembench.results.bundle import Submission as Submission
    from cembench.running.surfaces import load_surface as load_surface

#: Where each public name lies.
_PLACES = {
    "cembench.core.errors": (
        "AlgorithmFailed",
        "CembenchError",
        "DatasetError",
        "MeshError",
        "NotPositiveDefinite",
        "ParameterError",
        "RecordError",
        "RegistryError",
        "RenderError",
    ),
    "cembench.core.extras": ("MissingExtra",),
    "cembench.core.parameterization": ("Atlas", "MapStep", "Parameterization"),
    "cembench.mesh.files": ("read_mesh", "write_mesh"),
    "cembench.mesh.triangle_mesh": ("DiskMesh", "HoledMesh", "TriangleMesh"),
    "cembench.registry": ("algorithm", "external_program", "surface_family"),
    "cembench.running.surfaces": ("load_surface",),
    "cembench.api.benchmark": ("Run", "benchmark"),
    "cembench.api.catalogue": (
        "Catalogue",
        "catalogue",
        "list_algorithms",
        "list_surfaces",
        "surface",
    ),
    "cembench.api.cut": ("cut",),
    "cembench.api.fetch": ("PublicSurfaces", "fetch"),
    "cembench.api.map_files": ("map_files",),
    "cembench.api.measure": ("measure",),
    "cembench.api.morph_surfaces": ("morph",),
    "cembench.api.parameterize": ("Result", "parameterize"),
    "cembench.api.parameterize_many": ("parameterize_many",),
    "cembench.api.repair": ("Repair", "repair"),
    "cembench.api.reproduce": ("Reproduction", "reproduce"),
    "cembench.api.papers": ("check_paper",),
    "cembench.api.submissions": ("check_submissions", "submit"),
    "cembench.results.bundle": ("Submission",),
    "cembench.api.terrain": ("terrain",),
    "cembench.api.validate": ("validate",),
}
_PLACE_OF = {name: place for place, names in _PLACES.items() for name in names}

__all__ = sorted((*_PLACE_OF, "__version__"))


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from cembench.core.version import installed_version

        return installed_version()
    place = _PLACE_OF.get(name) or _of_papers().get(name)
    if place is None:
        module = sys.modules[__name__]  # by which Python suggests what was meant
        raise AttributeError(f"module 'cembench' has no attribute {name!r}", name=name, obj=module)
    value = getattr(importlib.import_module(place), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_of_papers()})


def _of_papers() -> dict[str, str]:
    """Return the modules of the names that papers bring with their verbs."""
    from importlib.metadata import entry_points

    places = [entry.value for entry in entry_points(group="cembench.verbs")]
    return {name: place for place in places for name in importlib.import_module(place).__all__}
