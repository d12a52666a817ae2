"""Is the verdict of `validate` on growth as seldom wrong as it says?"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import log
from typing import Any

import numpy as np

from benchmarks import noise
from benchmarks.pages import Section, Table
from cembench.results.intervals import LOOKS
from cembench.validation.scaling import MAX_ROUNDS, GrowthAnswer, answer_of

#: How much larger the larger mesh is.
RATIO = 3.0
#: Solvers of the table: their exponents.
SOLVERS = (1.5, 1.68, 1.75, 2.0)
#: Exponents of the reference: CEM's at the default sizes, and the largest that one should have.
REFERENCE, STEEP_REFERENCE = 0.7, 1.0


@dataclass(frozen=True)
class Simulated:
    """The answers of many validations, and their rounds."""

    answers: Counter[GrowthAnswer]
    rounds: float

    def share(self, answer: GrowthAnswer) -> float:
        """Return the share of validations with this answer."""
        return self.answers[answer] / sum(self.answers.values())


def simulate(
    model: str, runs: int, ours: float, reference: float, *, dearer: float = 1.0, seed: int = 0
) -> Simulated:
    """Validate a solver `runs` times; large meshes cost more by the factor `dearer`."""
    calls = noise.MODELS[model](np.random.default_rng(seed), runs, 4 * MAX_ROUNDS)
    calls = np.random.default_rng(seed + 1).permuted(calls.reshape(runs, MAX_ROUNDS, 4), axis=2)
    logs = np.log(calls) / log(RATIO)
    added = log(dearer) / log(RATIO)
    own = logs[..., 1] - logs[..., 0] + ours + added
    above = own - (logs[..., 3] - logs[..., 2] + reference + added)
    answers: Counter[GrowthAnswer] = Counter()
    rounds = 0
    for exponents, differences in zip(own.tolist(), above.tolist(), strict=True):
        for n in (look for look in LOOKS if look <= MAX_ROUNDS):
            answer = answer_of(exponents[:n], differences[:n])
            if answer is not GrowthAnswer.inconclusive:
                break
        answers[answer] += 1
        rounds += n
    return Simulated(answers, rounds / runs)


def growth(*, runs: int = 1000) -> Section:
    """Count the answers of `validate` on growth over simulated validations.

    Simulates a solver and a reference on two sizes, on machines that are noisy in several ways
    (``noise.py``), with the rule as it is: looks after 7, 10, 14 and 20 rounds, both limits.
    """
    heads = [f"faces^{exponent:g}" for exponent in SOLVERS]
    heads.append("faces^1.68, large meshes dearer by a third")
    cells = "".join(f" {{steep[{one}]:.1%}} / {{fine[{one}]:.1%}} |" for one in heads)
    layout = f"| noise | {' | '.join(heads)} |\n|---|{'---:|' * len(heads)}\n| {{noise}} |{cells}"
    rows = []
    for model in noise.MODELS:
        answers = [simulate(model, runs, ours, REFERENCE) for ours in SOLVERS]
        answers.append(simulate(model, runs, 1.68, STEEP_REFERENCE, dearer=4 / 3))
        row: dict[str, Any] = {"noise": model}
        for name, answer in (("steep", GrowthAnswer.too_steep), ("fine", GrowthAnswer.fine)):
            shares = [one.share(answer) for one in answers]
            row[name] = dict(zip(heads, shares, strict=True))
        rows.append(row)
    note = f"*too steep* / *fine* of {runs:,} simulated validations; the rest are inconclusive. "
    note += f"The reference grows like faces^{REFERENCE:g}, in the last column like faces."
    return Section([Table(rows, layout), note], "docs/measuring_details.md")
