"""Real meshes, fetched once and checked: four public models, three of them in the paper.

`CEMBENCH_DATA_URL` points to a mirror: a directory that holds the files under their own names.
Downloads are kept in the cache directory (:func:`meshes_gen.cache.cache_directory`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pooch
import requests
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from cembench.errors import DatasetError, MeshError
from cembench.geometry.mesh import DiskMesh
from meshes_gen.cache import cache_directory

#: Overrides where files are fetched from.
VARIABLE = "CEMBENCH_DATA_URL"

_DISK_MAPS = (
    "https://raw.githubusercontent.com/garyptchoi/disk-conformal-map/"
    "9961ed1f7ebc75e481b9b32f77a0af662ca81fe7"
)


@dataclass(frozen=True)
class Dataset:
    """A file that can be fetched.

    `row` is the name of the stand-in whose row of the paper it is; None if it is in no table.
    """

    name: str
    title: str
    file: str
    sha256: str
    row: str | None
    licence: str = "Apache-2.0"
    base_url: str = _DISK_MAPS

    @property
    def url(self) -> str:
        """Where it is fetched from: the mirror if one is set."""
        return f"{(os.environ.get(VARIABLE) or self.base_url).rstrip('/')}/{self.file}"

    @property
    def path(self) -> Path:
        """Where it lies once it has been fetched."""
        return cache_directory() / "datasets" / self.file


DATASETS: Mapping[str, Dataset] = {
    dataset.name: dataset
    for dataset in (
        Dataset(
            "chinese-lion",
            "Chinese Lion",
            "chinese_lion.mat",
            "1a54710cfdfecca95546ca61cd4035e5e02e8b142e81b968c838b5c62957840e",
            "chinese-lion",
        ),
        Dataset(
            "human-brain",
            "Human Brain",
            "human_brain.mat",
            "e6f8c9cd972a465b6affff3233795b208a2a224679c2a9d9c65b2a32b50d43cc",
            "human-brain",
        ),
        Dataset(
            "left-hand",
            "Left Hand",
            "hand.mat",
            "a88112a32b7f9d351c5ecfbd17042253ca79b50ab1a2e86b424e317487935386",
            "left-hand",
        ),
        Dataset(
            "human-face",
            "Human Face",
            "human_face.mat",
            "705421e733d7368ec2aa80daa1ca8751bc0afd0d71fa21157049bbc160a64571",
            None,
        ),
    )
}


def dataset(name: str) -> Dataset:
    """The dataset of this name; :class:`DatasetError` lists the known ones."""
    if name not in DATASETS:
        raise DatasetError(f"unknown dataset {name!r}; known: {', '.join(DATASETS)}.")
    return DATASETS[name]


def is_fetched(name: str) -> bool:
    """Does the file lie in the cache, whole? Nothing is fetched."""
    d = dataset(name)
    return d.path.is_file() and pooch.file_hash(str(d.path)) == d.sha256


def fetch(name: str, *, timeout: float = 60.0) -> Path:
    """Where is this dataset's file? Fetched if it is not in the cache, or not whole there.

    `timeout` in seconds is that of the server's answer, not of the whole download.

    Raises
    ------
    DatasetError
        An unknown name, a server that does not answer, a download that breaks off, a file whose
        checksum is wrong; the message names file and URL.

    """
    d = dataset(name)
    try:
        found = pooch.retrieve(
            d.url,
            known_hash=f"sha256:{d.sha256}",
            fname=d.path.name,
            path=d.path.parent,
            downloader=pooch.HTTPDownloader(timeout=timeout),
        )
    except requests.RequestException as error:
        raise DatasetError(
            f"cannot fetch {d.file} from {d.url}: {type(error).__name__}: {error}. Check the "
            f"network, set {VARIABLE} to a mirror, or put the file at {d.path}."
        ) from error
    except ValueError as error:
        raise DatasetError(
            f"{d.file} from {d.url} is damaged or another file: its SHA-256 is not {d.sha256}. "
            f"Try again, or set {VARIABLE} to another mirror."
        ) from error
    except OSError as error:
        raise DatasetError(
            f"cannot keep {d.file} from {d.url} at {d.path}: {error}. Make the directory writable "
            "or set CEMBENCH_CACHE to another one."
        ) from error
    return Path(found)


def load(name: str, *, timeout: float = 60.0) -> DiskMesh:
    """The real mesh of this name, fetched if need be; errors as :func:`fetch`, and MeshError."""
    return read_mat(fetch(name, timeout=timeout), name=name)


def read_mat(path: Path, *, name: str | None = None) -> DiskMesh:
    """The disk in a MATLAB file with variables v (n, 3) and f (m, 3), counted from 1.

    Raises
    ------
    MeshError
        The file cannot be read, lacks a variable, or holds no disk.

    """
    try:
        content = loadmat(path)
    except (MatReadError, OSError, ValueError, TypeError, NotImplementedError) as error:
        raise MeshError(
            f"{path} cannot be read as a MATLAB file: {error}. Fetch it again, or save it in a "
            "version before 7.3."
        ) from error
    missing = [key for key in ("v", "f") if key not in content]
    if missing:
        present = ", ".join(key for key in content if not key.startswith("__")) or "none"
        raise MeshError(
            f"{path} has no variable {missing[0]!r}; it has: {present}. Needed are v (n, 3), the "
            "vertices, and f (m, 3), the triangles counted from 1."
        )
    F = np.asarray(content["f"]).astype(np.int64) - 1
    return DiskMesh.from_arrays(content["v"], F, name=name or path.stem)
