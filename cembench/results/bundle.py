"""A run as one file that can be sent to others: a zip archive that is an RO-Crate.

::

    ro-crate-metadata.json     who measured what with which software, and the hash of every file
    records/ environments/     as in a run's folder (:mod:`cembench.results.store`)
    maps/ meshes/              where maps are sent
    signature                  of these files, if the run was signed for it

Nothing in an archive is trusted: it may hold these names and no others, regular files of bounded
size, and each file must have the hash that the metadata gives it.
"""

from __future__ import annotations

import hashlib
import json
import re
import stat
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from statistics import median
from typing import Any
from urllib.parse import quote, unquote

from cembench.core.atomic import write
from cembench.core.errors import RecordError
from cembench.core.loading import damaged, files_in, is_there, read_bytes
from cembench.results.machines import Environments, machine_of
from cembench.results.records import Record
from cembench.results.run_folder import SIGNATURE
from cembench.results.store import Store
from cembench.results.verify import Depth, verify

#: The file of metadata, and the version of RO-Crate that it follows.
METADATA, ROCRATE = "ro-crate-metadata.json", "https://w3id.org/ro/crate/1.1"
#: At most this many files, and bytes once unpacked: of the archive and of each archive of arrays.
MOST_FILES, MOST_BYTES = 100_000, 2 * 2**30
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


@dataclass(frozen=True)
class Bundle:
    """A bundle that was unpacked, and what is wrong with it."""

    name: str
    store: Store
    records: tuple[Record, ...]
    environments: Environments
    faults: tuple[str, ...]

    @property
    def machines(self) -> tuple[str, ...]:
        """The names of the machines, as they named themselves."""
        used = sorted({record.environment for record in self.records})
        return tuple(dict.fromkeys(machine_of(self.environments.get(key, {})) for key in used))

    @property
    def signed(self) -> bool:
        """Whether it has a signature; by whom is for :func:`cembench.results.signing.signer`."""
        return (self.store.folder / SIGNATURE).is_file()


def contents(run: Store, *, maps: bool, surfaces: Mapping[str, str]) -> dict[str, bytes]:
    """Return the files of a run that are sent, by their names in the bundle.

    Parameters
    ----------
    run : Store
        The run.
    maps : bool
        Whether the maps are sent, and the surfaces whose licence is known with them.
    surfaces : mapping
        The licence of each surface by its hash; "" if none is stated.

    """
    places = [
        *run.record_files(),
        *files_in(run.folder / "environments", "*.json", run.folder),
    ]
    if maps:
        free = {
            run.mesh_file(r.cell): None for r in run.records() if surfaces.get(r.cell.mesh_hash)
        }
        places += files_in(run.folder / "maps", "*.npz", run.folder)
        places += [place for place in free if is_there(place)]
    return {
        place.relative_to(run.folder).as_posix(): read_bytes(place, run.folder) for place in places
    }


def pack(
    files: Mapping[str, bytes],
    run: Store,
    path: Path,
    about: Mapping[str, Any],
    surfaces: Mapping[str, str],
) -> None:
    """Write the files of a run as a bundle.

    Parameters
    ----------
    files : mapping
        The content of each file by its name, as :func:`contents` returns them.
    run : Store
        The run.
    path : Path
        The file to write.
    about : mapping
        Of the bundle: its name, licence, and author ("" if not named).
    surfaces : mapping
        The licence of each surface by its hash; "" if none is stated.

    """
    graph = _crate(run, files, about, surfaces)
    crate = json.dumps({"@context": _CONTEXT, "@graph": graph}, indent=1).encode()

    def fill(file: Any) -> None:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in {**files, METADATA: crate}.items():
                # Of a fixed date: equal runs give equal bytes.
                archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)

    write(path, fill)


#: RO-Crate 1.1 has no name for a hash; schema.org does.
_CONTEXT = [f"{ROCRATE}/context", {"sha256": "https://schema.org/sha256"}]


def _crate(
    store: Store,
    files: Mapping[str, bytes],
    about: Mapping[str, Any],
    surfaces: Mapping[str, str],
) -> list[dict[str, Any]]:
    """Return the entities of the metadata."""
    records, environments = store.records(), store.environments()
    spdx = {name: f"https://spdx.org/licenses/{name}" for name in surfaces.values() if name}
    spdx[about["licence"]] = f"https://spdx.org/licenses/{about['licence']}"
    meshes = {record.cell.mesh_hash: record.cell.mesh for record in records}
    started = sorted(record.started_at for record in records)
    tools = [f"#environment-{key}" for key in environments]
    author = [{"@id": "#author", "@type": "Person", "name": about["author"]}]
    return [
        {
            **_entity(METADATA, "CreativeWork"),
            "conformsTo": {"@id": ROCRATE},
            "about": {"@id": "./"},
        },
        {
            **_entity("./", "Dataset", about["name"]),
            "description": f"{len(records)} measurements of conformal parameterization, as "
            "records of cembench.",
            "datePublished": started[-1][:10],
            "license": {"@id": spdx[about["licence"]]},
            "hasPart": [{"@id": quote(name)} for name in files],
            **({"author": {"@id": "#author"}} if about["author"] else {}),
        },
        *(author if about["author"] else []),
        {
            **_entity("#run", "CreateAction", "measurement"),
            "startTime": started[0],
            "endTime": started[-1],
            "instrument": [{"@id": tool} for tool in tools],
            "object": [{"@id": f"#surface-{key[:16]}"} for key in meshes],
            "result": {"@id": "./"},
        },
        *(_tool(*item) for item in zip(tools, environments.values(), strict=True)),
        *(
            {
                **_entity(f"#surface-{key[:16]}", "CreativeWork", name),
                "identifier": key,
                **({"license": {"@id": spdx[licence]}} if (licence := surfaces.get(key)) else {}),
            }
            for key, name in meshes.items()
        ),
        *(_entity(address, "CreativeWork", name) for name, address in spdx.items()),
        *(
            {
                **_entity(quote(name), "File"),
                "encodingFormat": _TYPES.get(Path(name).suffix, "application/octet-stream"),
                "contentSize": str(len(content)),
                "sha256": hashlib.sha256(content).hexdigest(),
            }
            for name, content in files.items()
        ),
    ]


def _entity(place: str, kind: str, name: str = "") -> dict[str, Any]:
    return {"@id": place, "@type": kind} | ({"name": name} if name else {})


def _tool(place: str, environment: Mapping[str, Any]) -> dict[str, Any]:
    """Return the software and the machine of an environment."""
    libraries = environment.get("libraries") or {}
    git = environment.get("git") or {}
    return {
        **_entity(place, "SoftwareApplication", "cembench"),
        "softwareVersion": str(environment.get("cembench") or "unknown"),
        "identifier": str(git.get("commit") or ""),
        "softwareRequirements": [f"{name} {found}" for name, found in libraries.items() if found],
        "operatingSystem": str(environment.get("platform") or ""),
        "processorRequirements": machine_of(environment) + f": {environment.get('cpu') or ''}",
    }


def unpack(path: Path, folder: Path) -> Bundle:
    """Unpack a bundle into an empty folder and check it.

    Raises
    ------
    RecordError
        It is no bundle, or holds what must not be unpacked: nothing is then.

    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            _refuse(path, members)
            for member in members:
                archive.extract(member, folder)
    except (OSError, zipfile.BadZipFile, EOFError, ValueError, NotImplementedError) as error:
        raise damaged(path, "a bundle", error) from error
    except Exception as error:  # zlib has an error of its own
        if isinstance(error, RecordError):
            raise
        raise damaged(path, "a bundle", error) from error
    faults = [*_other_files(folder, [member.filename for member in members]), *_large(folder)]
    if faults:
        return Bundle(path.stem, Store(folder), (), {}, tuple(faults))
    store = Store(folder)
    verified = verify(store, Depth.everything)
    faults = [str(finding) for finding in verified.disagreements]
    environments = store.environments()
    if not verified.records and not faults:
        faults = ["it holds no record"]
    for record in verified.records:
        told = f"{record.cell.label}: "
        if record.environment not in environments:
            faults.append(f"{told}its environment {record.environment} is not there")
        hardware = environments.get(record.environment, {}).get("hardware_threads")
        faults += [told + why for why in implausible(record, hardware)]
    return Bundle(path.stem, store, verified.records, environments, tuple(faults))


def _refuse(path: Path, members: Sequence[zipfile.ZipInfo]) -> None:
    """Raise :class:`RecordError` if an archive may not be unpacked; only its list was read."""

    def refused(what: str) -> RecordError:
        return RecordError(
            f"{path} was not unpacked: {what}. Bundles are made by `cembench submit`; ask its "
            "sender for another."
        )

    if len(members) > MOST_FILES:
        raise refused(f"it holds {len(members):,} files, of at most {MOST_FILES:,}")
    if (size := sum(member.file_size for member in members)) > MOST_BYTES:
        raise refused(f"its files have {size:,} bytes, of at most {MOST_BYTES:,}")
    names: set[str] = set()
    for member in members:
        mode, name = member.external_attr >> 16, member.filename
        if stat.S_IFMT(mode) not in (0, stat.S_IFREG):
            raise refused(f"{name!r} is a link or not a regular file")
        if not _NAMES.fullmatch(name) or name != member.orig_filename or not name.isprintable():
            raise refused(f"{member.orig_filename!r} is no name of a bundle's files")
        if name.casefold() in names:
            raise refused(f"{name!r} is there twice")
        if member.flag_bits & 1 or member.compress_type not in (
            zipfile.ZIP_STORED,
            zipfile.ZIP_DEFLATED,
        ):
            raise refused(f"{name!r} is encrypted, or compressed in an unusual way")
        names.add(name.casefold())


def _other_files(folder: Path, names: Sequence[str]) -> Iterator[str]:
    """Yield how the files differ from what the metadata says of them."""
    told = _hashes(folder / METADATA)
    for name in sorted({*told, *names} - {METADATA}):
        if name not in told:
            yield f"{name} is not in {METADATA}"
        elif name not in names:
            yield f"{name} is missing"
        elif hashlib.sha256((folder / name).read_bytes()).hexdigest() != told[name]:
            yield f"{name} does not have the SHA-256 that {METADATA} gives it"


def _hashes(path: Path) -> dict[str, Any]:
    try:
        graph = json.loads(read_bytes(path, path.parent))["@graph"]
        files = [entity for entity in graph if entity["@type"] == "File"]
        return {unquote(entity["@id"]): entity["sha256"] for entity in files}
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise damaged(path, "metadata of a bundle", error) from error


def _large(folder: Path) -> Iterator[str]:
    """Yield the archives of arrays that declare more than a bundle may hold."""
    for place in (*files_in(folder / "maps", "*"), *files_in(folder / "meshes", "*")):
        try:
            with zipfile.ZipFile(place) as archive:
                size = sum(member.file_size for member in archive.infolist())
        except zipfile.BadZipFile as error:
            yield f"{place.name} is not an archive of arrays: {error}"
            continue
        if size > MOST_BYTES:
            yield f"{place.name} declares {size:,} bytes, of at most {MOST_BYTES:,}"


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


def far_from_others(bundles: Sequence[Bundle]) -> dict[str, list[str]]:
    """Return, by bundle, the cells whose seconds are far from those of all other machines.

    Compared are seconds over those of the reference kernel, cell by cell: the same surface, source
    and settings.
    """
    scaled: dict[str, dict[str, tuple[float, str]]] = {}
    for bundle in bundles:
        for record in bundle.records:
            if not bundle.faults and (units := kernel_units(record)) is not None:
                scaled.setdefault(record.cell.key, {})[bundle.name] = units, record.cell.label
    found: dict[str, list[str]] = {}
    for by_bundle in scaled.values():
        for name, (own, label) in by_bundle.items():
            others = [units for other, (units, _) in by_bundle.items() if other != name]
            if len(others) < OTHERS:
                continue
            usual = median(others)
            if not usual / APART <= own <= usual * APART:
                found.setdefault(name, []).append(
                    f"{label}: {own:.3g} times the reference kernel's seconds; on "
                    f"{len(others)} other machines {usual:.3g}"
                )
    return found


def kernel_units(record: Record) -> float | None:
    """Return a cell's seconds over those of the reference kernel; None if either is unknown."""
    known = [r.seconds / r.kernel_seconds for r in record.outcome.rounds if r.kernel_seconds]
    return median(known) if known else None
