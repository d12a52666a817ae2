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
    from cembench.api.benchmark import Run, benchmark
    from cembench.api.catalogue import (
        Catalogue,
        catalogue,
        list_algorithms,
        list_surfaces,
        surface,
    )
    from cembench.api.cut import cut
    from cembench.api.fetch import PublicSurfaces, fetch
    from cembench.api.map_files import map_files
    from cembench.api.morph_surfaces import morph
    from cembench.api.parameterize import Result, parameterize
    from cembench.api.parameterize_many import parameterize_many
    from cembench.api.repair import Repair, repair
    from cembench.api.reproduce import Reproduction, reproduce
    from cembench.api.submissions import check_submissions, submit
    from cembench.api.terrain import terrain
    from cembench.api.validate import validate
    from cembench.core.errors import (
        AlgorithmFailed,
        CembenchError,
        DatasetError,
        MeshError,
        NotPositiveDefinite,
        ParameterError,
        RecordError,
        RegistryError,
        RenderError,
    )
    from cembench.core.extras import MissingExtra
    from cembench.core.parameterization import Atlas, MapStep, Parameterization
    from cembench.mesh.files import read_mesh, write_mesh
    from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
    from cembench.registry import algorithm, external_program, surface_family
    from cembench.results.bundle import Submission
    from cembench.running.surfaces import load_surface

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
    "cembench.api.morph_surfaces": ("morph",),
    "cembench.api.parameterize": ("Result", "parameterize"),
    "cembench.api.parameterize_many": ("parameterize_many",),
    "cembench.api.repair": ("Repair", "repair"),
    "cembench.api.reproduce": ("Reproduction", "reproduce"),
    "cembench.api.submissions": ("check_submissions", "submit"),
    "cembench.results.bundle": ("Submission",),
    "cembench.api.terrain": ("terrain",),
    "cembench.api.validate": ("validate",),
}
_PLACE_OF = {name: place for place, names in _PLACES.items() for name in names}

__all__ = [
    "AlgorithmFailed",
    "Atlas",
    "Catalogue",
    "CembenchError",
    "DatasetError",
    "DiskMesh",
    "HoledMesh",
    "MapStep",
    "MeshError",
    "MissingExtra",
    "NotPositiveDefinite",
    "ParameterError",
    "Parameterization",
    "PublicSurfaces",
    "RecordError",
    "RegistryError",
    "RenderError",
    "Repair",
    "Reproduction",
    "Result",
    "Run",
    "Submission",
    "TriangleMesh",
    "__version__",
    "algorithm",
    "benchmark",
    "catalogue",
    "check_submissions",
    "cut",
    "external_program",
    "fetch",
    "list_algorithms",
    "list_surfaces",
    "load_surface",
    "map_files",
    "morph",
    "parameterize",
    "parameterize_many",
    "read_mesh",
    "repair",
    "reproduce",
    "submit",
    "surface",
    "surface_family",
    "terrain",
    "validate",
    "write_mesh",
]


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
