"""A run as one file that can be sent to others: a zip archive that is an RO-Crate.

::

    ro-crate-metadata.json     who measured what with which software, and the hash of every file
    records/ environments/     as in a run's folder (:mod:`cembench.results.store`)
    maps/ meshes/              where maps are sent
    signature                  of all these files, metadata included, if the run was signed for it

Nothing in an archive is trusted: it may hold these names and no others, regular files whose sizes
are bounded before one is read, and each must have the hash that the metadata gives it.
"""

from __future__ import annotations

import hashlib
import json
import re
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from statistics import median
from typing import Any
from urllib.parse import quote, unquote

from cembench.core.atomic import write_bytes
from cembench.core.errors import RecordError
from cembench.core.loading import files_in, is_there, read_bytes, sha256_of
from cembench.core.names import distinct_slugs
from cembench.results.machines import machine_of, machine_of_record
from cembench.results.records import Record
from cembench.results.run_folder import METADATA, SIGNATURE
from cembench.results.signing import signature_of, signer
from cembench.results.store import Store
from cembench.results.verify import Depth, verify

from .submissions import Submission

#: How the file of a bundle ends.
SUFFIX = ".zip"
#: The version of RO-Crate that the metadata follow.
ROCRATE = "https://w3id.org/ro/crate/1.1"
#: At most this many files, and bytes once unpacked, the arrays in archives of arrays too.
MAX_FILES, MAX_BYTES = 100_000, 2 * 2**30
#: At most this many bytes of one file of text, which takes twenty times as many when it is read.
MAX_TEXT = 2**24
#: Nor may what is unpacked have more bytes than this many times those of the bundle, and a file of
#: text: records are compressed to a quarter, and maps less.
MAX_TIMES = 20
#: What an archive may hold.
_NAMES = re.compile(
    rf"(records|environments)/[^/\\:]+\.json|(maps|meshes)/[^/\\:]+\.npz|{METADATA}|{SIGNATURE}"
)
_TYPES = {".json": "application/json", ".npz": "application/zip"}
#: Seconds that the reference kernel can take, and its vertices.
KERNEL_SECONDS, KERNEL_VERTICES = (1e-4, 10.0), 4900
#: A timed call takes at least this share of the kernel's seconds for each vertex. The fastest map
#: of 118 real disks took 0.1, on a busy machine; reading and writing the arrays alone takes more.
LEAST = 1 / 200
#: Seconds of a cell, in those of the kernel, differ between machines at most by this factor. It is
#: asked of cells that so many other machines have measured.
APART, OTHERS = 10.0, 3
#: What rounding and the clocks may add.
_SLACK = 1.05


def pack(
    run: Store,
    path: Path,
    *,
    maps: bool,
    licence: str,
    author: str,
    surfaces: Mapping[str, str],
    key: Path | None,
) -> Submission:
    """Write a run as a bundle, and check it as a collection will.

    Parameters
    ----------
    run : Store
        The run.
    path : Path
        The file to write.
    maps : bool
        Whether the maps are sent, and the surfaces whose licence is known with them.
    licence, author : str
        Of the bundle; the author may be "".
    surfaces : mapping
        The licence of each surface by its hash; "" if none is stated.
    key : Path, optional
        The SSH key that signs it.

    Raises
    ------
    RecordError
        A collection would refuse it.
    """
    files = _contents(run, surfaces if maps else None)
    about = {"name": path.stem, "licence": licence, "author": author}
    crate = {"@context": _CONTEXT, "@graph": _crate(run, files, about, surfaces)}
    files[METADATA] = json.dumps(crate, indent=1).encode()
    if key is not None:
        files[SIGNATURE] = signature_of(files, key)
    with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
        draft = Path(folder) / path.name
        with zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                # Of a fixed date: equal runs give equal bytes.
                archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
        with unpacked([draft]) as submissions:
            (sent,) = submissions.values()
        if sent.faults:
            raise RecordError(
                f"{run.folder} was not packed, as a collection would refuse it:\n"
                + "\n".join(f"  {fault}" for fault in sent.faults[:10])
                + "\nMeasure these cells again, with `cembench run`."
            )
        write_bytes(path, draft.read_bytes())
    cells = [record.cell for record in run.records()] if maps else []
    unlicensed = dict.fromkeys(c.mesh for c in cells if not surfaces.get(c.mesh_hash))
    return replace(sent, unlicensed=tuple(unlicensed))


def _contents(run: Store, surfaces: Mapping[str, str] | None) -> dict[str, bytes]:
    """Return the files of a run that are sent, by their names; with `surfaces` the maps, too."""
    folder = run.folder
    places = [*run.record_files(), *files_in(folder / "environments", "*.json", folder)]
    if surfaces is not None:
        cells = [record.cell for record in run.records()]
        free = dict.fromkeys(run.mesh_file(c) for c in cells if surfaces.get(c.mesh_hash))
        places += files_in(folder / "maps", "*.npz", folder)
        places += filter(is_there, free)
    return {place.relative_to(folder).as_posix(): read_bytes(place, folder) for place in places}


#: RO-Crate 1.1 has no name for a hash; schema.org does.
_CONTEXT = [f"{ROCRATE}/context", {"sha256": "https://schema.org/sha256"}]


def _crate(
    store: Store, files: Mapping[str, bytes], about: Mapping[str, str], surfaces: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Return the entities of the metadata."""
    records, environments = store.records(), store.environments()
    licences = {name for name in (*surfaces.values(), about["licence"]) if name}
    meshes = {record.cell.mesh_hash: record.cell.mesh for record in records}
    started = sorted(record.started_at for record in records)
    author = about["author"] and "#author"
    return [
        _entity(METADATA, "CreativeWork", conformsTo=_ref(ROCRATE), about=_ref("./")),
        _entity(
            "./",
            "Dataset",
            name=about["name"],
            description=f"{len(records)} measurements of conformal parameterization, as records of "
            "cembench.",
            datePublished=started[-1][:10],
            license=_ref(_spdx(about["licence"])),
            hasPart=[_ref(quote(name)) for name in files],
            author=author and _ref(author),
        ),
        *([_entity(author, "Person", name=about["author"])] if author else []),
        _entity(
            "#run",
            "CreateAction",
            name="measurement",
            startTime=started[0],
            endTime=started[-1],
            instrument=[_ref(f"#environment-{key}") for key in environments],
            object=[_ref(f"#surface-{key[:16]}") for key in meshes],
            result=_ref("./"),
        ),
        *(_tool(f"#environment-{key}", one) for key, one in environments.items()),
        *(
            _entity(
                f"#surface-{key[:16]}",
                "CreativeWork",
                name=name,
                identifier=key,
                license=(licence := surfaces.get(key)) and _ref(_spdx(licence)),
            )
            for key, name in meshes.items()
        ),
        *(_entity(_spdx(name), "CreativeWork", name=name) for name in sorted(licences)),
        *(
            _entity(
                quote(name),
                "File",
                encodingFormat=_TYPES.get(Path(name).suffix, "application/octet-stream"),
                contentSize=str(len(content)),
                sha256=hashlib.sha256(content).hexdigest(),
            )
            for name, content in files.items()
        ),
    ]


def _entity(place: str, kind: str, **fields: Any) -> dict[str, Any]:
    """Return an entity of the metadata; empty fields are left out."""
    return {"@id": place, "@type": kind} | {name: one for name, one in fields.items() if one}


def _ref(place: str) -> dict[str, str]:
    return {"@id": place}


def _spdx(licence: str) -> str:
    return f"https://spdx.org/licenses/{licence}"


def _tool(place: str, environment: Mapping[str, Any]) -> dict[str, Any]:
    """Return the software and the machine of an environment."""
    libraries = environment.get("libraries") or {}
    return _entity(
        place,
        "SoftwareApplication",
        name="cembench",
        softwareVersion=str(environment.get("cembench") or "unknown"),
        identifier=(environment.get("git") or {}).get("commit"),
        softwareRequirements=[
            f"{name} {version}" for name, version in libraries.items() if version
        ],
        operatingSystem=environment.get("platform"),
        processorRequirements=machine_of(environment) + f": {environment.get('cpu') or ''}",
    )


def bundles_in(place: Path) -> list[Path]:
    """Return the bundles in a folder, or the one that a file is; raise where there is none."""
    files = [place] if place.is_file() else files_in(place, f"*{SUFFIX}")
    if not files:
        raise RecordError(
            f"{place} holds no bundle, which are files *{SUFFIX}. Make one with `cembench submit`."
        )
    return files


def is_bundle(place: Path) -> bool:
    """Whether a path is a bundle, or a folder of bundles that is no run."""
    if place.is_dir() and not (place / "records").exists():
        return any(path.suffix == SUFFIX for path in place.iterdir())
    return place.is_file()


@contextmanager
def accepted(
    paths: Sequence[Path], signers: Path | None = None
) -> Iterator[dict[Path, Submission]]:
    """Unpack bundles as :func:`unpacked`; raise :class:`RecordError` if one is refused."""
    with unpacked(paths, signers) as submissions:
        refused = [f"  {one.name}: {one.faults[0]}" for one in submissions.values() if one.faults]
        if refused:
            raise RecordError(
                "some bundles are refused:\n"
                + "\n".join(refused)
                + "\nLeave them out; `cembench submissions check` lists all that is wrong."
            )
        yield submissions


@contextmanager
def unpacked(
    paths: Sequence[Path], signers: Path | None = None
) -> Iterator[dict[Path, Submission]]:
    """Unpack bundles into temporary folders and check them; yield what was found, by folder.

    With `signers`, a file of allowed ones, each has to be signed by one of them.
    """
    names = distinct_slugs({str(path): path.stem for path in paths})
    submissions: dict[Path, Submission] = {}
    records: dict[str, Sequence[Record]] = {}
    with tempfile.TemporaryDirectory(prefix="cembench-") as above:
        for path in paths:
            name = names[str(path)]
            folder = Path(above) / name
            folder.mkdir()
            try:
                submissions[folder], records[name] = _checked(name, path, folder)
                if signers is not None and submissions[folder].accepted:
                    by = signer(folder, signers, path.name)
                    submissions[folder] = replace(submissions[folder], signer=by)
            except RecordError as error:
                about = submissions.get(folder, Submission(name))
                submissions[folder] = replace(about, faults=(str(error),))
        sound = {one.name: records[one.name] for one in submissions.values() if one.accepted}
        for name, far in far_from_others(sound).items():
            folder = Path(above) / name
            submissions[folder] = replace(submissions[folder], faults=tuple(far))
        yield submissions


def _checked(name: str, path: Path, folder: Path) -> tuple[Submission, Sequence[Record]]:
    """Unpack a bundle into an empty folder and check it; return its records, too.

    Raises
    ------
    RecordError
        It is no bundle, or holds what must not be unpacked: nothing is then.
    """
    again = "Ask its sender to pack it again, with `cembench submit`, or leave it out."
    try:
        most = min(MAX_BYTES, MAX_TEXT + MAX_TIMES * path.stat().st_size)
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            for what in _unsafe(members, most):
                raise RecordError(f"{path} was not unpacked: {what}. {again}")
            archive.extractall(folder, members)
    except (OSError, zipfile.BadZipFile, EOFError, ValueError, RuntimeError, zlib.error) as error:
        raise RecordError(f"{path} is not a bundle: {error}. {again}") from error
    try:
        names = [member.filename for member in members]
        faults = [*_other_files(folder, names), *_large(folder, most)]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        faults = [f"{METADATA} in {path} is not metadata of a bundle: {error}. {again}"]
    if faults:
        return Submission(name, tuple(faults)), ()
    store = Store(folder)
    verified, environments = verify(store, Depth.everything), store.environments()
    faults = [str(finding) for finding in verified.disagreements]
    if not verified.records and not faults:
        faults = ["it holds no record"]
    maps, machines = 0, {}
    for record in verified.records:
        cell, environment = record.cell, environments.get(record.environment)
        if environment is None:
            faults.append(f"{cell.label}: its environment {record.environment} is not there")
        hardware = (environment or {}).get("hardware_threads")
        faults += [f"{cell.label}: {why}" for why in implausible(record, hardware)]
        maps += store.map_file(cell).is_file() and store.mesh_file(cell).is_file()
        machines[record.environment] = machine_of_record(record, environments)
    named = tuple(dict.fromkeys(machines[key] for key in sorted(machines)))
    count = len(verified.records)
    return Submission(name, tuple(faults), count, named, maps), verified.records


def _unsafe(members: Sequence[zipfile.ZipInfo], most: int) -> Iterator[str]:
    """Yield why an archive must not be unpacked; only its list was read."""
    if len(members) > MAX_FILES:
        yield f"it holds {len(members):,} files, of at most {MAX_FILES:,}"
    if (size := sum(member.file_size for member in members)) > most:
        yield f"its files have {size:,} bytes, of at most {most:,}"
    names: set[str] = set()
    for member in members:
        mode, name = member.external_attr >> 16, member.filename
        if not name.endswith(".npz") and member.file_size > MAX_TEXT:
            yield f"{name!r} has {member.file_size:,} bytes, of at most {MAX_TEXT:,}"
        if stat.S_IFMT(mode) not in (0, stat.S_IFREG):
            yield f"{name!r} is a link or not a regular file"
        if not _NAMES.fullmatch(name) or name != member.orig_filename or not name.isprintable():
            yield f"{member.orig_filename!r} is no name of a bundle's files"
        if name.casefold() in names:
            yield f"{name!r} is there twice"
        packed = member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
        if member.flag_bits & 1 or not packed:
            yield f"{name!r} is encrypted, or compressed in an unusual way"
        names.add(name.casefold())


def _other_files(folder: Path, names: Sequence[str]) -> Iterator[str]:
    """Yield how the files differ from what the metadata says of them."""
    if METADATA not in names:
        raise ValueError("it is missing")
    stated = _hashes(folder / METADATA)
    for name in sorted({*stated, *names} - {METADATA, SIGNATURE}):
        if name not in stated:
            yield f"{name} is not in {METADATA}"
        elif name not in names:
            yield f"{name} is missing"
        elif sha256_of(folder / name) != stated[name]:
            yield f"{name} does not have the SHA-256 that {METADATA} gives it"


def _hashes(path: Path) -> dict[str, Any]:
    graph = json.loads(read_bytes(path, path.parent))["@graph"]
    files = [entity for entity in graph if entity["@type"] == "File"]
    return {unquote(entity["@id"]): entity["sha256"] for entity in files}


def _large(folder: Path, most: int) -> Iterator[str]:
    """Yield the archives of arrays that declare more than a bundle may hold."""
    for place in (*files_in(folder / "maps", "*"), *files_in(folder / "meshes", "*")):
        try:
            with zipfile.ZipFile(place) as archive:
                size = sum(member.file_size for member in archive.infolist())
        except zipfile.BadZipFile as error:
            yield f"{place.name} is not an archive of arrays: {error}"
            continue
        if size > most:
            yield f"{place.name} declares {size:,} bytes, of at most {most:,}"


def implausible(record: Record, hardware_threads: int | None = None) -> Iterator[str]:
    """Yield what cannot be true of a record's times.

    Parameters
    ----------
    record : Record
        The record of a cell.
    hardware_threads : int, optional
        Those of its machine.
    """
    try:
        started = datetime.fromisoformat(record.started_at)
        ahead = started.replace(tzinfo=started.tzinfo or UTC) - datetime.now(UTC)
    except ValueError:
        yield f"its date {record.started_at!r} is none"
    else:
        if ahead > timedelta(days=1):
            yield f"it was measured in the future: {record.started_at}"
    for k, one in enumerate(record.outcome.rounds, 1):
        if one.kernel_seconds is None:
            yield f"round {k} has no time of the reference kernel to compare with"
            continue
        low, high = KERNEL_SECONDS
        if not low <= one.kernel_seconds <= high:
            yield f"round {k}: no machine takes {one.kernel_seconds:g} s for the reference kernel"
        least = LEAST * one.kernel_seconds * record.mesh.vertices / KERNEL_VERTICES
        if min(one.calls) < least:
            yield (
                f"round {k}: {min(one.calls):.3g} s for {record.mesh.vertices:,} vertices is less "
                f"than the {least:.3g} s that this machine needs to read and write them, by its "
                "reference kernel"
            )
        if sum(one.phases.values()) > _SLACK * max(one.calls):
            yield f"round {k}: its phases take longer than its calls"
        most = _SLACK * max(*one.calls, one.cold_seconds or 0) * (hardware_threads or 1) + 0.05
        if hardware_threads and (one.cpu_seconds or 0) > most:
            yield f"round {k}: more CPU seconds than {hardware_threads} hardware threads have"


def far_from_others(records: Mapping[str, Sequence[Record]]) -> dict[str, list[str]]:
    """Return, by bundle, the cells whose seconds are far from those of all other machines.

    Compared are seconds over those of the reference kernel, cell by cell: the same surface, source
    and settings. `records` are those of each bundle.
    """
    scaled: dict[str, dict[str, tuple[float, str]]] = {}
    for name, own in records.items():
        for record in own:
            if (units := kernel_units(record)) is not None:
                scaled.setdefault(record.cell.key, {})[name] = units, record.cell.label
    far: dict[str, list[str]] = {}
    for by_bundle in scaled.values():
        for name, (units, label) in by_bundle.items():
            others = [other for one, (other, _) in by_bundle.items() if one != name]
            usual = median(others) if others else units
            if len(others) >= OTHERS and not usual / APART <= units <= usual * APART:
                far.setdefault(name, []).append(
                    f"{label}: {units:.3g} times the reference kernel's seconds; on "
                    f"{len(others)} other machines {usual:.3g}"
                )
    return far


def kernel_units(record: Record) -> float | None:
    """Return a cell's seconds over those of the reference kernel; None if either is unknown."""
    known = [r.seconds / r.kernel_seconds for r in record.outcome.rounds if r.kernel_seconds]
    return median(known) if known else None
