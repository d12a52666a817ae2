"""The action for authors of solvers: its steps, run here as a workflow would run them."""

import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as Xml

import pytest
import yaml
from markdown_it import MarkdownIt

from tests.sharing.workflow_steps import run_step, steps_of

ROOT = Path(__file__).parents[2]
ACTION = ROOT / "action.yml"
EXAMPLE = ROOT / "examples/solver_repository"
WORKFLOW = EXAMPLE / ".github/workflows/validate.yml"
WRONG = """
from cembench import DiskMesh, Parameterization, algorithm


@algorithm("heights", title="Heights", target="disk")
def heights(mesh: DiskMesh) -> Parameterization:
    \"\"\"Map every vertex to its height.\"\"\"
    return Parameterization(mesh.V[:, 2])
"""


def acted(folder, name="Validate", junit="junit", **inputs):
    """A step of the action with these inputs; the others have their defaults."""
    action = yaml.safe_load(ACTION.read_text())
    assert inputs.keys() <= action["inputs"].keys()
    given = {name: one["default"] for name, one in action["inputs"].items()} | inputs
    step = steps_of(ACTION)[name]
    environment = {
        variable: given[place.removeprefix("${{ inputs.").removesuffix(" }}")]
        for variable, place in step["env"].items()
    }
    code, said, summary = run_step(step, folder, **environment)
    return code, said, summary, Xml.parse(folder / given[junit]).getroot()


def rendered(summary):
    return MarkdownIt("commonmark").enable("table").render(summary)


@pytest.mark.slow
def test_the_example_solver_s_verdict_is_in_the_summary(tmp_path):
    shutil.copy(EXAMPLE / "solver.py", tmp_path)
    code, said, summary, checks = acted(tmp_path, plugin="solver.py", arguments="--checks-only")
    assert code == 0, said
    page = rendered(summary)
    assert "<h2>✅ Ours: passed</h2>" in page
    assert page.count("<table>") == 2
    assert len(checks.findall(".//testcase")) > 15
    assert checks.findall(".//failure") == []


def test_a_wrong_solver_fails_and_the_summary_says_why(tmp_path):
    (tmp_path / "heights.py").write_text(WRONG)
    code, said, summary, checks = acted(tmp_path, plugin="heights.py", arguments="--checks-only")
    assert code == 1, said
    page = rendered(summary)
    assert "<h2>❌ Heights: did not pass</h2>" in page
    assert "to do:" in page
    (first, *_) = checks.findall(".//failure")
    assert "allowed: " in first.text
    suites = {suite.get("name"): suite for suite in checks}
    assert int(suites["heights: contract"].get("failures")) > 0


@pytest.mark.slow
def test_a_program_is_judged_by_its_command(tmp_path):
    shutil.copy(ROOT / "examples/external/tutte.py", tmp_path)
    code, said, summary, _ = acted(
        tmp_path,
        command=f"{sys.executable} tutte.py {{input}} {{output}}",
        arguments="--checks-only --program output=.txt --program target=disk",
    )
    assert code == 1, said
    assert "did not pass" in summary
    assert "refinement" in summary, "Tutte's map is not conformal, and nobody said so"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ends", "kind"),
    [
        ("return Parameterization(uv * (1.5 - 0.5 * abs(uv)))", "worse: ours on cone: E_C"),
        (
            "raise ValueError('not today')",
            "invalid: ours on cone: failed: RuntimeError: ValueError",
        ),
        (
            "uv[mesh.interior[0]] = 0.9; return Parameterization(uv)",
            "invalid: ours on cone: invalid",
        ),
        ("return Parameterization(uv)", ""),
    ],
)
def test_a_solver_is_compared_with_its_version_at_a_base(tmp_path, ends, kind):
    def git(*words):
        me = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", *me, *words], cwd=tmp_path, check=True, capture_output=True)

    git("init", "-q")
    text = (EXAMPLE / "solver.py").read_text()
    later = text.replace("return Parameterization(", "uv = (") + f"    {ends}\n"
    for version in (text, later):
        (tmp_path / "solver.py").write_text(version)
        git("add", "solver.py")
        git("commit", "-qm", "a version")
    given = {"plugin": "solver.py", "solver": "ours", "base": "HEAD~1"}
    given["compare-arguments"] = "--surfaces cone --faces 120 --rounds 1"
    given["fail-on"] = "worse,invalid"
    code, said, summary, checks = acted(tmp_path, "Compare", "compare-junit", **given)
    assert code == bool(kind), said
    assert f"error: {kind}" in said or not kind
    assert "ours" in rendered(summary)
    assert bool(checks.findall(".//failure")) == bool(kind)


@pytest.mark.parametrize("file", [ACTION, WORKFLOW, ROOT / "examples/results_repository"])
def test_no_text_of_an_input_becomes_part_of_a_script(file):
    files = [file] if file.is_file() else [*file.rglob("*.yml")]
    for one in files:
        parsed = yaml.safe_load(one.read_text())
        jobs = [parsed["runs"]] if "runs" in parsed else parsed["jobs"].values()
        assert not [s for job in jobs for s in job["steps"] if "${{" in s.get("run", "")]


def test_the_example_workflow_uses_inputs_that_there_are():
    inputs = yaml.safe_load(ACTION.read_text())["inputs"]
    steps = yaml.safe_load(WORKFLOW.read_text())["jobs"]["solver"]["steps"]
    (ours,) = [step for step in steps if "cembench" in step.get("uses", "")]
    assert ours["with"].keys() <= inputs.keys()
    assert {"base", "solver"} <= ours["with"].keys(), "it compares the solver with its base"
    (clone,) = [step for step in steps if "checkout" in step.get("uses", "")]
    assert clone["with"]["fetch-depth"] == 0, "the commit of the base is there"
