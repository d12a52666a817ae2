"""A validation as the summary of a job and as JUnit's XML."""

from xml.etree import ElementTree as Xml

import pytest

from cembench.core.errors import ParameterError
from cembench.report.junit import write_junit
from cembench.validation.finding import ValidationFinding
from cembench.validation.summaries import append_markdown, checks_of
from cembench.validation.verdict import Requirement, Validation

FAULT = ValidationFinding(
    stage="contract",
    name="returns a map",
    ok=False,
    measured="uv is <complex64> & \x1b[31m",
    allowed="complex128",
    remedy="convert it",
)


def validation(*findings, **more):
    about = {"algorithm": "a", "title": "A", "target": "disk", "source": "a.py", "parameters": {}}
    return Validation(**about, command="", environment="e", findings=findings, **more)


def test_junit_has_checks_skipped_stages_and_requirements(tmp_path):
    path = tmp_path / "j.xml"
    good = FAULT.model_copy(update={"ok": True, "name": "mesh untouched"})
    skipped = {"quality": "not examined, because of a fault in contract"}
    write_junit(path, "validate", checks_of(validation(FAULT, good, skipped=skipped)))
    root = Xml.parse(path).getroot()
    contract = root.find("testsuite[@name='a: contract']")
    assert [contract.get(name) for name in ("tests", "failures", "skipped")] == ["2", "1", "0"]
    (failure,) = root.findall(".//failure")
    assert failure.get("message") == "uv is <complex64> & \ufffd[31m"
    assert failure.text == "allowed: complex128\nto do: convert it"
    assert root.find("testsuite[@name='a: quality']").get("skipped") == "1"
    write_junit(path, "validate", checks_of(validation(good, unmet=(Requirement.faster,))))
    assert [case.get("name") for case in Xml.parse(path).getroot().findall(".//testcase")] == [
        "mesh untouched",
        "faster",
    ]


def test_checks_of_one_name_on_two_surfaces_are_two_cases(tmp_path):
    both = [FAULT.model_copy(update={"surface": name}) for name in ("cap", "cone")]
    write_junit(tmp_path / "j.xml", "validate", checks_of(validation(*both)))
    cases = Xml.parse(tmp_path / "j.xml").getroot().findall(".//testcase")
    assert [case.get("name") for case in cases] == [
        "returns a map on cap",
        "returns a map on cone",
    ]


def test_another_s_file_is_not_replaced(tmp_path):
    path = tmp_path / "j.xml"
    path.write_text("<testsuites name='mine'/>")
    with pytest.raises(ParameterError, match="was not written by `cembench validate`"):
        write_junit(path, "validate", [])
    assert path.read_text() == "<testsuites name='mine'/>"


def test_a_summary_is_appended_and_links_to_nothing(tmp_path):
    path = tmp_path / "s.md"
    path.write_text("# Mine\n")
    append_markdown(validation(FAULT), path)
    text = path.read_text()
    assert text.startswith("# Mine\n\n## ❌ A: did not pass\n\ninvalid: returns a map: ")
    assert "](" not in text
    assert "<complex64>" not in text, "it is escaped"


def test_the_command_checks_the_file_before_it_works(cli):
    (cli.folder / "j.xml").write_text("mine")
    code, _, err = cli("validate", "cem", "--checks-only", "--junit", "j.xml")
    assert code == 2
    assert "was not written by" in err
