"""A command is its function of the API: the same defaults, the same results, the same errors."""

import inspect
import json
import re
import sys

import pytest
import typer

import cembench
from cembench.commands.cli import app
from cembench.commands.from_api import _value
from tests import gallery

VERBS = {
    (one.name or one.callback.__name__).rstrip("_"): one.callback
    for one in app.registered_commands
    if hasattr(one.callback, "arguments")
}
GROUP = typer.main.get_command(app)


def test_all_verbs_that_are_made_from_the_api_are_compared():
    # In test_reproduce, test_site, test_signing and tests/api/test_compare.
    elsewhere = {"reproduce", "publish", "sign", "compare"}
    assert set(SAME) == VERBS.keys() - elsewhere


@pytest.mark.parametrize("verb", VERBS)
def test_options_have_the_defaults_of_the_function(verb):
    command = VERBS[verb]
    own = inspect.signature(command.body).parameters
    options = {option.name: option for option in GROUP.commands[verb].params}
    shared = [a for a in command.arguments.values() if a.name in options]
    assert shared or verb == "cut"
    for argument in shared:
        if argument.name in own or argument.default is inspect.Parameter.empty:
            continue  # the shell has an argument of its own, or must be given one
        default = options[argument.name].default
        is_sequence = argument.many or isinstance(default, list)
        assert (_value(argument, list(default or ())) if is_sequence else default) in (
            argument.default,
            argument.default or {},
            list(argument.default or ()) if argument.many else argument.default,
        ), argument.name


def test_help_has_no_bound_that_nobody_meets_and_lists_long_choices_in_its_text(cli, monkeypatch):
    """At 80 columns such a value takes the room of the text, or is broken in two."""
    monkeypatch.setenv("COLUMNS", "80")
    holes, run = (" ".join(cli(verb, "--help")[1].split()) for verb in ("holes", "run"))
    assert re.search(r"--outer N \[x>=0\]", holes)
    assert re.search(r"--sweeps N \[1<=x<=1000\]", holes)
    assert re.search(r"--backend NAME ", run)
    assert "One of cvxopt, cvxopt-metis, superlu, pardiso." in re.sub(r" │ │ ", " ", run)


@pytest.mark.parametrize("verb", VERBS)
def test_every_option_says_what_it_is(verb):
    for option in GROUP.commands[verb].params:
        assert option.name == "help" or option.help, option.name


@pytest.fixture
def cap(cli):
    cembench.write_mesh("cap.obj", cembench.surface("hemi-ellipsoid", 300))
    return "cap.obj"


def said(cli, *words):
    code, out, err = cli(*words, "--json")
    assert code == 0, err
    return json.loads(out)


def without_times(rows):
    return {f"{k}-{key}": row[key] for k, row in enumerate(rows) for key in row.keys() - CLOCKED}


def report_of(cap):
    return cembench.benchmark([cap], ["lscm"], rounds=1, output="measured").report("own")


def measured(folder, cap):
    return cembench.benchmark([cap], ["cem"], rounds=1, output=folder).folder


#: What a clock tells.
CLOCKED = {"seconds", "phases"}
SAME = {
    "list": lambda cli, cap: (
        cembench.catalogue("algorithms").as_dict(),
        said(cli, "list", "algorithms"),
    ),
    "map": lambda cli, cap: (
        next(dict(m.record.outcome.metrics) for m in cembench.map_files([cap])),
        said(cli, "map", cap),
    ),
    "measure": lambda cli, cap: (
        cembench.measure(cembench.parameterize(cap).save("uv.obj")).as_dict(),
        said(cli, "measure", "uv.obj"),
    ),
    "fetch": lambda cli, cap: (cembench.fetch().rows[0], said(cli, "fetch")[0]),
    "run": lambda cli, cap: (
        dict(cembench.benchmark([cap], ["cem"], rounds=1).asked[0].outcome.metrics),
        said(cli, "run", "--mesh", cap, "-a", "cem", "--rounds", 1)[0],
    ),
    "peers": lambda cli, cap: (
        dict(cembench.benchmark([cap], ["lscm"], rounds=1).asked[0].outcome.metrics),
        said(cli, "peers", "--mesh", cap, "-a", "lscm", "-o", "p")["cells"][0],
    ),
    "status": lambda cli, cap: (
        dict(cembench.Run(measured("one", cap)).status().about),
        said(cli, "status", "one"),
    ),
    "show": lambda cli, cap: (
        {"key": cembench.Run(measured("one", cap)).show("cap/cem")[0].cell.key},
        said(cli, "show", "cap/cem", "--run", "one")[0],
    ),
    "merge": lambda cli, cap: (
        {"cells": cembench.merge([measured("one", cap)], "both").cells},
        said(cli, "merge", "one", "-o", "again"),
    ),
    "export": lambda cli, cap: (
        {"output": str(cembench.Run(measured("one", cap)).export())},
        said(cli, "export", "one"),
    ),
    "report": lambda cli, cap: (
        {"title": report_of(cap).title},
        said(cli, "report", "measured"),
    ),
    "theory": lambda cli, cap: (
        dict(cembench.theory(cap, iterations=30).facts),
        said(cli, "theory", cap, "--iterations", 30)[0],
    ),
    "holes": lambda cli, cap: (
        without_times(cembench.holes("catenoid-ring", faces=200, sweeps=2).rows),
        without_times(
            said(cli, "holes", "catenoid-ring", "--faces", 200, "--sweeps", 2, "--run", "r")
        ),
    ),
    "submit": lambda cli, cap: (
        {"cells": cembench.submit(measured("one", cap), "one.zip").cells},
        said(cli, "submit", measured("two", cap), "-o", "two.zip"),
    ),
    "submissions": lambda cli, cap: (
        {"cells": cembench.submit(measured("one", cap), "one.zip").cells},
        said(cli, "submissions", "check", "one.zip")[0],
    ),
    "repair": lambda cli, cap: (
        {"steps": dict(cembench.repair(cap).steps)},
        said(cli, "repair", cap, "-o", "mended.obj"),
    ),
    "cut": lambda cli, cap: (
        {"vertices": cembench.cut(cap).mesh.n},
        said(cli, "cut", cap, "-o", "disk.obj"),
    ),
    "morph": lambda cli, cap: (
        cembench.morph([cap, cap]).metrics(5),
        said(cli, "morph", cap, cap, "--frames", 5),
    ),
    "validate": lambda cli, cap: (
        {"valid": cembench.validate("harmonic-circle", checks_only=True).valid},
        said(cli, "validate", "harmonic-circle", "--checks-only"),
    ),
}


@pytest.mark.parametrize("verb", SAME)
def test_the_call_and_the_command_give_the_same(verb, cli, cap):
    call, command = SAME[verb](cli, cap)
    assert call
    for name, value in json.loads(json.dumps(call)).items():
        assert command[name] == value, name


def test_the_map_of_a_file_is_that_of_parameterize(cli, cap):
    (mapped,) = cembench.map_files([cap])
    expected = dict(cembench.parameterize(cap).metrics)
    assert dict(mapped.record.outcome.metrics) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("call", "words", "message"),
    [
        (
            lambda: cembench.benchmark(["flat-disk"], rounds=6, precision="5%"),
            ("run", "--surfaces", "flat-disk", "--rounds", 6, "--precision", "5%"),
            "`rounds` sets the number that `precision` chooses",
        ),
        (
            lambda: cembench.benchmark(["flat-disk"], rounds=6, budget="1m"),
            ("run", "--surfaces", "flat-disk", "--rounds", 6, "--budget", "1m"),
            "`rounds` sets a number that `budget` does not shorten",
        ),
        (
            lambda: cembench.benchmark(["flat-disk"], rounds=3, max_rounds=20),
            ("run", "--surfaces", "flat-disk", "--rounds", 3, "--max-rounds", 20),
            "`rounds` sets the number that `max_rounds` limits",
        ),
        (
            lambda: cembench.benchmark(["flat-disk"], memory_bytes="much"),
            ("run", "--surfaces", "flat-disk", "--memory", "much"),
            "memory_bytes='much' is not a size",
        ),
        (
            lambda: cembench.map_files(["a.obj"], checker=True),
            ("map", "a.obj", "--checker"),
            "add `output`",
        ),
    ],
)
def test_a_message_names_arguments_and_every_argument_is_an_option(cli, call, words, message):
    with pytest.raises(cembench.ParameterError) as refused:
        call()
    assert message in str(refused.value)
    code, _, err = cli(*words)
    assert code == 2
    assert message in " ".join(err.split())


@pytest.mark.parametrize(
    "words", ["repair a.obj -o b.obj --overwrite", "map a.obj --memory-bytes 1TiB --overwrite"]
)
def test_an_option_may_be_spelled_as_its_argument(cli, words):
    (cli.folder / "a.obj").write_text(gallery.obj_text(*gallery.flat_rectangle(4, 5)))
    assert cli(*words.split())[0] == 0


@pytest.mark.parametrize(
    "given",
    [
        {"rounds": 0},
        {"rounds": 2.5},
        {"threads": float("nan")},
        {"solves": ["twice"]},
        {"pairing": "both"},
        {"timeout": "long"},
    ],
)
def test_the_function_refuses_what_the_option_would(given):
    with pytest.raises(cembench.ParameterError, match="is not allowed; write"):
        cembench.benchmark(["flat-disk"], **given)


def test_a_wrong_argument_names_the_function():
    with pytest.raises(TypeError, match=r"benchmark\(\) got an unexpected keyword argument"):
        cembench.benchmark(["flat-disk"], round=1)


def test_a_name_that_is_nearly_right_is_suggested(cli, cap):
    for words, meant in (
        (("-a", "CEM"), "Did you mean cem?"),
        (("-a", "tutte"), "Did you mean harmonic-tutte?"),
        (("-a", "cem", "-p", "max_iteration=3"), "Did you mean max_iterations?"),
    ):
        code, _, err = cli("map", cap, *words)
        assert code == 2
        assert meant in err
    for name, meant in (("capp.obj", "cap.obj"), ("hemi-elipsoid", "hemi-ellipsoid")):
        assert f"Did you mean {meant}" in cli("map", name)[2]


def test_a_generated_surface_is_mapped_by_its_name(cli):
    code, out, err = cli("map", "cone", "-o", "cone.obj", "--json")
    assert code == 0, err
    assert json.loads(out)["mesh"] == "cone"
    assert cembench.read_mesh(cli.folder / "cone.obj").m == cembench.surface("cone").m


def test_one_bad_file_of_a_folder_is_left_out_with_a_note(cli, cap):
    cli.folder.joinpath("bad.obj").write_text("v 0 0 0\nf 1 2 3\n")
    words = ("run", "--mesh-dir", ".", "-a", "lscm", "--dry-run", "--json")
    code, out, err = cli(*words)
    assert code == 0
    assert [cell["mesh"] for cell in json.loads(out)["cells"]] == ["cap"]
    assert "note: bad.obj is left out:" in err
    cli.folder.joinpath("cap.obj").unlink()
    assert cli(*words)[0] == 2


def test_a_program_that_is_not_there_is_told_before_anything_is_measured(cli, cap):
    words = ("run", "--mesh", cap, "--command", "no-such-program {input} {output}", "--dry-run")
    code, out, err = cli(*words, "-a", "lscm")
    assert code == 0
    assert "there is no program 'no-such-program'" in " ".join(err.split())
    assert "cannot run here" in out
    assert "1 of 2 cells to measure" in out
    cells = json.loads(cli(*words, "--json")[1])["cells"]
    lacking = [one for one in cells if one["lacks"]]
    assert [one["estimate"] for one in lacking] == [None]
    assert "no-such-program" in lacking[0]["lacks"]


def test_vertices_and_faces_may_be_two_arguments():
    mesh = cembench.surface("flat-disk", 200)
    for result in (
        cembench.parameterize(mesh.V, mesh.F, "cem"),
        cembench.parameterize(mesh.V, mesh.F, algorithm="cem"),
        cembench.parameterize((mesh.V, mesh.F), "cem"),
    ):
        assert result.algorithm.name == "cem"
    with pytest.raises(cembench.ParameterError, match="two algorithms"):
        cembench.parameterize(mesh, "cem", algorithm="lscm")
    with pytest.raises(KeyError, match="Did you mean conformal_energy"):
        result.metrics["conformal_enrgy"]


def test_quiet_prints_errors_only(cli, cap):
    assert cli("map", cap, "-q") == (0, "", "")
    code, out, err = cli("map", cap, "-q", "-a", "cme")
    assert (code, out) == (2, "")
    assert "Did you mean" in err


def test_map_prints_few_lines_and_all_of_them_on_request(cli, cap):
    few, all_of_them = (
        cli("map", cap, "--target", "disk", "-o", f"{name}.obj", *more)[1] for name, more in MORE
    )
    assert len(few.splitlines()) == 5
    assert len(all_of_them.splitlines()) > 10


MORE = (("a", ()), ("b", ("-v",)))


def test_ctrl_c_while_the_command_line_is_loaded_ends_with_a_line(monkeypatch, capsys):
    from cembench.__main__ import main

    class Interrupts:
        def find_spec(self, name, path=None, target=None):
            if name == "cembench.commands.app":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "cembench.commands.app")
    monkeypatch.setattr(sys, "meta_path", [Interrupts(), *sys.meta_path])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 130
    assert capsys.readouterr().err == "Stopped.\n"


def test_a_comma_is_part_of_a_plug_in_s_path(cli, cap):
    cli.folder.joinpath("a,b.py").write_text("")
    assert cli("map", cap, "--plugin", "a,b.py", "-q")[2].count("'a'") == 0
    code, _, err = cli("run", "--set", "no,where", "-a", "cem", "--dry-run")
    assert code == 2
    assert "'no,where'" in err
