"""Collections of surfaces: a folder or an archive.

Each function yields surfaces that are ready to be mapped: disks and surfaces with holes as they
are, closed surfaces of genus 0 cut open. Unusable surfaces are yielded too, with the reason, so
that success rates have the right denominator.
"""

from __future__ import annotations

import bz2
import csv
import gzip
import lzma
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import BinaryIO, cast

from cembench.core.errors import CembenchError, ParameterError
from cembench.mesh.cut import cut_open
from cembench.mesh.files import is_named_like_a_mesh, read_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.running.plan import Provenance
from cembench.running.surfaces import load_surface

#: Name of the table in a folder that says where its surfaces are from.
MANIFEST = "MANIFEST.tsv"
#: Maximum size of an archive member, in bytes.
LARGEST_MEMBER = 2**31
#: Maximum number of archive members that are examined.
MAX_MEMBERS = 1_000_000
#: Maximum size of a header in a TAR archive, which is read at once, and how many times its own size
#: such an archive may unpack to, beside one member of the maximum size.
LARGEST_HEADER, MAX_UNPACKED = 2**24, 200
_PIECE = 2**20


_DAMAGED = (zlib.error, lzma.LZMAError)


@dataclass(frozen=True)
class Provided:
    """A surface, or the reason why there is none.

    Parameters
    ----------
    name : str
        Its name, unique within a provider.
    source : str
        Its origin: a path, a member of an archive, or an entry of another collection.
    mesh : DiskMesh, HoledMesh or None
        The surface; None if it cannot be used.
    error : str
        Why it cannot be used.
    licence : str
        The licence stated by the provider; "" for none.
    cut : bool
        Whether it was closed and was cut open.
    provenance : Provenance
        What is known of who published it, and of the object that it shows.
    """

    name: str
    source: str
    mesh: TriangleMesh | None = None
    error: str = ""
    licence: str = ""
    cut: bool = False
    provenance: Provenance = field(default_factory=Provenance)


def surfaces_of_folder(folder: Path, *, limit: int | None = None) -> Iterator[Provided]:
    """Yield the surfaces of all mesh files in a folder and its subfolders, sorted by path.

    A table :data:`MANIFEST` in the folder says where they are from (:func:`read_manifest`).

    Parameters
    ----------
    folder : Path
        The folder; symbolic links to folders are not followed.
    limit : int, optional
        Maximum number of files.

    Raises
    ------
    ParameterError
        The path is not a folder, or its manifest cannot be read.

    Examples
    --------
    >>> import cembench
    >>> cembench.write_mesh("flat.obj", cembench.surface("flat-disk", 200))
    >>> [found.name for found in surfaces_of_folder(Path())]
    ['flat']
    """
    if not folder.is_dir():
        raise ParameterError(f"{folder} is not a folder; name a folder that holds mesh files.")
    files = (path for path in sorted(folder.rglob("*")) if is_named_like_a_mesh(path))
    names, manifest = Names(), read_manifest(folder)
    for path in islice(files, limit):
        inside = path.relative_to(folder).with_suffix("").as_posix()
        row = manifest.get(inside, {})
        name = names.of(row.get("name") or inside.replace("/", "-"))
        one = provided(name, str(path), partial(read_mesh, path, TriangleMesh))
        about = Provenance(source=row.get("source", ""), family=row.get("family", ""))
        yield replace(one, licence=row.get("licence", ""), provenance=about)


def read_manifest(folder: Path) -> dict[str, dict[str, str]]:
    """Return the rows of a folder's manifest by the path of their file, without its suffix.

    A manifest is a table separated by tabs. A row's file is the path in its column `file`, or its
    `name` in the subfolder that its `group` names. What else is used: `source` (who published it),
    `family` (the object that it shows: surfaces of one family count as one in intervals), and
    `licence`.

    Returns
    -------
    dict
        The rows; empty if the folder has no manifest, or one without these columns.

    Raises
    ------
    ParameterError
        The manifest cannot be read.
    """
    place = folder / MANIFEST
    if not place.is_file():
        return {}
    try:
        rows = list(csv.DictReader(place.read_text(encoding="utf-8").splitlines(), delimiter="\t"))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ParameterError(
            f"{place} cannot be read as a table: {error}. Write it as UTF-8 text with a line a "
            "surface and tabs between the columns, or move it away."
        ) from error
    return {
        file: {key: value for key, value in row.items() if key and isinstance(value, str)}
        for row in rows
        if (file := _file_in(row))
    }


def _file_in(row: Mapping[str, str | None]) -> str:
    """Return the path of a manifest's file without its suffix; "" if the row names none."""
    if row.get("file"):
        return PurePosixPath(row["file"] or "").with_suffix("").as_posix()
    return "/".join(filter(None, (row.get("group"), row.get("name")))) if row.get("name") else ""


def surfaces_of_archive(path: Path, *, limit: int | None = None) -> Iterator[Provided]:
    """Yield the surfaces of all mesh files in a ZIP or TAR archive, in its order.

    One member at a time is unpacked to a temporary folder, under a new name. Links and devices are
    ignored, and a member that grows beyond 2 GiB is skipped.

    Raises
    ------
    ParameterError
        The file is not an archive, or is damaged.
    """
    names = Names()
    with tempfile.TemporaryDirectory() as folder:
        try:
            with closing(_members(path)) as members:
                for member in islice(members, limit):
                    yield _unpacked(member, names, Path(folder), path)
        except (zipfile.BadZipFile, tarfile.TarError, EOFError, *_DAMAGED, OSError) as error:
            raise ParameterError(
                f"{path} cannot be read as an archive ({type(error).__name__}: {error}); name a "
                "complete .zip, .tar, .tar.gz, .tar.bz2 or .tar.xz file."
            ) from None


def provided(
    name: str, source: str, load: Callable[[], TriangleMesh], licence: str = ""
) -> Provided:
    """Load a surface and prepare it for mapping; on failure, return the reason."""
    try:
        mesh = load()
        if mesh.loops:
            return Provided(name, source, load_surface(mesh.renamed(name)), licence=licence)
        edges = 3 * mesh.m // 2
        if mesh.n - edges + mesh.m != 2:
            why = "it is closed, but not a single sphere: only closed surfaces of genus 0 are cut"
            return Provided(name, source, error=why, licence=licence)
        return Provided(name, source, cut_open(mesh).mesh.renamed(name), licence=licence, cut=True)
    except CembenchError as error:
        return Provided(name, source, error=str(error), licence=licence)


class Names:
    """Makes names unique: the second "face" becomes "face-2"."""

    def __init__(self) -> None:
        self.taken: set[str] = set()

    def of(self, name: str) -> str:
        """Return the name, with a number if it was used before."""
        number, unused = 1, name
        while unused in self.taken:
            number += 1
            unused = f"{name}-{number}"
        self.taken.add(unused)
        return unused


@dataclass(frozen=True)
class _Member:
    """A mesh file in an archive: its path, its declared size, and its bytes."""

    path: PurePosixPath
    size: int
    open: Callable[[], BinaryIO]


def _members(path: Path) -> Generator[_Member, None, None]:
    """Yield the regular files of an archive that have the suffix of a mesh format."""
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            for info in archive.infolist()[:MAX_MEMBERS]:
                inside = PurePosixPath(info.filename)
                is_link = (info.external_attr >> 28) == 0o12
                if not info.is_dir() and not is_link and is_named_like_a_mesh(Path(inside.name)):
                    opened = lambda info=info: cast(BinaryIO, archive.open(info))  # noqa: E731
                    yield _Member(inside, info.file_size, opened)
        return
    with _unpacking(path) as content, tarfile.open(fileobj=cast(BinaryIO, content)) as archive_:
        for count, member in enumerate(archive_):
            inside = PurePosixPath(member.name)
            if count >= MAX_MEMBERS:
                return
            if member.isreg() and is_named_like_a_mesh(Path(inside.name)):
                taken = lambda member=member: cast(BinaryIO, archive_.extractfile(member))  # noqa: E731
                yield _Member(inside, member.size, taken)


class _Bounded:
    """A TAR archive while it is unpacked: neither a header nor the whole is larger than allowed."""

    def __init__(self, file: BinaryIO, most: int) -> None:
        self._file, self._most = file, most
        self.tell = file.tell

    def read(self, size: int = -1) -> bytes:
        if not 0 <= size <= LARGEST_HEADER:
            raise tarfile.ReadError(f"a header of {size:,} bytes; allowed are {LARGEST_HEADER:,}")
        return self._file.read(size)

    def seek(self, place: int) -> int:
        if place > self._most:
            raise tarfile.ReadError(
                f"it unpacks to more than {self._most:,} bytes, {MAX_UNPACKED} times its own size"
            )
        return self._file.seek(place)


@contextmanager
def _unpacking(path: Path) -> Iterator[_Bounded]:
    """Open a TAR archive, packed or not."""
    with path.open("rb") as file:
        start = file.read(6)
    openers = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ": lzma.open}
    opener = next((one for magic, one in openers.items() if start.startswith(magic)), open)
    with cast(Callable[[Path, str], BinaryIO], opener)(path, "rb") as content:
        yield _Bounded(content, LARGEST_MEMBER + MAX_UNPACKED * path.stat().st_size)


def _unpacked(member: _Member, names: Names, folder: Path, archive: Path) -> Provided:
    name = names.of(member.path.stem)
    source = f"{archive}: {member.path}"
    if member.size > LARGEST_MEMBER:
        return Provided(name, source, error=f"it has {member.size} bytes, more than allowed")
    suffix = member.path.suffix.lower()
    with tempfile.NamedTemporaryFile(dir=folder, suffix=suffix) as file:
        try:
            with member.open() as content:
                left = LARGEST_MEMBER
                while piece := content.read(_PIECE):
                    left -= len(piece)
                    if left < 0:
                        return Provided(name, source, error="it is larger than its declared size")
                    file.write(piece)
        except RuntimeError as error:  # encrypted, or an unsupported compression
            return Provided(name, source, error=f"it cannot be unpacked: {error}")
        file.flush()
        place = Path(file.name)
        surface = provided(name, source, lambda: read_mesh(place, TriangleMesh).renamed(name))
        return Provided(
            name, source, surface.mesh, surface.error.replace(str(place), source), cut=surface.cut
        )
