"""Claims about the accuracy of the maps."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from cembench.report.content.claims import Found, Inspections
from cembench.report.content.evidence import REFERENCE, Evidence, MeasuredSurface
from cembench.results.records import Record

#: "Similar" means within this share of the smallest of the three; "slightly", by at most that.
SIMILAR = 0.25


def cem_records(evidence: Evidence) -> list[tuple[MeasuredSurface, Record]]:
    """Return CEM's records that ended ok or invalid, those with a map to judge."""
    series = evidence.series_of(REFERENCE)
    found = [(s, evidence.find(s, series)) for s in evidence.surfaces] if series else []
    return [(s, r) for s, r in found if r is not None and r.outcome.metrics]


def no_folding(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that CEM's maps have no folds, before they are repaired and after."""
    found = cem_records(evidence)
    after = {s: r.outcome.metrics.get("flipped_triangles") for s, r in found}
    before = {s: r.outcome.folded_before_repair for s, r in found}
    counted = {s: number for s, number in before.items() if number is not None}
    clean = [s for s in after if after[s] == 0 and not before[s]]
    figures = (
        f"Before the repair, {_folds(counted)}; in the maps that are compared, {_folds(after)}."
    )
    return Found(len(clean), len(found), figures, [s for s, _ in found])


def _folds(counts: Mapping[MeasuredSurface, float | None]) -> str:
    """Return on how many surfaces triangles are folded, and how many triangles on each."""
    folded = {s: number for s, number in counts.items() if number != 0}
    listed = "; ".join(f"{s.title}: {number}" for s, number in folded.items())
    total = sum(number or 0 for number in folded.values())
    told = f"{total} triangles are folded on {len(folded)} of {len(counts)} surfaces"
    return told + (f" ({listed})" if listed else "")


def angles_preserved(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that CEM's maps preserve angles."""
    found = cem_records(evidence)
    errors = [r.outcome.metrics.get("angle_error_mean_deg") for _, r in found]
    known = [float(e) for e in errors if e is not None]
    small = sum(e < 5 for e in known)
    words = (
        f"mean distortion below 5 degrees on {small} of {len(known)}; from {min(known):.2f} to "
        f"{max(known):.2f}, median {float(np.median(known)):.2f} degrees"
        if known
        else "No map by CEM in this run."
    )
    return Found(small, len(known), words, [s for s, _ in found])


def below_one_degree(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that most angular distortions of the paper's faces are below one degree."""
    series = evidence.series_of(REFERENCE)
    label = series.label if series else ""
    shares = {
        surface: inspections[surface.mesh_hash].angles[label].below_one
        for surface in evidence.surfaces
        if label in inspections[surface.mesh_hash].angles
    }
    faces = evidence.paper.plotted("angle_histograms").models
    named = {s: share for s, share in shares.items() if s.paper_row in faces}
    held = sum(share > 0.5 for share in named.values())
    every = sum(share > 0.5 for share in shares.values())
    listed = "; ".join(f"{s.title}: {share:.1%}" for s, share in named.items())
    figures = (listed or "None of the four faces is in this run") + (
        f". This holds on {every} of all {len(shares)} surfaces of the run."
    )
    return Found(held, len(named), figures, list(named))


def energy_similar(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that the energies of FDM, LDM and CEM are similar."""
    return _similar(evidence, "conformal_energy")


def deviation_similar(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that the standard deviations by FDM, LDM and CEM are similar."""
    return _similar(evidence, "angle_error_sd_deg")


def _similar(evidence: Evidence, metric: str) -> Found:
    found = _triples(evidence, metric)
    spreads = {s: max(values) / min(values) - 1 for s, values in found.items() if min(values) > 0}
    held = sum(spread <= SIMILAR for spread in spreads.values())
    worst = max(spreads, key=lambda s: spreads[s], default=None)
    figures = (
        f"{held} of {len(spreads)} models; the widest apart is {worst.title}: "
        f"{spreads[worst]:.0%}, the median {float(np.median(list(spreads.values()))):.1%}"
        if worst
        else "No model with all three in this run."
    )
    return Found(held, len(spreads), figures, list(spreads), remark=_reading_of_fdm(evidence))


def means_slightly_better(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that the mean distortions of FDM and LDM are slightly better than CEM's."""
    found = _triples(evidence, "angle_error_mean_deg")
    better, held = 0, 0
    gaps = []
    for fdm, ldm, cem in found.values():
        gap = cem / min(fdm, ldm) - 1
        gaps.append(gap)
        better += fdm <= cem and ldm <= cem
        held += fdm <= cem and ldm <= cem and gap <= SIMILAR
    figures = (
        f"both not above CEM's on {better} of {len(found)} models, and close on {held}; CEM's is "
        f"{float(np.median(gaps)):+.1%} from the better one in the median"
        if gaps
        else "No model with all three in this run."
    )
    return Found(held, len(found), figures, list(found))


def _reading_of_fdm(evidence: Evidence) -> str:
    """Return a remark on how FDM was run: as its authors' public program, or corrected."""
    series = evidence.series_of("fdm")
    records = [evidence.find(surface, series) for surface in evidence.models] if series else []
    public = [bool(r.cell.parameters.get("public_program")) for r in records if r is not None]
    if not public:
        return ""
    where = "" if all(public) else f" on {sum(public)} of {len(public)} surfaces"
    return (
        f"FDM is its authors' public program{where}, which turns the map by a + b/2 where the "
        "middle (a + b)/2 of an edge is meant: the figures printed for the paper's models contain "
        "that error."
        if any(public)
        else "FDM is the corrected reading; the printed figures contain a slip of its authors' "
        "public program, which fdm.public_program=true reproduces."
    )


def _triples(evidence: Evidence, metric: str) -> dict[MeasuredSurface, tuple[float, ...]]:
    """Return the figures of FDM, LDM and CEM on the models where all three ended ok."""
    value: Callable[[Record | None], float | None] = lambda r: (  # noqa: E731
        r.outcome.metrics.get(metric) if r is not None and r.outcome.status == "ok" else None
    )
    found = {}
    chosen = [evidence.series_of(a) for a in ("fdm", "ldm", REFERENCE)]
    for surface in evidence.models:
        values = [value(evidence.find(surface, s)) for s in chosen if s]
        if len(values) == 3 and all(values):
            found[surface] = tuple(float(v) for v in values if v is not None)
    return found
