"""A validation as other programs read it: the summary of a job, and JUnit's XML."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as Xml

from cembench.core.atomic import write_bytes
from cembench.core.errors import ParameterError
from cembench.core.loading import is_there, read_bytes
from cembench.report.document import Section, Text
from cembench.report.render.markdown import append_section
from cembench.validation.document import stage_sections
from cembench.validation.verdict import STAGES, Validation, sentences

#: How a file of ours begins, after the declaration of XML.
_OURS = b'<testsuites name="cembench validate"'
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


def check_junit(path: Path) -> None:
    """Raise :class:`ParameterError` if a path is taken by anything but an earlier file of ours."""
    if is_there(path) and _OURS not in read_bytes(path)[:200]:
        raise ParameterError(
            f"{path} exists and was not written by `cembench validate`. Name another file."
        )


def write_junit(validation: Validation, path: Path) -> None:
    """Write each check as a test case of JUnit's XML, a suite a stage, with the requirements.

    Raises
    ------
    ParameterError
        There is another file.
    RecordError
        It cannot be written.

    """
    check_junit(path)
    root = Xml.Element("testsuites", name="cembench validate")
    for stage in STAGES:
        suite = _suite(root, stage, validation)
        for finding in validation.findings:
            if finding.stage == stage:
                case = _case(suite, finding.title, validation)
                if not finding.ok:
                    fault = Xml.SubElement(case, "failure", message=_clean(finding.measured))
                    fault.text = _clean(f"allowed: {finding.allowed}\nto do: {finding.remedy}")
        if stage in validation.skipped:
            case = _case(suite, stage, validation)
            Xml.SubElement(case, "skipped", message=_clean(validation.skipped[stage]))
    required = _suite(root, "required", validation)
    for requirement in validation.unmet:
        case = _case(required, str(requirement), validation)
        Xml.SubElement(case, "failure", message=_clean(" ".join(sentences(validation))))
    for suite in root:
        suite.set("tests", str(len(suite)))
        for kind in ("failure", "skipped"):
            plural = "failures" if kind == "failure" else kind
            suite.set(plural, str(len(suite.findall(f"testcase/{kind}"))))
    Xml.indent(root)
    write_bytes(path, Xml.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _suite(root: Xml.Element, name: str, validation: Validation) -> Xml.Element:
    return Xml.SubElement(root, "testsuite", name=f"{_clean(validation.algorithm)}: {name}")


def _case(suite: Xml.Element, name: str, validation: Validation) -> Xml.Element:
    about = {"classname": _clean(validation.algorithm), "name": _clean(name)}
    return Xml.SubElement(suite, "testcase", about)


def _clean(text: str) -> str:
    """Return a text without the characters that XML forbids."""
    return "".join(c if c in "\t\n" or c.isprintable() else "\ufffd" for c in text)
