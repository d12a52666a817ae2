"""The data of a run, arranged for reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import RecordError
from cembench.core.loading import damaged
from cembench.core.names import distinct_slugs, in_lists
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.difficulty import Difficulty, Shape, difficulty, shape
from cembench.report.palette import SeriesStyle, series_styles
from cembench.results import columns
from cembench.results.columns import COLUMNS, DERIVED, family_of
from cembench.results.comparison import Comparison, compare, latest, speedup_columns
from cembench.results.exhibits import Exhibit, read_exhibits
from cembench.results.machines import Marks, marks
from cembench.results.papers import NO_PAPER, Paper, paper_of, papers, usual_paper
from cembench.results.records import REFERENCE, USUAL_REFERENCES, Cell, MeshOrigin, Record
from cembench.results.store import Store

if TYPE_CHECKING:
    import pandas as pd

DISK = "disk"
#: The metric by which maps of all targets are compared: mean angle error in degrees.
ANGLE = "angle_error_mean_deg"
#: Columns of :attr:`Evidence.frame` besides those of records.
FRAME_COLUMNS = (
    *("surface", "place", "label", "series", "main", "ok", "model", "origin", "counted", "once"),
    *("printed", "reference", "contest", "contested", "to", "as_good", "comparison", "speedup"),
    *("speedup_low", "speedup_high", "verdict", "verdict_corrected", "p", "ratio", "ratios"),
    *("paired", "cpu_ratio", "cpu_ratio_low", "cpu_ratio_high"),
)
#: A map is as good as another if its mean angle error is at most this many times as large, or this
#: many degrees larger.
AS_GOOD, DEGREES = 1.25, 0.25
#: What a surface has of its record.
_FACTS = ("vertices", "faces", "boundary_vertices", "non_delaunay_share", "fitted")
#: Parameters that distinguish two cells of an algorithm, besides surface and policy.
Variant = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class AlgorithmSeries:
    """An algorithm with one choice of parameters: a column of tables and a colour of plots.

    `label` distinguishes it from the same algorithm with other parameters in the same run.
    """

    algorithm: str
    title: str
    target: str
    variant: Variant
    label: str
    #: Whether most cells of the run have this choice of parameters; tables show that one.
    main: bool = True

    @property
    def name(self) -> str:
        """The algorithm's name for the main choice of parameters, which tables show."""
        return self.algorithm if self.main else self.label


@dataclass(frozen=True)
class MeasuredSurface:
    """A surface of the run."""

    name: str
    mesh_hash: str
    vertices: int
    faces: int
    boundary_vertices: int
    non_delaunay_share: float
    paper_row: str
    origin: MeshOrigin
    #: The object that it shows.
    family: str
    #: The algorithm to whose printed figures a stand-in was fitted.
    fitted: str = ""

    @property
    def title(self) -> str:
        """The paper's name of the model, or the surface's own name."""
        return self.paper_row or self.name

    @property
    def full_title(self) -> str:
        """The title; of a stand-in, which shows another surface, with the word."""
        return f"{self.title} (stand-in)" if self.origin == "stand-in" else self.title


@dataclass(frozen=True)
class Evidence:
    """The data of a run, from which every table, figure and claim is computed.

    Raises
    ------
    RecordError
        Raised by :meth:`of` if the folder holds no run, or a run without records or without a
        model of the paper.
    """

    store: Store
    records: tuple[Record, ...]
    exhibits: tuple[Exhibit, ...]
    #: Keys of records left out because the cell was measured again later.
    superseded: frozenset[str] = frozenset()
    #: The paper that the report is asked to be of; None for the one with most rows of the run.
    asked: Paper | None = None

    @classmethod
    def of(cls, run: Path, paper: Paper | None = None, records: Sequence[Record] = ()) -> Evidence:
        """Return the evidence of a run; `paper` is by default the one with most rows in it.

        `records` are those of the run, if they were read before.
        """
        store = Store(run)
        records = records or store.records()
        if not records:
            raise RecordError(
                f"{run} holds no record: no cell is finished yet. `cembench status {run}` "
                "shows what was requested; run the same `cembench run` again to resume it."
            )
        kept = latest(records)
        exhibits = tuple(read_exhibits(run))
        older = {record.cell.key for record in records} - {record.cell.key for record in kept}
        evidence = cls(store, tuple(kept), exhibits, frozenset(older), paper)
        if paper is not None and paper.models and not evidence.models:
            raise RecordError(
                f"no surface of {run} is, or stands in for, a model of {paper.title!r}; its models "
                f"are {', '.join(paper.models)}. Ask for another paper, or for none."
            )
        return evidence

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what was computed: another thread may be filling that in while this is sent."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @cached_property
    def paper(self) -> Paper:
        """The paper that printed figures are from."""
        held = Counter(record.mesh.paper_row for record in self.records)

        def rows(paper: Paper) -> int:
            return sum(held[model] for model in paper.models)

        return self.asked or max((usual_paper(), *papers().values()), key=rows)

    @property
    def reference(self) -> str:
        """The algorithm that the others are compared with: the paper's, or the usual one."""
        return self.paper.reference or REFERENCE

    @property
    def reference_label(self) -> str:
        """What :attr:`reference` is called in this run."""
        series = self.series_of(self.reference)
        return series.label if series else self.reference.upper()

    @cached_property
    def rows(self) -> dict[str, dict[str, Any]]:
        """The records as flat rows, by key of the cell."""
        return {
            row["key"]: row | {"family": self.by_hash[row["mesh_hash"]].family}
            for row in columns.rows(self.records, self.reference)
        }

    @cached_property
    def frame(self) -> pd.DataFrame:
        """The records as a frame, a row each, by surface, series and policy.

        Its columns are those of :attr:`rows`, the derived ones of :mod:`cembench.results.columns`,
        and `surface` (its title), `place` (its number in the report), `label` and `series` (its
        number), `main`, and `ok`; `model` (of the paper), `counted` (the one surface for its
        model), `once` (the same, or of no model), `printed` (an algorithm of the paper), and
        `reference`; `contest`, the name of target and policy, with rivals or not (`contested`),
        and `to`, the words for a target that is not the disk; `as_good`: about as good as the
        best map to the same target there; and of the comparison with the main parameters of the
        contest's reference `comparison`, `speedup` with its interval, `verdict`, `ratio`, and
        `paired`, the rounds with both.
        """
        import pandas as pd

        series = {(s.algorithm, s.variant): (k, s) for k, s in enumerate(self.series)}
        surfaces = {s.mesh_hash: (k, s) for k, s in enumerate(self.surfaces)}
        counted, left_out = set(self.one_per_model), set(self.stand_ins_left_out)
        rows = []
        for record in self.records:
            k, own = series[record.cell.algorithm, self._variants[record.cell.key]]
            place, surface = surfaces[record.cell.mesh_hash]
            figures = dict.fromkeys(COLUMNS) | self.row(record)
            figures |= {column.name: column.of(record) for column in DERIVED}
            about: dict[str, Any] = {"surface": surface.title, "place": place}
            about |= {"label": own.label, "series": k}
            about["contest"] = self.contest_name(own.target, record.cell.solves)
            about["contested"] = own.target in self.contests
            about["to"] = "" if own.target == DISK else f", {own.target}"
            about |= {"main": own.main, "ok": record.outcome.status == "ok"}
            about |= {"model": surface.paper_row or None, "origin": surface.origin}
            about |= {"counted": surface in counted, "once": surface not in left_out}
            about["printed"] = own.algorithm in self.paper.algorithms
            about["reference"] = own.algorithm == self.reference
            rows.append(figures | about | self._compared(record.cell.key))
        order = {policy: k for k, policy in enumerate(self.policies)}
        rows.sort(key=lambda row: (row["place"], row["series"], order[str(row["solves"])]))
        frame = pd.DataFrame(rows)
        frame = frame.astype(dict.fromkeys(frame.columns[frame.isna().all()], float))
        maps = frame[frame["ok"]]
        best = maps.groupby(["place", "solves", "target"])[ANGLE].transform("min")
        good = (maps[ANGLE] <= AS_GOOD * best) | (maps[ANGLE] <= best + DEGREES)
        # The copy holds columns of a type together: rows are taken in half the time.
        return frame.copy().assign(as_good=good.reindex(frame.index, fill_value=False))

    @cached_property
    def best_maps(self) -> pd.DataFrame:
        """The rows of the maps with the smallest mean angle errors, by the surface's hash.

        Maps to the disk are preferred; the linear-algebra policy is the first.
        """
        frame = self.frame
        maps = frame[frame["ok"] & (frame["solves"] == self.policies[0]) & frame[ANGLE].notna()]
        ranked = maps.assign(elsewhere=maps["target"] != DISK)
        ranked = ranked.sort_values(["elsewhere", ANGLE], kind="stable")
        return ranked.drop_duplicates("place").set_index("mesh_hash").sort_values("place")

    @cached_property
    def difficulties(self) -> dict[str, Difficulty]:
        """The difficulty of each surface that has a map to the disk, by its hash."""
        best, by_surface = self.best_maps, {}
        for of_surface, key in best["key"][best["target"] == DISK].items():
            mesh = self.mesh(self.by_hash[str(of_surface)])
            uv = self.uv(self.by_key[key])
            if mesh is not None and uv is not None and (one := difficulty(mesh, uv)):
                by_surface[str(of_surface)] = one
        return by_surface

    @cached_property
    def shapes(self) -> dict[str, Shape]:
        """What makes each surface's triangulation hard to map, by its hash, if it was saved."""
        meshes = {key: self.mesh(surface) for key, surface in self.by_hash.items()}
        return {key: shape(mesh) for key, mesh in meshes.items() if mesh is not None}

    @cached_property
    def by_key(self) -> dict[str, Record]:
        """The records by the keys of their cells."""
        return {record.cell.key: record for record in self.records}

    @cached_property
    def by_hash(self) -> dict[str, MeasuredSurface]:
        """The surfaces by the hashes of their meshes."""
        return {surface.mesh_hash: surface for surface in self.surfaces}

    @cached_property
    def machines(self) -> Marks:
        """A mark for the seconds of each machine, where the records are of several."""
        return marks(self.records, self.store.environments())

    @cached_property
    def policies(self) -> tuple[str, ...]:
        """The linear-algebra policies of this run, "reuse" first."""
        return tuple(sorted({r.cell.solves for r in self.records}, key=lambda p: p != "reuse"))

    @cached_property
    def surfaces(self) -> tuple[MeasuredSurface, ...]:
        """The paper's models in the paper's order, then other surfaces by size."""
        from cembench.registry import load_registry

        order = self.paper.models
        datasets = load_registry().datasets.values()
        public = {one.mesh_hash: one.name for one in datasets}
        shown = {one.paper_row: one.family for one in datasets if one.paper_row}
        surfaces: dict[str, MeasuredSurface] = {}
        for record in self.records:
            facts = record.mesh
            name = public.get(record.cell.mesh_hash, record.cell.mesh)
            row, origin = facts.paper_row, facts.origin
            if row not in order:
                row = self.paper.model_of(name, facts.faces)
                origin = "model" if row else "surface"
            family = family_of(record)
            if origin == "stand-in":
                family = shown.get(row) or self.paper.object_of(row)
            surfaces[record.cell.mesh_hash] = MeasuredSurface(
                name=record.cell.mesh,
                mesh_hash=record.cell.mesh_hash,
                **{name: getattr(facts, name) for name in _FACTS},
                paper_row=row,
                origin=origin,
                family=family,
            )

        def place(s: MeasuredSurface) -> tuple[int, int, str]:
            return (order.index(s.paper_row) if s.paper_row else len(order), s.faces, s.name)

        return tuple(sorted(surfaces.values(), key=place))

    @property
    def families(self) -> int:
        """Number of objects that the surfaces show."""
        return len({surface.family for surface in self.surfaces})

    @property
    def models(self) -> tuple[MeasuredSurface, ...]:
        """The surfaces that are, or stand in for, models of the paper."""
        return tuple(s for s in self.surfaces if s.paper_row)

    @cached_property
    def one_per_model(self) -> tuple[MeasuredSurface, ...]:
        """One surface for each model of the paper, the model itself preferred over a stand-in."""
        real_first = sorted(self.models, key=lambda s: s.origin != "model")
        chosen = {s.paper_row: s for s in reversed(real_first)}
        return tuple(s for s in self.models if chosen[s.paper_row] is s)

    @cached_property
    def stand_ins_left_out(self) -> tuple[MeasuredSurface, ...]:
        """The stand-ins left out of averages, because the run has the model or another stand-in."""
        return tuple(s for s in self.models if s not in self.one_per_model)

    def surface_for_model(self, model: str) -> MeasuredSurface | None:
        """Return the surface that is, or stands in for, this model; None if there is none."""
        return next((s for s in self.one_per_model if s.paper_row == model), None)

    @property
    def others(self) -> tuple[MeasuredSurface, ...]:
        """The surfaces that are not in the paper."""
        return tuple(s for s in self.surfaces if not s.paper_row)

    @cached_property
    def series(self) -> tuple[AlgorithmSeries, ...]:
        """Every algorithm of the run: the paper's in the paper's order, then others by name."""
        variants: dict[str, Counter[Variant]] = {}
        about: dict[str, Record] = {}
        for record in self.records:
            name = record.cell.algorithm
            choice = self._variants[record.cell.key]
            variants.setdefault(name, Counter())[choice] += 1
            about[name] = record
        titles = Counter(record.title for record in about.values())
        alike = Counter((record.title, record.target) for record in about.values())
        series = []
        for name in sorted(variants, key=lambda n: (self._place(n), n)):
            choices = [choice for choice, _ in variants[name].most_common()]
            for k, choice in enumerate(choices):
                title, target = about[name].title, about[name].target
                if alike[title, target] > 1:
                    title = f"{title} ({name})"
                elif titles[title] > 1 and target != DISK:
                    title = f"{title} ({target})"
                title = in_lists(title)
                if k == 0 and name in self._as_printed:
                    title = f"{title} (as the paper ran it)"
                label = title if k == 0 else f"{title} ({difference(choice, choices[0])})"
                series.append(AlgorithmSeries(name, title, target, choice, label, main=k == 0))
        return tuple(series)

    def _place(self, algorithm: str) -> int:
        known = self.paper.algorithms
        return known.index(algorithm) if algorithm in known else len(known)

    @property
    def disk_series(self) -> tuple[AlgorithmSeries, ...]:
        """The series that map to the unit disk."""
        return self.series_to(DISK)

    def series_to(self, target: str) -> tuple[AlgorithmSeries, ...]:
        """Return the series of a target; only these are compared with each other."""
        return tuple(s for s in self.series if s.target == target)

    @cached_property
    def targets(self) -> tuple[str, ...]:
        """The targets of the run's maps, the disk first."""
        return tuple(sorted({s.target for s in self.series}, key=lambda t: (t != DISK, t)))

    @cached_property
    def contests(self) -> tuple[str, ...]:
        """The targets that at least two algorithms map to: each is a contest of its own."""
        number = Counter(s.target for s in self.series if s.main)
        return tuple(target for target in self.targets if number[target] > 1)

    def contest_name(self, target: str, policy: str) -> str:
        """Return the name of a target under a policy, without the target if it is the disk."""
        return policy if target == DISK else f"{policy}, {target}"

    @property
    def contest_names(self) -> list[str]:
        """The names of all targets and policies."""
        return [self.contest_name(t, policy) for t in self.targets for policy in self.policies]

    def reference_to(self, target: str) -> AlgorithmSeries | None:
        """Return the series that those of a target are compared with.

        It is the run's reference if that maps there, else the usual one of the target, else the
        first.
        """
        own = {s.algorithm: s for s in self.series_to(target) if s.main}
        wanted = (self.reference, USUAL_REFERENCES.get(target, ""), *own)
        return next((own[name] for name in wanted if name in own), None)

    @cached_property
    def _index(self) -> dict[tuple[str, str, Variant, str], Record]:
        return {
            (r.cell.mesh_hash, r.cell.algorithm, self._variants[r.cell.key], r.cell.solves): r
            for r in self.records
        }

    @cached_property
    def _variants(self) -> dict[str, Variant]:
        """The choice of parameters of each cell, by its key.

        A cell on a model of the paper with the parameters as printed belongs to the series that
        other surfaces have with the usual ones, unless the run has that choice there too.
        """
        variants = {r.cell.key: _variant(r.cell, r.cell.parameters) for r in self.records}
        chosen = {
            (r.cell.algorithm, variants[r.cell.key], m)
            for r in self.records
            for m in (r.cell.mesh_hash, r.mesh.origin)
        }
        differing = {}
        for r in self.records:
            name, own = r.cell.algorithm, variants[r.cell.key]
            of_model = paper_of(r.mesh.paper_row) if r.mesh.origin == "model" else NO_PAPER
            usual = _variant(r.cell, of_model.as_elsewhere(name, r.cell.parameters))
            separate = (name, usual, r.cell.mesh_hash) in chosen or any(
                (name, own, origin) in chosen for origin in ("stand-in", "surface")
            )
            differing[r.cell.key] = own if r.mesh.origin != "model" or separate else usual
        return differing

    @cached_property
    def _as_printed(self) -> set[str]:
        """The algorithms whose cells on models are as a paper ran them, in the usual series."""
        return {
            r.cell.algorithm
            for r in self.records
            if self._variants[r.cell.key] != _variant(r.cell, r.cell.parameters)
        }

    @cached_property
    def styles(self) -> dict[str, SeriesStyle]:
        """Colour, marker and dash of each series by its label, the same in every plot."""
        styles = series_styles([s.name for s in self.series])
        return {s.label: styles[s.name] for s in self.series}

    def find(
        self, surface: MeasuredSurface, series: AlgorithmSeries, policy: str | None = None
    ) -> Record | None:
        """Return an algorithm's record on a surface; without a policy, the first that is ok."""
        chosen = [policy] if policy else self.policies
        held = [self.find_exactly(surface.mesh_hash, series, one) for one in chosen]
        there = [record for record in held if record is not None]
        return next((r for r in there if r.outcome.status == "ok"), there[0] if there else None)

    def find_exactly(self, mesh_hash: str, series: AlgorithmSeries, policy: str) -> Record | None:
        """Return the record of an algorithm on a surface under a policy; None without one."""
        return self._index.get((mesh_hash, series.algorithm, series.variant, policy))

    def series_of(self, algorithm: str) -> AlgorithmSeries | None:
        """Return the main series of an algorithm; None if the run has none."""
        return next((s for s in self.series if s.algorithm == algorithm and s.main), None)

    def row(self, record: Record) -> dict[str, Any]:
        """Return a record as a flat row, compared with the reference."""
        return self.rows[record.cell.key]

    @cached_property
    def comparisons(self) -> dict[str, Comparison]:
        """The comparisons of times with :meth:`reference_to`, by key; none without both times.

        It has its main parameters, on the same surface and with the same policy.
        """
        pairs = ((record, self.base(record)) for record in self.records)
        compared = {one.cell.key: compare(one, base) for one, base in pairs if base is not None}
        return {key: one for key, one in compared.items() if one is not None}

    def _compared(self, key: str) -> dict[str, Any]:
        comparison = self.comparisons.get(key)
        return {
            "comparison": comparison,
            **speedup_columns(comparison),
            "ratio": comparison and comparison.ratio,
            "paired": comparison.rounds if comparison else 0,
        }

    def rate(self, record: Record) -> float | None:
        """Return t / t_reference - 1 for a record's time t, the median ratio within rounds."""
        comparison = self.comparisons.get(record.cell.key)
        return None if comparison is None else comparison.speedup

    def base(self, record: Record) -> Record | None:
        """Return the record of the contest's reference; None for that record itself."""
        reference = self.reference_to(record.target)
        base = reference and self.find_exactly(record.cell.mesh_hash, reference, record.cell.solves)
        return None if not base or base.cell.key == record.cell.key else base

    def name_of(self, surface: MeasuredSurface) -> str:
        """Return a file name and anchor for a surface, unique in the run."""
        return self._names[surface.mesh_hash]

    @cached_property
    def _names(self) -> dict[str, str]:
        return distinct_slugs({s.mesh_hash: s.name for s in self.surfaces})

    def missing_reason(self, record: Record | None) -> str:
        """Return why there is no figure for this cell."""
        if record is None:
            return "not in this run"
        cause = record.outcome.cause
        return record.outcome.status + (f": {cause}" if cause else "")

    def mesh(self, surface: MeasuredSurface) -> TriangleMesh | None:
        """Return the mesh of a surface; None if the run did not save it."""
        record = next(r for r in self.records if r.cell.mesh_hash == surface.mesh_hash)
        mesh = self.store.mesh(record.cell)
        if mesh is not None and (mesh.n, mesh.m) != (surface.vertices, surface.faces):
            file = self.store.mesh_file(record.cell)
            raise damaged(file, f"the surface {surface.name}", "other counts than recorded")
        return mesh

    def uv(self, record: Record | None) -> NDArray[np.complex128] | None:
        """Return the map of a record that ended ok, else None; atlases are not drawn."""
        if record is None or record.outcome.status != "ok" or record.target == "atlas":
            return None
        uv = self.store.uv(record.cell)
        if uv is not None and len(uv) != record.mesh.vertices:
            file = self.store.map_file(record.cell)
            why = f"it has {len(uv)} vertices, the record {record.mesh.vertices}"
            raise damaged(file, f"the map of {record.cell.label}", why)
        return uv


def model_surface(model: str) -> str:
    """Return the name of the registered stand-in for a model, or the model's name."""
    from cembench.registry import load_registry

    surfaces = load_registry().surfaces.values()
    return next((s.name for s in surfaces if s.paper_row == model), model)


def _variant(cell: Cell, parameters: Mapping[str, Any]) -> Variant:
    chosen = [(name, str(value)) for name, value in sorted(parameters.items())]
    return (*chosen, ("backend", cell.backend), ("threads", str(cell.threads)))


def difference(choice: Variant, main: Variant) -> str:
    """Return the parameters of a choice that are not those of the main one."""
    other = [pair for pair in choice if pair not in main] or choice
    return ", ".join(f"{name}={value}" for name, value in other)
