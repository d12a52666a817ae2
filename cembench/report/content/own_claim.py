"""The paper's own claim as measured, and the count of all verdicts: the head of its report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from cembench.report.content.averages import mean_rate
from cembench.report.content.claims import under
from cembench.report.content.evidence import Evidence
from cembench.report.content.rates import measured_rates
from cembench.report.content.speedup_significance import paired_rounds
from cembench.report.document import VERDICTS, Claim, Sentence
from cembench.results.families import FEWEST_FAMILIES, rate_interval
from cembench.results.intervals import DEFAULT_ROUNDS

#: Verdicts whose claims are named in the count.
_NAMED = ("does not hold here", "holds in part")


def claim_of_the_paper(evidence: Evidence) -> str:
    """Return the paper's average rates of speedup beside those of this run, as a sentence.

    A measured rate has its 95 % interval over models in brackets where there are enough of them
    and of rounds (:func:`cembench.results.families.rate_interval`).
    """
    paper = evidence.paper
    names = ", ".join(algorithm.upper() for algorithm in paper.compared)
    printed = ", ".join(f"{paper.stated['rate'][algorithm]:.1f}" for algorithm in paper.compared)
    told = [(policy, _rates(evidence, policy)) for policy in evidence.policies]
    here = "; ".join(f"{rates}{under(policy, evidence)}" for policy, (rates, _) in told)
    origins = Counter(surface.origin for surface in evidence.one_per_model)
    models, others = origins["model"], origins["stand-in"]
    over = [f"{models} of its models"] if models else []
    over += [f"{others} stand-in{'s' if others > 1 else ''}"] if others else []
    intervals = (
        "with 95 % intervals over models"
        if any(sure for _, (_, sure) in told)
        else f"too few for an interval ({DEFAULT_ROUNDS} rounds on {FEWEST_FAMILIES} models)"
    )
    return (
        f"{paper.reference.upper()} against {names}: printed {printed}; here {here}. This is "
        f"{paper.rate}, averaged over the models; here over {' and '.join(over)}, {intervals}."
    )


def _rates(evidence: Evidence, policy: str) -> tuple[str, bool]:
    """Return the measured averages as text, and whether one of them has an interval."""
    told, sure = [], False
    for algorithm in evidence.paper.compared:
        rates = list(measured_rates(evidence, algorithm, policy).values())
        series, interval = evidence.series_of(algorithm), None
        if rates and series is not None:
            rounds = paired_rounds(evidence, series, policy, evidence.one_per_model)
            interval = rate_interval([ratios for _, ratios, _ in rounds], log=False)
        between = f" ({interval.low:.1f} to {interval.high:.1f})" if interval else ""
        told.append(f"{mean_rate(rates):.1f}{between}" if rates else "not measured")
        sure = sure or interval is not None
    return ", ".join(told), sure


def verdicts_counted(claims: Sequence[Claim]) -> Sentence:
    """Return the numbers of all verdicts, failing ones first and with links to their claims."""
    parts: list[str | Claim] = [f"Of {len(claims)} claims of the paper, "]
    for verdict, (one, several) in VERDICTS.items():
        found = [claim for claim in claims if claim.verdict == verdict]
        if found:
            parts.append(f"{'; ' if len(parts) > 1 else ''}{len(found)} ")
            parts.append(one if len(found) == 1 else several)
        for k, claim in enumerate(found if verdict in _NAMED else ()):
            parts += [", " if k else ": ", claim]
    return (*parts, ".")
