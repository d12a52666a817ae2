"""Every option that takes a number, or names something, has a range that is told."""

import inspect
import json
import re

import pytest
import typer

from cembench.api.benchmark import usual_budget
from cembench.commands.cli import app
from cembench.results.profiles import Profile

SMALL = ("--surfaces", "flat-disk", "--faces", 100, "-a", "cem", "--dry-run")


@pytest.mark.parametrize(
    "option",
    [
        ("--faces", -1),
        ("--faces", 0),
        ("--faces", "1e12"),
        ("--faces", 10**12),
        ("--threads", 0),
        ("--threads", 10**9),
        ("--repeats", 0),
        ("--repeats", 10**9),
        ("--rounds", 0),
        ("--precision", "0"),
        ("--precision", "80%"),
        ("--precision", "nan"),
        ("--precision", "much"),
        ("--max-rounds", 7),
        ("--max-rounds", 1000),
        ("--budget", "soon"),
        ("--budget", "-1m"),
        ("--budget", "nans"),
        ("--budget", "1e300h"),
        ("--repeat-busy", -1),
        ("--seed", -1),
        ("--seed", 10**30),
        ("--timeout", 0),
        ("--timeout", -1),
        ("--timeout", "nan"),
        ("--timeout", "inf"),
        ("--timeout", "1e300"),
        ("--memory", "1"),
        ("--memory", "0"),
        ("--memory", "-4GiB"),
        ("--memory", "much"),
        ("--memory", "1e400GiB"),
        ("--memory", "nan"),
        ("--memory", "9999999TiB"),
        ("-p", "max_iterations=1e22"),
        ("-p", f"max_iterations={10**22}"),
        ("-p", "tolerance=nan"),
        ("--reference", "nope"),
        ("--reference", "lscm"),
        ("--solves", "twice"),
        ("--backend", "none"),
        ("--profile", "none"),
        ("-a", "none"),
        ("--surfaces", "none"),
        ("--dataset", "none"),
    ],
)
def test_what_is_out_of_range_is_refused(cli, option):
    code, out, err = cli("run", *SMALL, *option)
    assert (code, out) == (2, "")
    assert str(option[1]).partition("=")[0] in err or option[0].strip("-") in err
    assert not list(cli.folder.iterdir())


def test_a_profile_has_the_time_that_its_paper_gives_it():
    assert [usual_budget(profile) for profile in (*Profile, None)] == [105, 3600, 14_400, 1800]


def test_rounds_are_fixed_or_until_precise_but_not_both(cli):
    code, out, err = cli("run", *SMALL, "--rounds", 6, "--precision", "5%")
    assert (code, out) == (2, "")
    assert "give only one of them" in err


@pytest.mark.parametrize(
    "option",
    [("--precision", "2.5%"), ("--precision", 0.1), ("--budget", "90s"), ("--budget", "0.5h")],
)
def test_a_precision_and_a_time_are_written_in_several_ways(cli, option):
    code, out, _ = cli("run", *SMALL, *option, "--json")
    (cell,) = json.loads(out)["cells"]
    assert code == 0
    assert cell["estimate"]["least_seconds"] < cell["estimate"]["seconds"]


@pytest.mark.parametrize(
    "option", [("--memory", "256MiB"), ("--memory", "64TB"), ("--timeout", 0.1), ("--seed", 2**40)]
)
def test_what_is_in_range_is_taken(cli, option):
    assert cli("run", *SMALL, *option)[0] == 0


@pytest.mark.parametrize(
    "verb",
    [
        ("morph", "flat-disk", "flat-disk", "--lambda", "nan"),
        ("morph", "flat-disk", "flat-disk", "--reach", "nan"),
        ("morph", "flat-disk", "flat-disk", "--frames", 10**9),
        ("morph", "flat-disk", "flat-disk", "--views", "nowhere"),
        ("morph", "flat-disk", "flat-disk", "-a", "none"),
        ("holes", "--sweeps", 0),
        ("holes", "--sweeps", 10**9),
        ("holes", "--outer", -1),
        ("theory", "flat-disk", "--iterations", 10**9),
        ("theory", "flat-disk", "--faces", -5),
        ("validate", "lscm", "--faces", 10**12),
        ("validate", "lscm", "--up-to", 10**12),
        ("fetch", "--timeout", "nan"),
    ],
)
def test_so_it_is_in_the_other_verbs(cli, verb):
    code, _, err = cli(*verb)
    assert code == 2
    assert "Traceback" not in err


def test_every_number_of_every_verb_has_both_bounds():
    for command in app.registered_commands:
        hints = inspect.get_annotations(command.callback, eval_str=True)
        for name, hint in hints.items():
            kinds = {hint, *getattr(hint, "__args__", ())}
            declared = [o for o in getattr(hint, "__metadata__", ()) if hasattr(o, "min")]
            inner = kinds | set(getattr(getattr(hint, "__origin__", None), "__args__", ()))
            inner.add(getattr(hint, "__origin__", None))
            if not inner & {int, float}:
                continue
            (option,) = declared
            where = f"{command.callback.__name__}: {name}"
            assert option.min is not None, where
            assert option.max is not None, where
            if float in inner:
                assert option.callback is not None, f"{where}: nan passes any bound"


def test_the_bounds_of_a_typer_option_are_called_min_and_max():
    assert {"min", "max"} <= set(inspect.signature(typer.Option).parameters)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-V",), "cembench 0."),
        (("help",), "Commands:"),
        (("help", "cut"), "cut [OPTIONS]"),
        (("list", "algorithms", "--target", "circular holes"), "direct-cem-holes"),
    ],
)
def test_what_people_type_for_help_is_understood(cli, words, said):
    code, out, _ = cli(*words)
    assert code == 0
    assert said in out


def test_algorithms_of_one_target_are_listed_alone(cli):
    out = cli("list", "--target", "free boundary", "--json")[1]
    targets = {one["target"] for one in json.loads(out)["algorithms"]}
    assert targets == {"free boundary"}
    assert "surfaces" not in json.loads(out)
    assert cli("list", "surfaces", "--target", "disk")[0] == 2


@pytest.mark.parametrize(
    ("words", "near"),
    [
        (("list", "algoritms"), "Did you mean algorithms?"),
        (("map", "face.obj", "--uv", "unt"), "Did you mean unit?"),
    ],
)
def test_a_misspelt_choice_has_a_suggestion(cli, words, near):
    code, _, err = cli(*words)
    assert code == 2
    assert near in re.sub(r"[\s│]+", " ", err)


def test_a_suggestion_comes_before_the_list_of_all_names(cli):
    err = cli("run", "--surfaces", "cone", "-a", "ceem")[2]
    assert err.index("Did you mean cem") < err.index("abf++")


def test_the_help_of_run_shows_first_what_most_people_need(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    out = cli("run", "--help")[1]
    first = out.partition("More options")[0]
    assert len(re.findall(r"(?m)^│ --(?!help)", first)) == 10
    assert all(f"--{name}" in first for name in ("mesh", "algorithms", "plugin", "output"))
