import json
from pathlib import Path

import pytest

from cembench.results.records import Record
from tests.validation.in_this_process import TimerHere, call_here

FILE = Path(__file__).with_name("wrong.py")
TINY = ("--surfaces", "hemi-ellipsoid,cone", "--faces", 600, "--repeats", 2, "--up-to", 900)


@pytest.fixture
def here(cli, monkeypatch):
    """The command line without processes of its own; what runs is the same."""
    monkeypatch.setattr("cembench.validation.solver.in_a_process", lambda options: call_here)
    monkeypatch.setattr("cembench.running.local.CellTimer", TimerHere)

    def validate(name, *arguments):
        return cli("validate", f"{FILE}:{name}" if name else FILE, *arguments)

    validate.folder = cli.folder
    return validate


def test_a_right_solver_is_valid_and_its_page_is_written(here):
    code, out, err = here("right", *TINY, "-o", "there", "--against", "cem,lscm", "--threads", 2)
    assert code == 0
    said = " ".join(out.split())
    assert (
        "Right: valid; E_C in the common gauge equal to CEM's within 1 % on all 2 surfaces" in said
    )
    assert "contract ..." in err
    assert max(map(len, out.splitlines())) <= 80
    page = (here.folder / "there/index.html").read_text()
    for words in ("Validation of Right", "valid; ", "Seconds against triangles"):
        assert words in page
    data = json.loads((here.folder / "there/validation.json").read_text())
    assert [a["baseline"] for a in data["against"]] == ["cem", "lscm"]
    (record, *_) = (here.folder / "there/quality/records").glob("*.json")
    kept = Record.model_validate_json(record.read_bytes())
    assert (kept.outcome.status, kept.cell.threads) == ("ok", 2)


def test_a_wrong_one_is_invalid_and_the_stages_behind_are_not_reached(here):
    code, out, _ = here("off-circle", "--json", *TINY)
    data = json.loads(out)
    assert code == 1
    assert data["verdict"].startswith("invalid: boundary: up to 1.0e-03 off the circle")
    assert (data["valid"], data["passed"], data["against"]) == (False, False, [])
    assert data["skipped"].keys() == {"quality", "scaling"}
    assert not list(here.folder.iterdir())


def test_a_fault_is_printed_with_what_is_allowed_and_what_to_do(here):
    code, out, _ = here("single", "--checks-only", "-o", "there")
    assert code == 1
    assert "returns a map fault invalid on uneven hemi-ellipsoid: uv is complex64" in " ".join(
        out.split()
    )
    assert "allowed: " in out
    assert "to do: " in out
    assert "not examined, because of a fault in contract" in out
    assert max(map(len, out.splitlines())) <= 80
    assert "not examined" in (here.folder / "there/index.html").read_text()


@pytest.mark.parametrize("name", ["not-conformal", "fold"])
def test_a_page_has_a_picture_of_the_worst_map_though_nothing_was_timed(here, name):
    code, _, _ = here(name, "--checks-only", "-o", "there")
    assert code == 1
    assert "its worst map" in (here.folder / "there/index.html").read_text()
    assert (here.folder / "there/figures/worst-map.png").stat().st_size > 1000


def test_folds_and_refusals_are_told_and_what_is_required_gates(here):
    named = ("--surfaces", "hemi-ellipsoid,cone,flat-disk", *TINY[2:4], "--repeats", 1)
    required = ("--require", "no-folds", "--require", "not-worse")
    code, out, _ = here("folds-sometimes", *named, "--up-to", 0, *required, "--json")
    data = json.loads(out)
    assert data["verdict"].endswith(
        "folds on 1 surface: flat-disk; no map of 1 surface: cone; "
        "required and not met: no-folds, not-worse. Looked at, in triangles: "
        "contract 600 to 1,536, correctness 384 to 6,144, quality 600."
    )
    assert data["no_map_on"] == {"cone": "no cones"}
    assert (data["valid"], data["passed"], code) == (True, False, 1)


def test_what_crashes_on_large_surfaces_is_invalid(here):
    code, out, _ = here("crashes-on-large", *TINY, "--up-to", 9900, "--json")
    data = json.loads(out)
    assert code == 1
    assert data["verdict"].startswith("invalid: every surface: ")
    assert "too large" in data["verdict"]
    assert next(f["stage"] for f in data["findings"] if not f["ok"]) == "scaling"


def test_a_hole_that_is_not_round_is_a_fault_in_the_comparison_too(here):
    named = ("--surfaces", "holed-cap", "--faces", 5000, "--repeats", 1, "--up-to", 0)
    code, out, _ = here("round-when-small", *named, "--json", "--require", "better")
    data = json.loads(out)
    assert code == 1
    assert data["verdict"].startswith(
        "invalid: every surface: holed-cap: invalid: 1 of 3 holes are"
    )
    assert next(f["stage"] for f in data["findings"] if not f["ok"]) == "quality"
    (compared,) = data["against"]
    assert (compared["energy"]["ratio"], compared["speed"]) == (None, None)


def test_a_method_that_is_good_on_small_surfaces_alone_is_found_by_its_quality_at_every_size(here):
    code, out, _ = here("good-when-small", *TINY[:-1], 21_000, "--json")
    data = json.loads(out)
    assert code == 1
    assert data["verdict"].startswith("invalid: E_C at every size: E_C in the common gauge 1.00, ")
    assert data["at_sizes"][0]["energy"]["higher"] == 2
    assert data["looked_at"]["scaling"] == [2400, 20886]


def test_what_remembers_its_calls_is_caught_in_the_rounds(here):
    from tests.validation import wrong

    wrong.calls.clear()
    code, out, _ = here("remembers", *TINY, "--json")
    assert code == 1
    assert json.loads(out)["verdict"].startswith("invalid: repeatable")


@pytest.mark.parametrize(
    ("plugin", "arguments", "message"),
    [
        ("nowhere.py", (), "plug-in"),
        ("none", (), "'none' is neither a Python file"),
        ("", (), "declares not exactly one algorithm; it declares: backslash,"),
        (":none", (), "declares no algorithm 'none'; it declares: backslash,"),
        (
            ":right",
            ("--against", "none"),
            "unknown algorithm 'none'. Did you mean noise? Known: abf++, abf-linear,",
        ),
        (":right", ("--against", "koebe-cem"), "against='koebe-cem': right cannot be compared"),
        (":right", ("--surfaces", "catenoid-ring"), "which none of the chosen algorithms accepts"),
        (":right", ("-p", "steps=2"), "no chosen algorithm has a parameter 'steps'"),
        (":right", ("-p", "steps"), "-p 'steps' is not of the form NAME=VALUE"),
        (":right", ("--up-to", 100), "up_to=100 is too few"),
        (":right", ("--require", "wonders"), "require='wonders' is not allowed"),
        (
            ":right",
            ("--require", "faster", "--checks-only"),
            "`require` needs the stages that `checks_only` leaves out",
        ),
    ],
)
def test_bad_usage_is_said_before_anything_is_run(here, cli, plugin, arguments, message):
    if plugin in ("", ":none", ":right"):
        code, _, err = here(plugin[1:], *arguments)
    else:
        code, _, err = cli("validate", plugin, *arguments)
    assert code == 2
    assert message in err
    assert not list(cli.folder.iterdir())


@pytest.mark.slow
def test_quadratic_growth_is_a_fault(here):
    code, out, _ = here("quadratic", *TINY, "--json")
    said = json.loads(out)["verdict"]
    assert said.startswith("invalid: growth of the seconds: seconds grow like faces^2.00")
    assert code == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["right", "not-conformal", "hangs"])
def test_in_processes_of_its_own(cli, name):
    seconds = 20 if name == "hangs" else 600
    few = ("--surfaces", "hemi-ellipsoid", "--faces", 600, "--repeats", 1, "--up-to", 0)
    few += ("--timeout", seconds)
    code, out, _ = cli("validate", f"{FILE}:{name}", *few, "--json")
    said = json.loads(out)["verdict"]
    expected = {
        "right": "valid; E_C in the common gauge equal to CEM",
        "not-conformal": "invalid: not conformal. Its E_C does not vanish under refinement",
        "hangs": "invalid: returns a map: timeout on uneven hemi-ellipsoid: not finished after 20",
    }
    assert said.startswith(expected[name])
    assert code == (0 if name == "right" else 1)
