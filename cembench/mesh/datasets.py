"""Surfaces in files that can be fetched: once, checked, and kept.

`CEMBENCH_CACHE` says where they are kept. `CEMBENCH_DATA_URL` points to a mirror: a directory that
holds the files under their own names. The libraries that download load when something is fetched:
every process that measures reads this file.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Protocol

from platformdirs import user_cache_dir

from cembench.core.atomic import write
from cembench.core.errors import DatasetError, RecordError
from cembench.core.extras import Extra, require
from cembench.core.names import file_name

#: Overrides the directory of the cache.
CACHE_VARIABLE = "CEMBENCH_CACHE"
#: Overrides where files are fetched from.
MIRROR_VARIABLE = "CEMBENCH_DATA_URL"


def cache_directory() -> Path:
    """Where are surfaces and downloads kept? `CEMBENCH_CACHE`, or the user's cache directory."""
    return Path(os.environ.get(CACHE_VARIABLE) or user_cache_dir("cembench"))


class Progress(Protocol):
    """What is told how a download gets on, in bytes."""

    total: int

    def update(self, count: int) -> None:
        """So many more have arrived."""

    def reset(self) -> None:
        """None have arrived."""

    def close(self) -> None:
        """It has ended."""


@dataclass(frozen=True)
class Dataset:
    """A mesh file that can be fetched: pure data, offered as an entry point.

    Parameters
    ----------
    name, title : str
        What the command line calls it, and what people do.
    source_url : str
        Where it was published, ending with the file's name.
    sha256 : str
        Of the file.
    licence : str
        SPDX identifier.
    size : int or None
        Bytes, if known.
    paper_row : str
        The model of the paper's Table 1 that it is, if any.
    mesh_hash : str
        Hash of the mesh in it, by which the same surface in another file is recognised; "" if not
        known.

    """

    name: str
    title: str
    source_url: str
    sha256: str
    licence: str
    size: int | None = None
    paper_row: str = ""
    mesh_hash: str = ""

    @property
    def file(self) -> str:
        """The file's name."""
        return self.source_url.rpartition("/")[2]

    @property
    def url(self) -> str:
        """Where it is fetched from: the mirror if one is set."""
        mirror = os.environ.get(MIRROR_VARIABLE)
        return f"{mirror.rstrip('/')}/{self.file}" if mirror else self.source_url

    @property
    def path(self) -> Path:
        """Where it lies once it has been fetched."""
        return cache_directory() / "datasets" / file_name(self.file)

    @property
    def origin(self) -> str:
        """What declares it, for messages."""
        return self.source_url


def is_fetched(dataset: Dataset) -> bool:
    """Does the file lie in the cache, whole? Nothing is fetched."""
    return dataset.path.is_file() and _sha256(dataset.path) == dataset.sha256


def fetch(dataset: Dataset, *, timeout: float = 60.0, progress: Progress | None = None) -> Path:
    """Where is this dataset's file? Fetched if it is not in the cache, or not whole there.

    `timeout` in seconds is that of the server's answer, not of the whole download.

    Raises
    ------
    DatasetError
        A server that does not answer, a download that breaks off, a file whose checksum is wrong;
        the message names file and URL.
    MissingExtra
        The libraries that download are not installed.
    RecordError
        The cache cannot be written to, or its disk is full.

    """
    if is_fetched(dataset):
        return dataset.path
    require(Extra.FETCH, f"fetching {dataset.file} from {dataset.url}")
    try:
        write(
            dataset.path,
            lambda file: _download(dataset, file, timeout, progress),
            check=lambda draft: _check_sum(dataset, draft),
        )
    except RecordError as error:
        raise RecordError(
            f"cannot keep {dataset.file} from {dataset.url}: {error} {CACHE_VARIABLE} names the "
            "folder of the cache."
        ) from error
    return dataset.path


def _download(dataset: Dataset, file: BinaryIO, timeout: float, progress: Progress | None) -> None:
    import pooch
    import requests

    download = pooch.HTTPDownloader(timeout=timeout, progressbar=progress or False)
    try:
        download(dataset.url, file, None)
    except requests.RequestException as error:
        raise DatasetError(
            f"cannot fetch {dataset.file} from {dataset.url}: {type(error).__name__}: {error}. "
            f"Check the network, set {MIRROR_VARIABLE} to a mirror, or put the file at "
            f"{dataset.path}."
        ) from error


def _check_sum(dataset: Dataset, path: Path) -> None:
    if _sha256(path) != dataset.sha256:
        raise DatasetError(
            f"{dataset.file} from {dataset.url} is damaged or another file: its SHA-256 is not "
            f"{dataset.sha256}. Try again, or set {MIRROR_VARIABLE} to another mirror."
        )


def recognised(datasets: Iterable[Dataset], path: Path, mesh_hash: str) -> Dataset | None:
    """Which dataset is it that was read from this file? Known by its bytes, or by its mesh."""
    checksum = _sha256(path)
    for dataset in datasets:
        if mesh_hash == dataset.mesh_hash or checksum == dataset.sha256:
            return dataset
    return None


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
