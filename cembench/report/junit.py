"""Checks as JUnit's XML, for test viewers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

from cembench.core.atomic import write_bytes
from cembench.core.errors import ParameterError
from cembench.core.loading import is_there, read_bytes


@dataclass(frozen=True)
class Check:
    """A test case: its suite, the solver that it is of, and what it is called."""

    suite: str
    solver: str
    name: str
    #: Why it failed or was skipped, if it was; and more on a failure.
    failure: str | None = None
    detail: str = ""
    skipped: str | None = None


def check_junit(path: Path, verb: str) -> None:
    """Raise :class:`ParameterError` if a path is taken by anything but an earlier file of ours."""
    if is_there(path) and f'<testsuites name="cembench {verb}"' not in _beginning(path):
        raise ParameterError(
            f"{path} exists and was not written by `cembench {verb}`. Name another file."
        )


def _beginning(path: Path) -> str:
    return read_bytes(path)[:200].decode(errors="replace")


def write_junit(path: Path, verb: str, checks: Iterable[Check]) -> None:
    """Write the checks of a command.

    Raises
    ------
    ParameterError
        There is another file.
    RecordError
        It cannot be written.
    """
    check_junit(path, verb)
    root = Xml.Element("testsuites", name=f"cembench {verb}")
    suites: dict[str, Xml.Element] = {}
    for check in checks:
        name = f"{_clean(check.solver)}: {_clean(check.suite)}"
        if name not in suites:
            suites[name] = Xml.SubElement(root, "testsuite", name=name)
        about = {"classname": _clean(check.solver), "name": _clean(check.name)}
        case = Xml.SubElement(suites[name], "testcase", about)
        if check.failure is not None:
            fault = Xml.SubElement(case, "failure", message=_clean(check.failure))
            fault.text = _clean(check.detail)
        if check.skipped is not None:
            Xml.SubElement(case, "skipped", message=_clean(check.skipped))
    for suite in root:
        suite.set("tests", str(len(suite)))
        suite.set("failures", str(len(suite.findall("testcase/failure"))))
        suite.set("skipped", str(len(suite.findall("testcase/skipped"))))
    Xml.indent(root)
    write_bytes(path, Xml.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _clean(text: str) -> str:
    """Return a text without the characters that XML forbids."""
    return "".join(c if c in "\t\n" or c.isprintable() else "\ufffd" for c in text)
