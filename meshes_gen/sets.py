"""Sets of surfaces that have no end: samples of the face model, and Thingi10K."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from cembench.api.surface_collections import Provided, provided
from cembench.core.errors import MeshError, ParameterError
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Registry
from cembench.running.plan import Provenance

#: Registered name of the face model's surface family, and who published the model.
FACE, FACE_SOURCE = "ict-face", "ICT-VGL/ICT-FaceKit"


def ict_faces(registry: Registry, limit: int) -> Iterator[Provided]:
    """Yield faces of the ICT model with random expressions, as disks."""
    return _faces(registry, "disk", limit)


def ict_faces_holes(registry: Registry, limit: int) -> Iterator[Provided]:
    """Yield the same faces with eyes and mouth as holes."""
    return _faces(registry, "face", limit)


def _faces(registry: Registry, part: str, limit: int) -> Iterator[Provided]:
    family = registry.surface(FACE)
    for seed in range(limit):
        arguments = family.arguments({"seed": seed, "expression": "random", "part": part})
        mesh: TriangleMesh = family.function(**arguments)
        name = f"{FACE}-{seed}" if part == "disk" else f"ict-{part}-{seed}"
        about = Provenance(source=FACE_SOURCE, family=FACE)
        yield Provided(name, f"{family.source}; seed {seed}", mesh, licence="MIT", provenance=about)


def thingi10k(registry: Registry, limit: int) -> Iterator[Provided]:
    """Yield models for 3D printing under free licences, closed ones of genus 0 cut open."""
    return surfaces_of_thingi10k(limit=limit)


def surfaces_of_thingi10k(
    *,
    limit: int | None = 100,
    license: str | None = "creative commons|public domain",
    num_facets: tuple[int | None, int | None] = (1_000, 200_000),
    genus: int | None = 0,
    cache_dir: Path | None = None,
    **filters: Any,
) -> Iterator[Provided]:
    """Yield surfaces of Thingi10K, models for 3D printing, through the package `thingi10k`.

    Parameters
    ----------
    limit : int, optional
        Maximum number of models; the package downloads the whole set once in any case.
    license : str, optional
        A regular expression that a model's licence must match; None for any licence.
    num_facets : tuple
        Minimum and maximum number of triangles.
    genus : int, optional
        Genus of closed models, which are cut open; None for all manifolds, also with boundary.
    cache_dir : Path, optional
        Folder in which the package stores the set.
    **filters
        Further filters of `thingi10k.dataset`, such as `category`, `num_boundary_edges`.

    Raises
    ------
    ParameterError
        The package is not installed, or cannot fetch the set.
    """
    try:
        thingi10k = importlib.import_module("thingi10k")
    except ImportError as error:
        raise ParameterError(
            f"the package thingi10k is not installed ({error}); run `pip install thingi10k`."
        ) from None
    wanted = {"license": license, "num_facets": num_facets, "genus": genus, "num_components": 1}
    try:
        thingi10k.init(variant="npz", cache_dir=None if cache_dir is None else str(cache_dir))
        entries = thingi10k.dataset(manifold=True, oriented=True, **(wanted | filters))
    except TypeError:
        raise  # an unknown filter: the caller's mistake, reported by the package
    except Exception as error:  # anything its libraries raise without a network
        raise ParameterError(
            f"thingi10k cannot fetch its models: {type(error).__name__}: {error}. Check the "
            "network, or name a folder that holds them with cache_dir."
        ) from error
    for entry in islice(entries, limit):
        name = f"thingi-{entry['file_id']}"
        place = entry["file_path"]

        def load(place: str = place, name: str = name) -> TriangleMesh:
            try:
                V, F = thingi10k.load_file(place)
            except (OSError, ValueError) as error:
                raise MeshError(f"{place}: {error}") from None
            return TriangleMesh.from_arrays(V, F, name=name)

        yield provided(name, f"Thingi10K {entry['file_id']}", load, str(entry["license"]))
