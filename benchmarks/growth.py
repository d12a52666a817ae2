"""Is the verdict of `validate` on growth as seldom wrong as it says?

Simulates a solver and a reference on two sizes, on machines that are noisy in several ways
(``noise.py``), with the rule as it is: looks after 7, 10, 14 and 20 rounds, both limits::

    python -m benchmarks.growth
    python -m benchmarks.growth --runs 4000 --write-docs
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass
from math import log
from pathlib import Path

import numpy as np

from benchmarks import noise, pages
from cembench.results.looks import LOOKS
from cembench.validation.scaling import MOST_ROUNDS, GrowthAnswer, answer_of

PAGE = pages.ROOT / "docs/measuring.md"
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
    """Validate a solver so many times; large meshes are `dearer` on the machine by this factor."""
    calls = noise.MODELS[model](np.random.default_rng(seed), runs, 4 * MOST_ROUNDS)
    calls = np.random.default_rng(seed + 1).permuted(calls.reshape(runs, MOST_ROUNDS, 4), axis=2)
    logs = np.log(calls) / log(RATIO)
    added = log(dearer) / log(RATIO)
    own = logs[..., 1] - logs[..., 0] + ours + added
    above = own - (logs[..., 3] - logs[..., 2] + reference + added)
    answers: Counter[GrowthAnswer] = Counter()
    rounds = 0
    for exponents, differences in zip(own.tolist(), above.tolist(), strict=True):
        for n in (look for look in LOOKS if look <= MOST_ROUNDS):
            answer = answer_of(exponents[:n], differences[:n])
            if answer is not GrowthAnswer.cannot_tell:
                break
        answers[answer] += 1
        rounds += n
    return Simulated(answers, rounds / runs)


def table(runs: int) -> str:
    """Return the Markdown of all models of noise."""
    heads = " | ".join(f"faces^{exponent:g}" for exponent in SOLVERS)
    lines = [
        f"| noise | {heads} | faces^1.68, large meshes dearer by a third |",
        "|---|" + "---:|" * (len(SOLVERS) + 1),
    ]
    for model in noise.MODELS:
        found = [simulate(model, runs, ours, REFERENCE) for ours in SOLVERS]
        found.append(simulate(model, runs, 1.68, STEEP_REFERENCE, dearer=4 / 3))
        cells = [
            f"{one.share(GrowthAnswer.too_steep):.1%} / {one.share(GrowthAnswer.fine):.1%}"
            for one in found
        ]
        lines.append(f"| {model} | {' | '.join(cells)} |")
    told = f"*too steep* / *fine* of {runs:,} simulated validations; the rest cannot be told. "
    told += f"The reference grows like faces^{REFERENCE:g}, in the last column like faces."
    return "\n".join([*lines, "", told])


def main() -> None:
    """Print the table, or put it into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--write-docs", action="store_true", help="fill docs/measuring.md")
    chosen = parser.parse_args()
    text = table(chosen.runs)
    print(text)
    if chosen.write_docs:
        pages.fill(PAGE, Path(__file__).stem, text)


if __name__ == "__main__":
    main()
