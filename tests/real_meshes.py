"""Where the real meshes lie that some tests read when they are there; users do not have them."""

import os
from pathlib import Path

import pytest

FOLDER = Path(
    os.environ.get("CEMBENCH_TEST_MESHES", Path(__file__).parents[1] / "../shared/meshes")
).resolve()

#: A folder with the meshes of the set "corpus", as its MANIFEST.tsv lists them.
CORPUS = Path(
    os.environ.get("CEMBENCH_CORPUS", Path(__file__).parents[1] / "../shared/corpus")
).resolve()

DISKS = (
    "canonical_face.obj",
    "chinese_lion.obj",
    "demosthenes.off",
    "hand_lowres.obj",
    "human_face.obj",
    "jacksboro_dem.ply",
    "max_planck_head.ply",
    "mountain.ply",
    "spothead.obj",
    "turtle.obj",
)


def real_mesh(name: str) -> Path:
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(f"NOT CHECKED: the real mesh {name} is not there; set CEMBENCH_TEST_MESHES")
    return path
