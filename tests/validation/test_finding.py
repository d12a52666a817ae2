import tomllib
from importlib.resources import files
from string import Formatter

from cembench.validation.finding import finding


def test_every_finding_is_declared_with_what_is_allowed_and_what_to_do():
    folder = files("cembench.validation")
    declared = tomllib.loads((folder / "findings.toml").read_text(encoding="utf-8"))
    sources = "".join(
        file.read_text(encoding="utf-8") for file in folder.iterdir() if file.suffix == ".py"
    ).replace('f"{what} under refinement"', '"E_C under refinement" "angle error under refinement"')
    for stage, findings in declared.items():
        for name, texts in findings.items():
            assert f'"{name}"' in sources, f"{stage}: {name} is of no check"
            words = "".join(texts.values())
            named = {field for _, field, _, _ in Formatter().parse(words) if field}
            made = finding(stage, name, "measured", ok=True, **dict.fromkeys(named, 0.5))
            assert (made.stage, made.name, made.ok, made.undecided) == (stage, name, True, False)
            assert made.remedy.endswith(".")
            assert "{" not in made.allowed + made.remedy
