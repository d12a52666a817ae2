"""The findings at the head of a report: sentences, tables, suspect maps and key figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from cembench.report.content.evidence import ANGLE, Evidence
from cembench.report.content.paper_head import head_table, headline
from cembench.report.content.standings import (
    contest_figures,
    contest_words,
    contests_of,
    listed,
    rank_tables,
    surfaces_words,
)
from cembench.report.declared import declared_table
from cembench.report.document import FAILING, VERDICTS, Claim, Figure, Finding, Findings, Sentence
from cembench.results.stability import outlier_lines, scatter_words, stability_words

if TYPE_CHECKING:
    from cembench.report.content.inspection import Inspection


def findings(
    evidence: Evidence, inspections: Mapping[str, Inspection], claims: Sequence[Claim]
) -> Findings:
    """Return the head of a report.

    With `claims`, those of the paper, it has the main ones, all verdicts, and the paper's own
    algorithm; without them who has the smallest angle errors and who is the fastest, for each
    target under the run's first policy, and the user's own surfaces.
    """
    contests = contests_of(evidence, evidence.policies[0])
    words: list[Sentence] = []
    if claims:
        main = head_table(evidence, claims)
        tables = [main] if main else []
        main_words = headline(evidence)
        words = [*([(main_words,)] if main_words else []), verdicts_counted(claims)]
        shown, figures = evidence.reference_label, []
    else:
        own = declared_table(evidence, "own-surfaces")
        tables = [*rank_tables(contests), *([own] if own else [])]
        words = [(contest_words(one),) for one in contests] or [("No map to compare.",)]
        shown = contests[0]["best"] if contests else evidence.reference_label
        figures = contest_figures(contests[0]) if contests else []
    about = [stability_words(evidence.records), "" if claims else scatter_words(evidence.records)]
    return Findings(
        (*words, *((one,) for one in about if one)),
        tuple(outlier_lines(evidence.records)),
        tuple(tables),
        (*figures, _ended(evidence)),
        _picture(evidence, inspections, shown),
    )


def _ended(evidence: Evidence) -> Finding:
    ok = sum(record.outcome.status == "ok" for record in evidence.records)
    return Finding(f"{ok} of {len(evidence.records)}", "cells ended with a valid map")


def _picture(
    evidence: Evidence, inspections: Mapping[str, Inspection], label: str
) -> Figure | None:
    """Return a picture by an algorithm, of the largest surface with one; models are preferred."""
    by_size = sorted(evidence.surfaces, key=lambda s: (s.origin == "stand-in", -s.faces))
    for wanted in (label, evidence.reference_label):
        for surface in by_size:
            inspection = inspections.get(surface.mesh_hash)
            if inspection and wanted in inspection.checkerboards:
                return inspection.checkerboards[wanted]
    return None


def many_findings(evidence: Evidence) -> Findings:
    """Return who mapped everything, whose maps are the best for each target, and suspect maps.

    All of it is under the run's first policy.
    """
    policy = evidence.policies[0]
    main = evidence.frame[evidence.frame["main"] & (evidence.frame["solves"] == policy)]
    ok = main.sort_values("series", kind="stable").groupby("label", sort=False)["ok"]
    whole = [str(label) for label, all_ok in ok.all().items() if all_ok]
    contests = contests_of(evidence, policy)
    sentences = [contest_words(one) for one in contests]
    sentences.append(
        f"Over {surfaces_words(len(evidence.surfaces), evidence.families)}, {len(whole)} of "
        f"{len(ok)} algorithms have a "
        f"valid map of every one that they take{f': {listed(whole)}' if whole else ''}."
    )
    figures = [Finding(f"{100 * main['ok'].mean():.1f} %", f"of {len(main)} cells are valid maps")]
    figures += contest_figures(contests[0]) if contests else []
    valid = main[main["ok"]]
    if valid[ANGLE].notna().any():
        worst = valid.loc[valid[ANGLE].idxmax()]
        where = f"{worst['label']}, {worst['surface']}"
        figures.append(
            Finding(f"{worst[ANGLE]:.1f}°", f"the worst mean angle error of a valid map: {where}")
        )
    sentences.append(stability_words(evidence.records))
    return Findings(
        tuple((words,) for words in sentences if words),
        tuple(outlier_lines(evidence.records)),
        tuple(rank_tables(contests)),
        figures=tuple(figures),
    )


def verdicts_counted(claims: Sequence[Claim]) -> Sentence:
    """Return the numbers of all verdicts; failing claims come first, as links."""
    parts: list[str | Claim] = [f"Of {len(claims)} claim{'s' * (len(claims) > 1)} of the paper, "]
    for verdict, (one, several) in VERDICTS.items():
        claims_of = [claim for claim in claims if claim.verdict == verdict]
        if claims_of:
            parts.append(f"{'; ' if len(parts) > 1 else ''}{len(claims_of)} ")
            parts.append(one if len(claims_of) == 1 else several)
        for k, claim in enumerate(claims_of if verdict == FAILING else ()):
            parts += [", " if k else ": ", claim]
    return (*parts, ".")
