"""A validation as other programs read it: the summary of a job, and the checks of a test report."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from cembench.report.document import Section, Text
from cembench.report.junit import Check
from cembench.report.render.markdown import append_section
from cembench.validation.document import stage_sections
from cembench.validation.verdict import STAGES, Validation, sentences

#: The stages whose tables come last in a summary: what they found is in the verdict if it is bad.
_CHECKS = ("contract", "correctness")


def append_markdown(validation: Validation, path: Path) -> None:
    """Append the verdict and its tables to a file of Markdown, the comparisons first.

    Raises
    ------
    RecordError
        The file cannot be read or written.
    """
    sign = "✅" if validation.passed else "❌"
    title = f"{sign} {validation.title}: {'passed' if validation.passed else 'did not pass'}"
    stages = [section for section in stage_sections(validation, {}) if section.items]
    stages.sort(key=lambda section: section.name in _CHECKS)
    verdict = Text(" ".join(sentences(validation)))
    append_section(path, Section("validation", title, (verdict,), tuple(stages)))


def checks_of(validation: Validation) -> Iterator[Check]:
    """Yield each check, a suite a stage, with the requirements that are not met."""
    solver = validation.algorithm
    for stage in STAGES:
        for one in validation.findings:
            if one.stage == stage:
                failure = None if one.ok else one.measured
                detail = "" if one.ok else f"allowed: {one.allowed}\nto do: {one.remedy}"
                yield Check(stage, solver, one.title, failure, detail)
        if stage in validation.skipped:
            yield Check(stage, solver, stage, skipped=validation.skipped[stage])
    for requirement in validation.unmet:
        yield Check("required", solver, str(requirement), " ".join(sentences(validation)))
