"""The whole report of a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from cembench import __version__
from cembench.report.content import policies
from cembench.report.content.both_policies import has_both_policies
from cembench.report.content.claims import claims
from cembench.report.content.evidence import REFERENCE, Evidence, MeasuredSurface, model_surface
from cembench.report.content.exhibits import exhibit_gaps, exhibit_sections
from cembench.report.content.exponents import exponents_table
from cembench.report.content.failures import not_ok
from cembench.report.content.findings import findings
from cembench.report.content.inspection import Inspection, inspect_surface
from cembench.report.content.linear_algebra_work import work_tables
from cembench.report.content.machines import machines_section
from cembench.report.content.many.found import many_findings
from cembench.report.content.many.section import is_many, many_section
from cembench.report.content.many.worst import hardest
from cembench.report.content.printed_tables import printed_tables
from cembench.report.content.rates import rates_tables
from cembench.report.content.sure_speedups import sure_speedups
from cembench.report.content.surface_page import figures_table, surface_page
from cembench.report.declared import declared_table
from cembench.report.declared_plots import declared_plot, own_plots, plot_and_models
from cembench.report.document import ORIGINS, Figure, Gap, Item, Report, Section, Table, Text
from cembench.report.plots import Plot, write_plot
from cembench.report.shared_drawing import each
from cembench.results.papers import Picture
from cembench.results.records import MeshOrigin

#: Receives progress: a text, the number of finished steps, and their total.
Progress = Callable[[str, int, int], None]
Inspections = Mapping[str, Inspection]

#: The title of a paper's report goes before this.
PAPER = ": its claims, tables and figures, measured"
#: Names of plots for the head, the first that is there: accuracy against time, or its profiles.
FIRST_PLOTS = ("accuracy-against-time", "accuracy-profiles")

#: Words for surfaces by origin.
_KINDS: Mapping[MeshOrigin, str] = {
    "model": "of the paper's models",
    "stand-in": "stand-ins for models of the paper",
    "surface": "not in the paper",
}


def build_report(
    evidence: Evidence, folder: Path, command: str, progress: Progress = lambda *_: None
) -> Report:
    """Compute the contents of a run's report, and draw its figures into `folder`."""
    of_paper = is_of_the_paper(evidence)
    many = is_many(evidence) and not of_paper
    shown = hardest(evidence, evidence.policies[0]) if many else evidence.surfaces
    n = len(shown) + 1
    inspections: dict[str, Inspection] = {}
    pages = []
    inspected = each(partial(inspect_surface, evidence, folder), shown)
    for k, surface in enumerate(shown):
        progress(f"surface {surface.title}", k, n)
        seen = inspections[surface.mesh_hash] = next(inspected)
        pages.append(_page(evidence, surface, seen, folder))
    progress("tables, plots and claims", n - 1, n)
    tested = claims(evidence, inspections) if of_paper else []
    beyond = _beyond_the_paper(evidence, folder, by_surface=not many, of_paper=of_paper)
    first = _first_plot(beyond)
    sections = [] if many else [_summary(evidence, of_paper=of_paper)]
    machines = machines_section(evidence)
    sections += [machines] if machines else []
    if many:
        about_all = many_section(evidence, shown, inspections, folder)
        first = _first_plot(about_all)
        sections.append(about_all)
        sections.append(_costs(evidence, folder, beyond))
    elif of_paper:
        sections += [
            _tables(evidence),
            Section("claims", "Claims of the paper", tuple(tested)),
            _figures(evidence, inspections, folder),
            beyond,
        ]
    else:
        sections.append(_own(evidence, inspections, folder, beyond))
    sections += exhibit_sections(evidence, folder)
    if many:
        sections.append(Section("not-ok", "Cells without a valid map", (not_ok(evidence),)))
    sections.append(Section("surfaces", "Surfaces", (), tuple(pages)))
    progress("done", n, n)
    found = many_findings(evidence) if many else findings(evidence, inspections, tested)
    return Report(
        title=evidence.paper.title + PAPER if of_paper else _title_of_own_surfaces(evidence),
        findings=replace(found, plot=first),
        command=command,
        facts=tuple(facts(evidence)),
        sections=tuple(sections),
        records=evidence.rows,
        paper=evidence.paper.citation if of_paper else None,
    )


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
    found = [
        ("run", str(evidence.store.folder)),
        ("measured", " to ".join(dict.fromkeys((dates[0], dates[-1])))),
        ("cells", ", ".join(f"{count} {status}" for status, count in statuses.most_common())),
        ("surfaces", ", ".join(f"{count} {_KINDS[o]}" for o, count in origins.items())),
        ("algorithms", ", ".join(series.label for series in evidence.series)),
        ("solves", ", ".join(evidence.policies)),
        ("rounds", (", ".join(map(str, rounds)) or "none") + _precision_words(evidence)),
        ("threads", ", ".join(sorted({str(r.cell.threads) for r in evidence.records}))),
        ("backend", ", ".join(sorted({r.cell.backend for r in evidence.records}))),
    ]
    if evidence.superseded:
        found.append(("left out", f"{evidence.superseded} older records of cells measured again"))
    used = {record.environment for record in evidence.records}
    for key, machine in evidence.store.environments().items():
        if key in used:
            found.append(("machine", _machine(machine)))
    found.append(("report by", f"cembench {__version__}"))
    return found


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


def _summary(evidence: Evidence, *, of_paper: bool) -> Section:
    if not of_paper:
        return Section("summary", "What this is", (not_ok(evidence),))
    marks = "; ".join(
        f"{words}{f' ({mark})' if mark else ''}" for words, mark in ORIGINS.values() if words
    )
    items: list[Item] = [
        Text(
            "Every number is measured here unless it is marked otherwise. Origins of numbers: "
            f"{marks}. A dagger marks a misprint, an exclamation mark an unstable time."
        )
    ]
    if not any(s.origin == "model" for s in evidence.models):
        items.append(
            Text(
                "No model of the paper is in this run. Its rows are measured on stand-ins with the "
                "same number of triangles and boundary vertices: times are similar, but energies "
                "and angles belong to other surfaces."
            )
        )
    items.append(not_ok(evidence))
    return Section("summary", "What this is", tuple(items))


def _tables(evidence: Evidence) -> Section:
    """Return the paper's tables, each comparison of seconds with its averages and certainty."""
    printed = evidence.paper.printed
    items: list[Item] = []
    for number in sorted(printed):
        if printed[number].compares:
            items += rates_tables(evidence, number)
        else:
            items += printed_tables(evidence, number)
        if any(figure.column == "seconds" for figure in printed[number].figures):
            items += work_tables(evidence)
    numbers = sorted(evidence.paper.tables)
    return Section("tables", f"Tables {numbers[0]} to {numbers[-1]}", tuple(items))


def _figures(evidence: Evidence, inspections: Inspections, folder: Path) -> Section:
    items: list[Item] = []
    gaps: list[Gap] = []
    for picture in evidence.paper.pictures:
        found = _pictures(evidence, inspections, picture)
        if found:
            items += found
        else:
            gaps.append(model_gap(evidence, picture.model, picture.figure, inspections))
    for name in ("energy-by-iteration", "angle-histograms"):
        plot, lacking = _of_models(evidence, name, inspections)
        items += _drawn([plot], folder)
        gaps += lacking
    items += _declared(evidence, folder, "cost-by-faces")
    items.append(exponents_table(evidence))
    items += _declared(evidence, folder, "energy-over-models", "angles-over-models")
    gaps += exhibit_gaps(evidence)
    return Section("figures", "Figures of the paper", (*items, *gaps))


def _pictures(evidence: Evidence, inspections: Inspections, wanted: Picture) -> list[Figure]:
    """Return CEM's pictures of a model, as in the paper."""
    figure, model = wanted.figure, wanted.model
    surface = evidence.surface_for_model(model)
    series = evidence.series_of(REFERENCE)
    if surface is None or series is None:
        return []
    seen = inspections[surface.mesh_hash]
    checkerboard = seen.checkerboards.get(series.label)
    if checkerboard is None:
        return []
    kinds = {"checkerboard": checkerboard, "curvature": seen.curvature, "mesh": seen.mesh}
    chosen = [kinds[kind] for kind in wanted.shows]
    return [
        Figure(
            f"{figure.lower().replace(' ', '-')}-{k + 1}",
            f"{model} ({surface.origin}) and its map by CEM: {picture.title}",
            picture.files,
            picture.caption,
            alternative=picture.alternative,
            paper=figure,
        )
        for k, picture in enumerate(chosen)
        if picture
    ]


def _beyond_the_paper(
    evidence: Evidence, folder: Path, *, by_surface: bool, of_paper: bool
) -> Section:
    # Over many surfaces, the profile of the time stands beside those of accuracy.
    profiles = ["performance-profile"] if by_surface else []
    items = _declared(evidence, folder, *profiles, "accuracy-against-time", "time-by-phase")
    if not of_paper:  # otherwise it is below Table 2
        for policy in evidence.policies:
            items += sure_speedups(evidence, policy)
    if has_both_policies(evidence):
        items += [policies.policies_table(evidence), policies.speedups_table(evidence)]
        items += _declared(evidence, folder, "reuse-against-backslash")
    else:
        items.append(policies.one_policy_gap(evidence))
    if by_surface:
        external = any(record.external for record in evidence.records)
        names = ("other-targets", *(("beside-others",) if external else ()))
        items += [table for name in names if (table := declared_table(evidence, name))]
    return Section("beyond", "Beyond the paper", tuple(items))


def _title_of_own_surfaces(evidence: Evidence) -> str:
    """Return a title for a run on surfaces that are not the paper's."""
    algorithms = len({series.algorithm for series in evidence.series})
    surfaces = evidence.surfaces
    named = [surface.title for surface in surfaces]
    of = " and ".join(named) if len(named) < 3 else f"{len(named)} surfaces"
    return f"{of}, mapped by {algorithms} algorithm{'s' if algorithms > 1 else ''}"


def _own(evidence: Evidence, inspections: Inspections, folder: Path, beyond: Section) -> Section:
    """Return the section for other surfaces, without the paper's columns and claims."""
    items: list[Item] = [
        figures_table(evidence, surface, f"{evidence.name_of(surface)}-overview")
        for surface in evidence.surfaces
    ]
    items += work_tables(evidence)
    items += [item for item in beyond.items if not isinstance(item, Gap)]
    for name in ("angle-histograms", "energy-by-iteration"):
        items += _drawn([_of_models(evidence, name, inspections)[0]], folder)
    items += _declared(evidence, folder, "cost-by-faces")
    return Section("results", "Results", tuple(items))


def _costs(evidence: Evidence, folder: Path, beyond: Section) -> Section:
    """Return the section on cost over all surfaces."""
    items: list[Item] = [item for item in beyond.items if isinstance(item, Table | Figure)]
    items += _declared(evidence, folder, "cost-by-faces")
    items.append(exponents_table(evidence))
    return Section("costs", "What maps cost", tuple(items))


def _first_plot(section: Section) -> Figure | None:
    """Return the plot for the head of the report, from this section."""
    figures = [item for item in section.items if isinstance(item, Figure)]
    return next((f for f in figures if f.name in FIRST_PLOTS), figures[0] if figures else None)


def _page(evidence: Evidence, surface: MeasuredSurface, seen: Inspection, folder: Path) -> Section:
    page, plot = surface_page(evidence, surface, seen)
    items = (*page.items, *_drawn([plot], folder))
    return Section(page.name, page.title, items, page.sections, page.page)


def _declared(evidence: Evidence, folder: Path, *names: str) -> list[Item]:
    known = own_plots(evidence)
    return _drawn([declared_plot(evidence, name) for name in names if name in known], folder)


def _of_models(
    evidence: Evidence, name: str, inspections: Inspections
) -> tuple[Plot | None, list[Gap]]:
    """Return a plot of the paper's models in the run, and a gap for each missing one."""
    spec = own_plots(evidence).get(name)
    if spec is None:
        return None, []
    plot, drawn = plot_and_models(evidence, name, spec, seen=inspections)
    absent = [model for model in spec.models if model not in drawn]
    return plot, [model_gap(evidence, model, spec.figure, inspections) for model in absent]


def model_gap(evidence: Evidence, model: str, figure: str, seen: Inspections) -> Gap:
    """Return the gap for a model without a map by CEM in the run, or without the map itself."""
    surface = evidence.surface_for_model(model)
    series = evidence.series_of(REFERENCE)
    record = evidence.find(surface, series) if surface and series else None
    if surface and record and record.outcome.status == "ok" and not seen[surface.mesh_hash].kept:
        return Gap(f"{figure}: {model}", seen[surface.mesh_hash].missing_reason)
    why = (
        evidence.missing_reason(record)
        if surface
        else "no surface of this run is or stands in for it"
    )
    return Gap(
        f"{figure}: {model}",
        f"no map of {model} by CEM: {why}.",
        f"cembench run --surfaces {model_surface(model)} -a cem -o {evidence.store.folder}",
    )


def _drawn(plots: Sequence[Plot | None], folder: Path) -> list[Item]:
    return [write_plot(plot, folder) for plot in plots if plot]
