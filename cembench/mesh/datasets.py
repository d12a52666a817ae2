"""Surfaces in files that are downloaded once, verified and kept.

`CEMBENCH_CACHE` names the folder in which they are kept. `CEMBENCH_DATA_URL` names a mirror: a copy
of that folder's `datasets`, with each file under the name of its dataset. The download libraries
are imported only when something is fetched, since every measuring process imports this module.

A file is used only if it is the published one: its SHA-256 matches or, if none is known, the mesh
in it does. A file that is already in the folder is recognised by its content, whatever its name.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path, PurePosixPath
from threading import Event
from time import monotonic
from typing import BinaryIO, cast
from urllib.parse import quote

from platformdirs import user_cache_dir

from cembench.core.atomic import is_draft, write, write_bytes
from cembench.core.errors import CembenchError, DatasetError, MeshError, RecordError
from cembench.core.extras import Extra, require
from cembench.core.loading import sha256_of
from cembench.core.names import file_name
from cembench.mesh.download import LARGEST, Bounds, DownloadError, Progress, download

#: Environment variable for the cache folder.
CACHE_VARIABLE = "CEMBENCH_CACHE"
#: Environment variable for the download mirror.
MIRROR_VARIABLE = "CEMBENCH_DATA_URL"


def cache_directory() -> Path:
    """Return the folder of surfaces and downloads: `CEMBENCH_CACHE`, or the user's cache."""
    return Path(os.environ.get(CACHE_VARIABLE) or user_cache_dir("cembench"))


@dataclass(frozen=True)
class Part:
    """How to keep a file of a model: its path, the part that is kept, and a completeness check."""

    path: Callable[[], Path]
    converted: Callable[[Path], bytes]
    is_whole: Callable[[Path], bool]


#: Licence of a dataset whose publisher states none: it may be fetched, but not redistributed.
NONE_STATED = "none stated"


@dataclass(frozen=True)
class Dataset:
    """A mesh file that can be fetched: plain data, declared by an entry point.

    Parameters
    ----------
    name, title : str
        Name on the command line, and in tables.
    source_url : str
        Where the file was published; ends with the file name.
    sha256 : str
        Checksum of the file.
    licence : str
        SPDX identifier.
    size : int or None
        Bytes, if known; no more are read.
    paper_row : str
        The model of a paper that the mesh is, if any.
    mesh_hash : str
        Hash of the mesh, by which it is recognised in other files; "" if unknown.
    group : str
        Name of the group it is fetched with, e.g. "disks".
    faces : int or None
        Number of triangles, if known.
    arrays : tuple of two str, optional
        Names of the vertex and triangle arrays, if the file holds several meshes.
    polygons : tuple of two int, optional
        First and last polygon of the surface, counted from 0, if the file holds more.
    note : str
        A remark for the user.
    source : str
        Who published it: a repository, owner/name.
    family : str
        The object that it shows; "" for one that no other dataset shows.
    part : Part, optional
        For a file that is part of a model and not a surface: what is kept of it.
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
    source: str = ""
    family: str = ""
    part: Part | None = None

    @property
    def file(self) -> str:
        """The name of the file here and on a mirror: the dataset's, with the published suffix."""
        return self.name + PurePosixPath(self.source_url).suffix

    @property
    def url(self) -> str:
        """The URL to fetch it from; on the mirror, if one is set."""
        mirror = os.environ.get(MIRROR_VARIABLE)
        return f"{mirror.rstrip('/')}/{quote(self.file)}" if mirror else self.source_url

    @property
    def path(self) -> Path:
        """The path of the file once it is fetched."""
        if self.part:
            return self.part.path()
        return cache_directory() / "datasets" / file_name(self.file)

    @property
    def fetch_only(self) -> bool:
        """Whether no stated licence permits redistribution."""
        return self.licence == NONE_STATED

    @property
    def origin(self) -> str:
        """The declaring package, for messages."""
        return self.source_url


def is_fetched(dataset: Dataset) -> bool:
    """Whether the complete file is in the cache; nothing is fetched."""
    return dataset.path.is_file() and _is_whole(dataset, dataset.path)


def _is_whole(dataset: Dataset, path: Path) -> bool:
    """Whether the file at a path is the dataset's, by its checksum or by its mesh."""
    if dataset.part and path == dataset.path:
        return dataset.part.is_whole(path)
    if dataset.sha256:
        return sha256_of(path) == dataset.sha256
    return not dataset.mesh_hash or _hash_of_mesh(dataset, path) == dataset.mesh_hash


def _hash_of_mesh(dataset: Dataset, path: Path) -> str | None:
    """Return the hash of the mesh in a file; None if it holds no valid mesh."""
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
    seconds: float = inf,
    progress: Progress | None = None,
    have: Sequence[Path] = (),
    stop: Event | None = None,
) -> Path:
    """Return the path of a dataset's file; it is fetched unless the cache has it complete.

    A file of the same content in the cache, or in a folder of `have`, is used whatever its name.

    Parameters
    ----------
    dataset : Dataset
        What to fetch.
    timeout : float
        Seconds to wait for the server's answer, and in which it must send 4 KiB each at least.
    seconds : float
        Seconds that the download may take; default: no bound but that on the server's pace.
    progress : Progress, optional
        Receives the progress.
    have : sequence of Path
        Folders with files that were downloaded before.
    stop : Event, optional
        Ends the download once it is set.

    Returns
    -------
    Path
        The verified file in the cache.

    Raises
    ------
    DatasetError
        The server does not answer or sends too slowly or too much, the download breaks off or takes
        too long, or the checksum is wrong; the message names the file and the URL.
    MissingExtra
        The download libraries are not installed.
    RecordError
        The cache cannot be written to, or its disk is full.
    """
    if is_fetched(dataset):
        return dataset.path
    bounds = Bounds(dataset.size or LARGEST, timeout, monotonic() + seconds, stop or Event())
    try:
        if same := _file_with_content(dataset, have):
            _keep(dataset, lambda file: _copied(same, file))
            return dataset.path
        require(Extra.FETCH, f"fetching {dataset.file} from {dataset.url}")
        _keep(dataset, lambda file: _download(dataset, file, bounds, progress))
    except RecordError as error:
        raise RecordError(
            f"cannot keep {dataset.file} from {dataset.url}: {error} {CACHE_VARIABLE} names the "
            "folder of the cache."
        ) from error
    return dataset.path


def _keep(dataset: Dataset, fill: Callable[[BinaryIO], object]) -> None:
    """Move what `fill` writes to its final path after verifying it."""
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


def _file_with_content(dataset: Dataset, have: Sequence[Path]) -> Path | None:
    """Return a file with this dataset's content in the cache or in a folder of `have`."""
    if not dataset.sha256:
        return None
    for folder in (dataset.path.parent, *have):
        for path in sorted(folder.rglob("*")) if folder.is_dir() else ():
            if _holds(path, dataset):
                return path
    return None


def _holds(path: Path, dataset: Dataset) -> bool:
    """Whether a file has the dataset's content; never for an unreadable file.

    Drafts are skipped, since another download may rename or delete them at any moment.
    """
    if is_draft(path):
        return False
    try:
        if not path.is_file() or (dataset.size and path.stat().st_size != dataset.size):
            return False
        return sha256_of(path) == dataset.sha256
    except OSError:
        return False


@dataclass(frozen=True)
class Fetched:
    """The outcome for one dataset: its path, or the error."""

    dataset: Dataset
    path: Path | None
    error: CembenchError | None = None


def fetch_all(
    datasets: Iterable[Dataset],
    *,
    jobs: int = 4,
    timeout: float = 60.0,
    seconds: float = inf,
    have: Sequence[Path] = (),
    progress: Callable[[Dataset], Progress | None] = lambda dataset: None,
) -> Generator[Fetched, None, None]:
    """Fetch several datasets at once and yield each as it ends; an error does not stop the others.

    Datasets with the same file fetch it once. Files fetched before an interruption are kept, so the
    same call continues from there. Closing the iterator stops all downloads; `seconds` are those of
    each.

    Raises
    ------
    RecordError
        The cache cannot be written to, or its disk is full; no further download is started.
    """
    by_source: dict[str, list[Dataset]] = {}
    for dataset in datasets:
        by_source.setdefault(dataset.source_url, []).append(dataset)

    stop = Event()
    fetched = partial(fetch, timeout=timeout, seconds=seconds, stop=stop)

    def one(first: Dataset, *same: Dataset) -> None:
        fetched(first, progress=progress(first), have=have)
        for dataset in same:  # copies the file of the first
            fetched(dataset)

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        waiting = {pool.submit(one, *same): same for same in by_source.values()}
        try:
            for done in as_completed(waiting):
                error = done.exception()
                if error is not None and not isinstance(error, DatasetError):
                    raise error
                for dataset in waiting[done]:
                    path = None if error else dataset.path
                    yield Fetched(dataset, path, cast("CembenchError | None", error))
        finally:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)


def surface_file(dataset: Dataset) -> Path:
    """Return the file from which a fetched dataset's surface is read.

    It is the fetched file, or an OBJ file with the part of it that the dataset is.
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


def _download(dataset: Dataset, file: BinaryIO, bounds: Bounds, progress: Progress | None) -> None:
    """Download a dataset's file; :class:`DatasetError` if that fails."""
    try:
        download(dataset.url, file, bounds, progress)
    except DownloadError as error:
        raise DatasetError(
            f"cannot fetch {dataset.file} from {dataset.url}: {error}. "
            f"Check the network, set {MIRROR_VARIABLE} to a mirror, or put the file at "
            f"{dataset.path}."
        ) from error


def _check_whole(dataset: Dataset, path: Path) -> None:
    """Raise :class:`DatasetError` if a downloaded file is not the dataset's."""
    if _is_whole(dataset, path):
        return
    what = f"SHA-256 is not {dataset.sha256}"
    if not dataset.sha256:
        what = f"mesh is not the known one (hash {dataset.mesh_hash})"
    raise DatasetError(
        f"{dataset.file} from {dataset.url} is damaged or another file: its {what}. Try again, "
        f"or set {MIRROR_VARIABLE} to another mirror."
    )
