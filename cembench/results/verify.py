"""Verify that a run's records and maps were not changed and agree with each other.

A run stores hashes: a record's digest of itself, the cell's key in the file name, and SHA-256 of
map and mesh. Figures can also be recomputed from the map. Every record is compared with its digest,
its name and its own status. Maps are verified for all records (``--verify``) or for a sample,
because a large map takes seconds. The same records give the same sample.
"""

from __future__ import annotations

import hashlib
import json
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import inf
from pathlib import Path

import numpy as np

from cembench.conformal.atlas import atlas_metrics
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import RecordError
from cembench.core.loading import read_bytes
from cembench.results.records import Record, altered
from cembench.results.store import Store, read_record

#: Maximum total triangles of a sample's maps; the sample has at least one map.
SAMPLE_TRIANGLES = 200_000
#: Rounding errors, relative to the size of the terms.
ROUNDING = 1e-9
#: Number of disagreements listed in an error.
_NAMED = 10


class Depth(StrEnum):
    """Depths of verification."""

    records = "records"
    sample = "sample"
    everything = "everything"


class Kind(StrEnum):
    """Kinds of findings."""

    damaged = "damaged"
    file_name = "file name"
    digest = "digest"
    status = "status"
    map = "map"
    mesh = "mesh"
    metrics = "metrics"
    #: Nothing disagrees, but something cannot be compared.
    not_kept = "not kept"


@dataclass(frozen=True)
class Finding:
    """A disagreement, or something that cannot be compared, in a file."""

    file: Path
    kind: Kind
    detail: str

    @property
    def disagrees(self) -> bool:
        """Whether something is wrong, rather than just not comparable."""
        return self.kind is not Kind.not_kept

    def __str__(self) -> str:
        return f"{self.file.name}: {self.detail}"


@dataclass(frozen=True)
class Verified:
    """The records that could be read, and the findings."""

    records: tuple[Record, ...]
    findings: tuple[Finding, ...]

    @property
    def disagreements(self) -> tuple[Finding, ...]:
        """The findings that show a disagreement."""
        return tuple(finding for finding in self.findings if finding.disagrees)


def verify(store: Store, depth: Depth) -> Verified:
    """Read all records of a run and compare them with their hashes and maps."""
    records: dict[Path, Record] = {}
    findings: list[Finding] = []
    for file in store.record_files():
        try:
            records[file] = read_record(file)
        except RecordError as error:
            findings.append(Finding(file, Kind.damaged, error.detail))
        else:
            findings += verify_record(file, records[file])
    for file, record in _chosen(records, depth):
        findings += verify_map(store, file, record)
    return Verified(tuple(records.values()), tuple(findings))


def sound_records(store: Store, depth: Depth) -> list[Record]:
    """Return all records of a run.

    Raises
    ------
    RecordError
        There is no run, or its contents disagree.
    """
    store.check_is_run()
    verified = verify(store, depth)
    if verified.disagreements:
        raise _refusal(store, verified.disagreements)
    return list(verified.records)


def _refusal(store: Store, found: Sequence[Finding]) -> RecordError:
    named = "\n".join(f"  {finding}" for finding in found[:_NAMED])
    more = f"\n  and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    return RecordError(
        f"{store.folder} cannot be used: its records or maps are not as they were written.\n"
        f"{named}{more}\nDelete these files and run again, or restore them. "
        f"`cembench status {store.folder} --verify` compares everything."
    )


def verify_record(file: Path, record: Record) -> Iterator[Finding]:
    """Compare a record with its digest, its file's name and its own status."""
    if how := altered(json.loads(read_bytes(file, file.parents[1]))):
        yield Finding(file, Kind.digest, how)
    if not file.stem.endswith(f"--{record.cell.key[:12]}"):
        yield Finding(
            file,
            Kind.file_name,
            f"its content has the key {record.cell.key[:12]}, which is not the key in its name",
        )
    outcome = record.outcome
    folds = outcome.metrics.get("flipped_triangles")
    if outcome.status == "ok" and folds:
        yield Finding(file, Kind.status, f"its status is ok, but {folds} triangles are folded")


def verify_map(store: Store, file: Path, record: Record) -> Iterator[Finding]:
    """Compare a record's figures with those of its map, and both with their hashes."""
    cell, outcome = record.cell, record.outcome
    kept, surface = store.map_file(cell), store.mesh_file(cell)
    try:
        uv, mesh = store.uv(cell), store.mesh(cell)
    except RecordError as error:
        yield Finding(file, Kind.damaged, error.detail)
        return
    if uv is None or mesh is None:
        if outcome.metrics:
            missing = kept if uv is None else surface
            yield Finding(file, Kind.not_kept, f"cannot be recomputed: there is no {missing.name}")
        return
    if outcome.uv_hash is not None and outcome.uv_hash != hashlib.sha256(uv.tobytes()).hexdigest():
        yield Finding(file, Kind.map, f"{kept.name} does not hold the map that was measured")
        return
    counts = (mesh.n, mesh.m, sum(len(loop) for loop in mesh.loops))
    facts = record.mesh
    if counts != (facts.vertices, facts.faces, facts.boundary_vertices):
        written = (facts.vertices, facts.faces, facts.boundary_vertices)
        yield Finding(
            file,
            Kind.mesh,
            f"records {written} vertices, triangles and boundary vertices; {surface.name} has "
            f"{counts}",
        )
    atlas = record.target == "atlas"
    if len(uv) != (3 * mesh.m if atlas else mesh.n) or not np.isfinite(uv).all():
        detail = f"{kept.name} is not a finite map of the {mesh.n} vertices of {surface.name}"
        yield Finding(file, Kind.map, detail)
        return
    figures = atlas_metrics(mesh, uv.reshape(-1, 3)) if atlas else all_metrics(mesh, uv)
    differing = different_metrics(outcome.metrics, figures)
    if differing:
        yield Finding(
            file, Kind.metrics, f"the map gives different figures: {'; '.join(differing)}"
        )


def different_metrics(
    recorded: Mapping[str, float | None], computed: Mapping[str, float]
) -> list[str]:
    """Return a text for each figure that differs by more than rounding; null means infinity."""
    size = abs(computed["dirichlet_energy"]) + abs(computed["image_area"])
    worst = computed["dilatation_max"]
    scales = {
        # E_C is a small difference of two large terms.
        **dict.fromkeys(("dirichlet_energy", "image_area", "conformal_energy"), size),
        "common_gauge_energy": size,
        **dict.fromkeys(("angle_error_mean_deg", "angle_error_sd_deg"), 180.0),
        # Computed from 1 - |mu|, which keeps eight digits at a dilatation of 1e8.
        **dict.fromkeys(("dilatation_mean", "dilatation_max"), worst * worst),
        **dict.fromkeys(("boundary_circularity", "overlap_share"), 1.0),
        **dict.fromkeys(("beltrami_area_mean", "beltrami_max"), 1.0),
        # From areas, which have few correct digits for slivers.
        **dict.fromkeys(("area_distortion_mean", "area_distortion_sd"), worst),
    }
    differing = []
    for name, recomputed in computed.items():
        if name not in recorded:
            continue
        held = inf if (value := recorded[name]) is None else value
        bound = ROUNDING * max(scales.get(name, 0.0), abs(recomputed))
        if held != recomputed and not abs(held - recomputed) <= bound:
            differing.append(f"{name} {recomputed:.10g}, recorded {held:.10g}")
    return differing


def _chosen(records: Mapping[Path, Record], depth: Depth) -> list[tuple[Path, Record]]:
    """Return the records whose maps are verified."""
    if depth is Depth.records:
        return []
    if depth is Depth.everything:
        return list(records.items())
    chosen: list[tuple[Path, Record]] = []
    shuffled = random.Random("".join(file.name for file in records)).sample(
        list(records.items()), len(records)
    )
    room = SAMPLE_TRIANGLES
    for file, record in shuffled:
        if record.outcome.metrics and (record.mesh.faces <= room or not chosen):
            chosen.append((file, record))
            room -= record.mesh.faces
    return chosen
