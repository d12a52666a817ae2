"""README's own solver: a map that is valid everywhere, and what `validate` teaches about it."""

import re
from pathlib import Path

from cembench.registry import load_registry
from cembench.validation.correctness import examine_correctness
from tests.validation.in_this_process import solver_here

README = Path(__file__).parents[2] / "README.md"


def test_readme_s_solver_maps_everything_and_is_not_called_conformal(tmp_path):
    (block,) = (
        code
        for code in re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
        if "@algorithm(" in code
    )
    (tmp_path / "mine.py").write_text(block)
    solver = solver_here("mine", tmp_path / "mine.py")
    findings = examine_correctness(solver, load_registry((str(tmp_path / "mine.py"),)))
    wrong = {finding.name for finding in findings if not finding.ok}
    # Valid on all surfaces; but arc length along the boundary is not what a conformal map does to
    # it, and that is what a finer mesh cannot mend.
    assert wrong == {"E_C under refinement", "angle error under refinement", "modulus"}
