"""The whole report of a run: of a paper, of the user's own surfaces, or over many surfaces."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from cembench.core.errors import ParameterError
from cembench.core.version import installed_version
from cembench.report.content import many_surfaces, policies
from cembench.report.content.claims import at_a_glance, claims, in_short
from cembench.report.content.evidence import Evidence, MeasuredSurface
from cembench.report.content.exhibits import exhibit_sections
from cembench.report.content.findings import findings, many_findings
from cembench.report.content.inspection import Inspection, inspect_surface
from cembench.report.content.paper_figures import OF_MODELS, figures_section, paper_plot
from cembench.report.content.printed_tables import printed_tables
from cembench.report.content.standings import (
    contest_words,
    contests_of,
    rank_tables,
    surfaces_words,
)
from cembench.report.content.surface_page import figures_table, surface_page
from cembench.report.declared import declared_table, own_tables
from cembench.report.declared_plots import declared_plot
from cembench.report.document import (
    ORIGINS,
    Claim,
    Figure,
    Item,
    Plain,
    Report,
    Section,
    Table,
    Text,
    words,
)
from cembench.report.given_tables import given_table
from cembench.report.plot_rows import exponents_table, printed
from cembench.report.plots import drawn
from cembench.report.shared_drawing import each
from cembench.results.machines import machine_of, software_differences
from cembench.results.records import MeshOrigin
from cembench.results.stability import scatter_words


def machines_section(evidence: Evidence) -> Section | None:
    """A line a machine, and in what their software differs; None where there is one machine."""
    environments = evidence.store.environments()
    marked = evidence.machines
    differing = software_differences(evidence.records, environments)
    if not marked.letters and not differing:
        return None
    items: list[Item] = [Text(words) for words in marked.explained()]
    if marked.letters:
        items.append(
            Text(
                "The letter beside a time names its machine. A surface is measured on one machine "
                "by all algorithms, so rates of speedup, their averages, ranks and profiles are "
                "formed within machines. Plots of seconds, and exponents, run over all of them: "
                "part of what they show is how machines differ."
            )
        )
        items.append(_table(evidence))
    items += [Text(f"Other software than most cells have: {words}.") for words in differing]
    return Section("machines", "Machines", tuple(items))


def _table(evidence: Evidence) -> Table:
    environments = evidence.store.environments()
    rows: list[list[Plain]] = []
    for name, letter in evidence.machines.letters.items():
        own = [record for record in evidence.records if evidence.machines.of(record) == letter]
        about = next(
            (e for r in own if machine_of(e := environments.get(r.environment, {})) == name), {}
        )
        surfaces = len({record.cell.mesh_hash for record in own})
        cpu = str(about.get("cpu") or "-")
        rows.append([letter, name or "not named", cpu, surfaces, len(own)])
    return given_table("machines", rows, origin="")


#: Receives progress: a text, the number of finished steps, and their total.
Progress = Callable[[str, int, int], None]

#: The title of a paper's report goes before this.
PAPER = ": measured again"
#: Names of plots for the head, the first that is there: accuracy against time, or its profiles.
FIRST_PLOTS = ("accuracy-against-time", "accuracy-profiles")

#: Words for surfaces by origin.
_KINDS: Mapping[MeshOrigin, str] = {
    "model": "of the paper's models",
    "stand-in": "stand-ins for models of the paper",
    "surface": "not in the paper",
}


@dataclass(frozen=True)
class _Run:
    """A run with what was seen of its surfaces; `shown` have a page each."""

    evidence: Evidence
    folder: Path
    shown: Sequence[MeasuredSurface]
    seen: Mapping[str, Inspection]

    def plots(self, *names: str) -> list[Item]:
        """Return declared plots, drawn."""
        return drawn([declared_plot(self.evidence, name) for name in names], self.folder)

    def tables(self, *names: str) -> list[Item]:
        """Return declared tables."""
        made = (declared_table(self.evidence, name) for name in names)
        return [table for table in made if table]


#: A section of a report; None if the run has nothing for it.
_Maker = Callable[[_Run], Section | None]


def build_report(
    evidence: Evidence, folder: Path, command: str, progress: Progress = lambda *_: None
) -> Report:
    """Compute the contents of a run's report, and draw its figures into `folder`."""
    of_paper = is_of_the_paper(evidence)
    over_many = many_surfaces.is_many(evidence) and not of_paper
    shown = many_surfaces.hardest(evidence) if over_many else evidence.surfaces
    n = len(shown) + 1
    inspections: dict[str, Inspection] = {}
    pages = []
    inspected = each(partial(inspect_surface, evidence, folder), shown)
    for k, surface in enumerate(shown):
        progress(f"surface {surface.title}", k, n)
        seen = inspections[surface.mesh_hash] = next(inspected)
        pages.append(_page(evidence, surface, seen, folder))
    progress("tables, plots and claims", n - 1, n)
    run = _Run(evidence, folder, shown, inspections)
    makers = _OF_A_PAPER if of_paper else _OVER_MANY if over_many else _OF_OWN_SURFACES
    sections = [section for make in makers if (section := make(run))]
    sections += exhibit_sections(evidence, folder)
    if over_many:
        sections.append(Section("not-ok", "Cells without a valid map", (not_ok(evidence),)))
    sections.append(Section("surfaces", "Surfaces", (), tuple(pages)))
    progress("done", n, n)
    tested = [item for s in sections for item in s.items if isinstance(item, Claim)]
    head = many_findings(evidence) if over_many else findings(evidence, inspections, tested)
    return Report(
        title=evidence.paper.title + PAPER if of_paper else _title_of_own_surfaces(evidence),
        findings=replace(head, plot=_first_plot(sections)),
        command=command,
        facts=tuple(facts(evidence)),
        sections=tuple(sections),
        records=evidence.rows,
        paper=evidence.paper if of_paper else None,
    )


def _first_plot(sections: Sequence[Section]) -> Figure | None:
    """Return the plot for the head of the report, from the sections on the run as a whole."""
    chosen = [section for section in sections if section.name in ("beyond", "results", "many")]
    plots = [i for s in chosen for i in s.items if isinstance(i, Figure)]
    return next((f for f in plots if f.name in FIRST_PLOTS), plots[0] if plots else None)


def is_of_the_paper(evidence: Evidence) -> bool:
    """Whether a run was made for the paper, and not over surfaces of the user's own.

    It was if the paper is asked for, or all of its surfaces are models of the paper or stand-ins
    for them, or, with a stand-in among them, more than half. Nine meshes of which eight are public
    models of the paper are the user's own run: it has no claims, and no gaps for other models.
    """
    if evidence.asked is not None:
        return True
    models, others = len(evidence.models), len(evidence.others)
    has_stand_in = any(surface.origin == "stand-in" for surface in evidence.models)
    return models > others if has_stand_in else not others


def _precision_words(evidence: Evidence) -> str:
    """Return the precision that cells were measured to, if any."""
    goals = sorted({r.cell.precision for r in evidence.records if r.cell.precision is not None})
    if not goals:
        return ""
    wanted = " or ".join(f"±{100 * goal:g} %" for goal in goals)
    unstable = sum(bool(evidence.row(record)["unstable"]) for record in evidence.records)
    return f" (until {wanted} or the time limit was reached; {unstable} unstable cells)"


def facts(evidence: Evidence) -> list[tuple[str, str]]:
    """Return the facts at the head of a report."""
    statuses = Counter(record.outcome.status for record in evidence.records)
    dates = sorted(record.started_at[:10] for record in evidence.records)
    rounds = sorted({len(r.outcome.rounds) for r in evidence.records if r.outcome.rounds})
    origins = Counter(surface.origin for surface in evidence.surfaces)
    rows = [
        ("run", str(evidence.store.folder)),
        ("measured", " to ".join(dict.fromkeys((dates[0], dates[-1])))),
        ("cells", ", ".join(f"{count} {status}" for status, count in statuses.most_common())),
        ("surfaces", ", ".join(f"{count} {_KINDS[o]}" for o, count in origins.items())),
        ("families", f"{evidence.families}: what a statement on other surfaces rests on"),
        ("algorithms", ", ".join(series.label for series in evidence.series)),
        ("solves", ", ".join(evidence.policies)),
        ("rounds", (", ".join(map(str, rounds)) or "none") + _precision_words(evidence)),
        ("threads", ", ".join(sorted({str(r.cell.threads) for r in evidence.records}))),
        ("backend", ", ".join(sorted({r.cell.backend for r in evidence.records}))),
    ]
    if older := len(evidence.superseded):
        rows.append(("left out", f"{older} older records of cells measured again"))
    used = {record.environment for record in evidence.records}
    environments = evidence.store.environments()
    rows += [("machine", _machine(about)) for key, about in environments.items() if key in used]
    rows.append(("report by", f"cembench {installed_version()}"))
    return rows


def _machine(about: Mapping[str, object]) -> str:
    memory = about.get("memory_bytes")
    size = f", {memory / 2**30:.0f} GiB" if isinstance(memory, int) else ""
    libraries = about.get("libraries")
    versions = ""
    if isinstance(libraries, dict):
        chosen = [f"{k} {libraries[k]}" for k in ("numpy", "scipy", "cvxopt") if libraries.get(k)]
        versions = f"; {', '.join(chosen)}"
    git = about.get("git")
    commit = f"; commit {str(git.get('commit'))[:12]}" if isinstance(git, dict) else ""
    named = f"{about['machine']}: " if about.get("machine") else ""
    return (
        f"{named}{about.get('cpu')}, {about.get('cores')} cores{size}; Python {about.get('python')}"
        f"{versions}{commit}"
    )


def not_ok(evidence: Evidence) -> Table | Text:
    """Return a table of cells that did not end ok or are missing; a sentence if there is none."""
    declared = own_tables()["not-ok"]
    table = declared_table(evidence, "not-ok")
    held, cells = evidence.superseded | evidence.by_key.keys(), len(evidence.records)
    again = "requested but not finished: run the same `cembench run` again to resume"
    missing = tuple(
        tuple(map(words, (cell.mesh, cell.algorithm, cell.solves, "missing", again)))
        for cell in evidence.store.plan()
        if cell.key not in held
    )
    if table is None and not missing:
        return Text(f"All {cells} cells ended ok.")
    rows = table.rows if table else ()
    title = f"{len(rows)} of {cells} cells did not end ok; {len(missing)} are missing"
    columns = tuple(column.heading for column in declared.columns)
    return Table("not-ok", title, columns, (*rows, *missing), declared.caption)


def _paper_summary(run: _Run) -> Section:
    evidence = run.evidence
    marks = "; ".join(
        f"{words}{f' ({mark})' if mark else ''}" for words, mark in ORIGINS.values() if words
    )
    items: list[Item] = [
        Text(
            "Every number is measured here unless it is marked otherwise. Origins of numbers: "
            f"{marks}. A dagger marks a misprint, an exclamation mark an unstable time."
        )
    ]
    if sentence := stand_ins_words(evidence):
        items.append(Text(sentence))
    items.append(not_ok(evidence))
    return Section("summary", "What this is", tuple(items))


def stand_ins_words(evidence: Evidence) -> str:
    """Return what the run's stand-ins stand for, and what not; "" if it has none."""
    standing = [s for s in evidence.models if s.origin == "stand-in"]
    if not standing:
        return ""
    thin = sum(s.non_delaunay_share > 0 for s in standing)
    ratios = _energies_over_printed(evidence)
    energy = (
        f"E_C by {evidence.reference.upper()} is {min(ratios):.2g} to {max(ratios):.2g} times the "
        "printed one, and "
        if ratios
        else ""
    )
    begin = (
        f"{len(standing)} of {len(evidence.models)} surfaces are stand-ins for the paper's models"
    )
    if all(s.fitted for s in standing):
        return (
            f"{begin}: generated surfaces with their counts of triangles and boundary vertices, as "
            f"hard to map as the printed figures say ({energy}{thin} of {len(standing)} have edges "
            "that are not Delaunay), but of other shapes. What they were fitted to is marked and "
            "decides nothing; docs/surfaces.md says how well they predict the rest."
        )
    return (
        f"{begin}. They stand in for the models' counts, triangles and boundary vertices, and so "
        f"for seconds; not for their difficulty: {energy}{thin} of {len(standing)} have edges that "
        "are not Delaunay. Their energies and angles belong to other surfaces. docs/surfaces.md "
        "names the real surface nearest to each row in counts and difficulty."
    )


def _energies_over_printed(evidence: Evidence) -> list[float]:
    """Return the stand-ins' E_C by the reference over that printed for the model, where known."""
    in_print, frame = printed(evidence), evidence.frame
    if "conformal_energy" not in in_print or in_print.empty:
        return []
    ours = frame[frame["ok"] & frame["reference"] & frame["main"] & (frame["origin"] == "stand-in")]
    ours = ours.drop_duplicates("place").set_index("model")["conformal_energy"]
    theirs = in_print[in_print["algorithm"] == evidence.reference].set_index("model")
    ratios: list[float] = (ours / theirs["conformal_energy"].reindex(ours.index)).dropna().tolist()
    return ratios


def _tables(run: _Run) -> Section | None:
    """Return the paper's tables, each comparison of seconds with its averages and certainty."""
    evidence, tables = run.evidence, run.evidence.paper.printed
    items: list[Item] = []
    for number in sorted(tables):
        items += printed_tables(evidence, number)
        if any(figure.column == "seconds" for figure in tables[number].figures):
            items += policies.work_tables(evidence)
    numbers = sorted(number for number, table in tables.items() if table.figures)
    title = f"Tables {numbers[0]} to {numbers[-1]}" if numbers[1:] else ""
    title = title or "".join(f"Table {number}" for number in numbers)
    return Section("tables", title, tuple(items)) if items else None


def _claims(run: _Run) -> Section:
    tested, evidence = claims(run.evidence, run.seen), run.evidence
    if evidence.asked and tested and not any(claim.parts for claim in tested):
        names = ", ".join(evidence.paper.algorithms)
        raise ParameterError(
            f"no claim of {evidence.paper.title!r} is about a surface of this run: its algorithms "
            f"are {names}, its models {', '.join(evidence.paper.models) or 'any surfaces'}. "
            "`cembench paper check` tests the paper's folder."
        )
    glance = [in_short(tested), at_a_glance(tested)] if tested else []
    return Section("claims", "Claims of the paper", (*glance, *tested))


#: Plots of time, and tables of what does not compare with the rest.
_TIMES = ("performance-profile", "accuracy-against-time", "time-by-phase")


def _beside(run: _Run) -> list[Item]:
    """Return the tables of maps that do not go to the disk, and of programs of others."""
    external = any(record.external for record in run.evidence.records)
    return run.tables("other-targets", *(["beside-others"] if external else []))


def _policies(run: _Run) -> list[Item]:
    """Return tables and a plot of both policies; empty if the run has one."""
    if not set(policies.BOTH) <= set(run.evidence.policies):
        return []
    tables = run.tables("reuse-against-backslash", "speedup-by-policy")
    return [*tables, *run.plots("reuse-against-backslash")]


def _certain(run: _Run) -> list[Item]:
    return [t for p in run.evidence.policies for t in policies.sure_speedups(run.evidence, p)]


def _beyond_the_paper(run: _Run) -> Section:
    both = _policies(run) or [policies.one_policy_gap(run.evidence)]
    contests = contests_of(run.evidence, run.evidence.policies[0])
    ranks: list[Item] = [Text(contest_words(one)) for one in contests]
    ranks += rank_tables(contests)
    scattered = [Text(words) for words in [scatter_words(run.evidence.records)] if words]
    items = (*ranks, *scattered, *run.plots(*_TIMES), *both, *_beside(run))
    return Section("beyond", "Beyond the paper", items)


def _title_of_own_surfaces(evidence: Evidence) -> str:
    """Return a title for a run on surfaces that are not the paper's."""
    algorithms = len({series.algorithm for series in evidence.series})
    surfaces = evidence.surfaces
    named = [surface.title for surface in surfaces]
    many = surfaces_words(len(named), evidence.families)
    of = " and ".join(named) if len(named) < 3 else many
    return f"{of}, mapped by {algorithms} algorithm{'s' if algorithms > 1 else ''}"


def _own_results(run: _Run) -> Section:
    """Return the section for other surfaces, without the paper's columns and claims."""
    evidence = run.evidence
    items: list[Item] = [
        figures_table(evidence, surface, f"{evidence.name_of(surface)}-overview")
        for surface in evidence.surfaces
    ]
    items += policies.work_tables(evidence)
    items += (*run.plots(*_TIMES), *_certain(run), *_policies(run), *_beside(run))
    of_models = [paper_plot(evidence, name, run.seen) for name in reversed(OF_MODELS)]
    items += (*drawn(of_models, run.folder), *run.plots("cost-by-faces"))
    return Section("results", "Results", tuple(items))


def _costs(run: _Run) -> Section:
    """Return the section on cost over all surfaces."""
    # The profile of the time is beside those of accuracy.
    items = (*run.plots(*_TIMES[1:]), *_certain(run), *_policies(run))
    exponents = (*run.plots("cost-by-faces"), exponents_table(run.evidence))
    return Section("costs", "What maps cost", (*items, *exponents))


_OF_A_PAPER: tuple[_Maker, ...] = (
    _paper_summary,
    lambda run: machines_section(run.evidence),
    _tables,
    _claims,
    lambda run: figures_section(run.evidence, run.seen, run.folder),
    _beyond_the_paper,
)
_OF_OWN_SURFACES: tuple[_Maker, ...] = (
    lambda run: Section("summary", "What this is", (not_ok(run.evidence),)),
    lambda run: machines_section(run.evidence),
    _own_results,
)
_OVER_MANY: tuple[_Maker, ...] = (
    lambda run: machines_section(run.evidence),
    lambda run: many_surfaces.many_section(run.evidence, run.folder),
    lambda run: many_surfaces.hard_section(run.evidence, run.shown, run.seen),
    _costs,
)


def _page(evidence: Evidence, surface: MeasuredSurface, seen: Inspection, folder: Path) -> Section:
    page, plot = surface_page(evidence, surface, seen)
    return replace(page, items=(*page.items, *drawn([plot], folder)))
