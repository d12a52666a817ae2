"""Surfaces in files that can be fetched: once, checked, and kept.

`CEMBENCH_CACHE` says where they are kept. `CEMBENCH_DATA_URL` points to a mirror: a directory that
holds the files under their own names. The libraries that download load when something is fetched:
every process that measures reads this file.

A file is used only while it is what was published: its SHA-256 is the known one, or, where none is
known, the mesh in it is. A file that lies there already is known by its content, whatever it is
called.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Protocol, cast
from urllib.parse import quote

from platformdirs import user_cache_dir

from cembench.core.atomic import is_draft, write, write_bytes
from cembench.core.errors import CembenchError, DatasetError, MeshError, RecordError
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
class Part:
    """How a file of a model is kept: its place, what is kept of it, whether that is whole."""

    path: Callable[[], Path]
    converted: Callable[[Path], bytes]
    is_whole: Callable[[Path], bool]


#: The licence of a dataset whose publisher states none: fetch it for yourself, do not pass it on.
NONE_STATED = "none stated"


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
    group : str
        What it is fetched with: "disks".
    faces : int or None
        Triangles of its mesh, if known.
    arrays : tuple of two str, optional
        The arrays of vertices and triangles, where its file holds several meshes.
    polygons : tuple of two int, optional
        The first and the last polygon of the surface, counted from 0, where its file holds more.
    note : str
        What is to be known of it.
    part : Part, optional
        For a file that is no surface but belongs to a model: what is kept of it.

    """

    name: str
    title: str
    source_url: str
    sha256: str
    licence: str
    size: int | None = None
    paper_row: str = ""
    mesh_hash: str = ""
    group: str = ""
    faces: int | None = None
    arrays: tuple[str, str] | None = None
    polygons: tuple[int, int] | None = None
    note: str = ""
    part: Part | None = None

    @property
    def file(self) -> str:
        """The file's name."""
        return self.source_url.rpartition("/")[2]

    @property
    def url(self) -> str:
        """Where it is fetched from: the mirror if one is set."""
        mirror = os.environ.get(MIRROR_VARIABLE)
        return f"{mirror.rstrip('/')}/{quote(self.file)}" if mirror else self.source_url

    @property
    def path(self) -> Path:
        """Where it lies once it has been fetched."""
        if self.part:
            return self.part.path()
        return cache_directory() / "datasets" / file_name(self.file)

    @property
    def fetch_only(self) -> bool:
        """Whether no licence is stated that would allow to pass it on."""
        return self.licence == NONE_STATED

    @property
    def origin(self) -> str:
        """What declares it, for messages."""
        return self.source_url


def is_fetched(dataset: Dataset) -> bool:
    """Does the file lie in the cache, whole? Nothing is fetched."""
    return dataset.path.is_file() and _is_whole(dataset, dataset.path)


def _is_whole(dataset: Dataset, path: Path) -> bool:
    if dataset.part and path == dataset.path:
        return dataset.part.is_whole(path)
    if dataset.sha256:
        return _sha256(path) == dataset.sha256
    return not dataset.mesh_hash or _hash_of_mesh(dataset, path) == dataset.mesh_hash


def _hash_of_mesh(dataset: Dataset, path: Path) -> str | None:
    from cembench.mesh.files import read_mesh
    from cembench.mesh.triangle_mesh import TriangleMesh

    try:
        return read_mesh(path, TriangleMesh, arrays=dataset.arrays, polygons=dataset.polygons).hash
    except MeshError:
        return None


def fetch(
    dataset: Dataset,
    *,
    timeout: float = 60.0,
    progress: Progress | None = None,
    have: Sequence[Path] = (),
) -> Path:
    """Where is this dataset's file? Fetched if it is not in the cache, or not whole there.

    `timeout` in seconds is that of the server's answer, not of the whole download. A file of the
    same content in the cache or in a folder of `have` is taken, whatever it is called.

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
    try:
        if same := _of_same_content(dataset, have):
            _keep(dataset, lambda file: _copied(same, file))
            return dataset.path
        require(Extra.FETCH, f"fetching {dataset.file} from {dataset.url}")
        _keep(dataset, lambda file: _download(dataset, file, timeout, progress))
    except RecordError as error:
        raise RecordError(
            f"cannot keep {dataset.file} from {dataset.url}: {error} {CACHE_VARIABLE} names the "
            "folder of the cache."
        ) from error
    return dataset.path


def _keep(dataset: Dataset, fill: Callable[[BinaryIO], object]) -> None:
    """Put what `fill` writes to its place once it has been found to be whole."""
    if not dataset.part:
        write(dataset.path, fill, check=lambda draft: _check_whole(dataset, draft))
        return
    with tempfile.NamedTemporaryFile(suffix=Path(dataset.file).suffix) as file:
        fill(cast(BinaryIO, file))
        file.flush()
        published = Path(file.name)
        if dataset.sha256:
            _check_whole(dataset, published)
        write_bytes(dataset.path, dataset.part.converted(published))


def _copied(path: Path, file: BinaryIO) -> None:
    with path.open("rb") as source:
        shutil.copyfileobj(source, file)


def _of_same_content(dataset: Dataset, have: Sequence[Path]) -> Path | None:
    """Return a file with this dataset's content, in the cache's folder or in one of `have`."""
    if not dataset.sha256:
        return None
    for folder in (dataset.path.parent, *have):
        for path in sorted(folder.rglob("*")) if folder.is_dir() else ():
            if _holds(path, dataset):
                return path
    return None


def _holds(path: Path, dataset: Dataset) -> bool:
    """Whether this is a file with the dataset's content; one that cannot be read is not.

    Drafts are left out: another download renames or clears them at any moment.
    """
    if is_draft(path):
        return False
    try:
        if not path.is_file() or (dataset.size and path.stat().st_size != dataset.size):
            return False
        return _sha256(path) == dataset.sha256
    except OSError:
        return False


@dataclass(frozen=True)
class Fetched:
    """How it went with a dataset: its place, or the error."""

    dataset: Dataset
    path: Path | None
    error: CembenchError | None = None


def fetch_all(
    datasets: Iterable[Dataset],
    *,
    jobs: int = 4,
    timeout: float = 60.0,
    have: Sequence[Path] = (),
    progress: Callable[[Dataset], Progress | None] = lambda dataset: None,
) -> Iterator[Fetched]:
    """Fetch several datasets at once, and give each as it ends; an error stops none of the others.

    Datasets of one file fetch it once. What was fetched before an interruption stays, so that
    the same call again goes on from there.

    Raises
    ------
    RecordError
        The cache cannot be written to, or its disk is full: nothing more is begun.

    """
    by_place: dict[Path, list[Dataset]] = {}
    for dataset in datasets:
        by_place.setdefault(dataset.path, []).append(dataset)

    def one(dataset: Dataset) -> Path:
        return fetch(dataset, timeout=timeout, have=have, progress=progress(dataset))

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        waiting = {pool.submit(one, same[0]): same for same in by_place.values()}
        try:
            for done in as_completed(waiting):
                error = done.exception()
                if error is not None and not isinstance(error, DatasetError):
                    raise error
                for dataset in waiting[done]:
                    path = None if error else dataset.path
                    yield Fetched(dataset, path, cast("CembenchError | None", error))
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def surface_file(dataset: Dataset) -> Path:
    """Return the file to read a fetched dataset's surface from.

    It is the fetched file, or an OBJ of the part of it that the dataset is.
    """
    if dataset.arrays is None and dataset.polygons is None:
        return dataset.path
    from cembench.mesh.files import read_mesh, write_mesh
    from cembench.mesh.triangle_mesh import TriangleMesh

    key = dataset.sha256[:16]
    path = dataset.path.parent / "parts" / key / f"{file_name(dataset.name)}.obj"
    mesh = read_mesh(dataset.path, TriangleMesh, arrays=dataset.arrays, polygons=dataset.polygons)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_mesh(path, mesh)
    return path


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


def _check_whole(dataset: Dataset, path: Path) -> None:
    if _is_whole(dataset, path):
        return
    what = f"SHA-256 is not {dataset.sha256}"
    if not dataset.sha256:
        what = f"mesh is not the known one (hash {dataset.mesh_hash})"
    raise DatasetError(
        f"{dataset.file} from {dataset.url} is damaged or another file: its {what}. Try again, "
        f"or set {MIRROR_VARIABLE} to another mirror."
    )


def recognised(datasets: Iterable[Dataset], path: Path, mesh_hash: str) -> Dataset | None:
    """Which dataset is it that was read from this file? Known by its bytes, or by its mesh."""
    checksum = _sha256(path)
    for dataset in datasets:
        whole = dataset.arrays is None and dataset.polygons is None
        if mesh_hash == dataset.mesh_hash or (whole and checksum == dataset.sha256):
            return dataset
    return None


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
