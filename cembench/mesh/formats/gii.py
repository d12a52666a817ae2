"""Surfaces of brain imaging, read through nibabel: GIFTI (`.gii`) and FreeSurfer geometry."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from cembench.core.errors import MeshError
from cembench.mesh.soup import Soup, damaged, reading_as


def read(path: Path) -> Soup:
    """Read the points and the triangles of a GIFTI file."""
    nibabel: Any = importlib.import_module("nibabel")

    with reading_as("GIFTI"):
        image = nibabel.gifti.GiftiImage.from_bytes(path.read_bytes())
        points = image.get_arrays_from_intent("NIFTI_INTENT_POINTSET")
        triangles = image.get_arrays_from_intent("NIFTI_INTENT_TRIANGLE")
        V, F = ([np.asarray(one.data) for one in arrays] for arrays in (points, triangles))
    if len(V) != 1 or len(F) != 1:
        raise MeshError(
            f"it holds {len(V)} sets of points and {len(F)} of triangles; one of each is needed. "
            "Files of measurements (.func.gii, .shape.gii) hold no surface; name the .surf.gii."
        )
    if V[0].ndim != 2 or V[0].shape[1] != 3 or F[0].ndim != 2 or F[0].shape[1] != 3:
        raise damaged(f"its points have shape {V[0].shape} and its triangles {F[0].shape}")
    return Soup.from_arrays(V[0], F[0], np.full(len(F[0]), 3))


def read_freesurfer(path: Path) -> Soup:
    """Read a geometry file of FreeSurfer, such as `lh.pial`, of triangles or quadrangles."""
    nibabel: Any = importlib.import_module("nibabel")

    with reading_as("FreeSurfer geometry"):
        V, F = nibabel.freesurfer.read_geometry(path)
    return Soup.from_arrays(V, F, np.full(len(F), 3))
