"""The command line and the package start quickly: each loads only what it needs."""

import inspect
import subprocess
import sys
from itertools import chain

import pytest

import cembench
from cembench.commands import cli
from cembench.commands.app import MODULES, brought, descriptions

#: Each takes a tenth of a second to load, or more.
SLOW = ("numpy", "scipy", "pydantic", "matplotlib", "igl", "shapely", "cvxopt", "PIL")
PARTS_OF_SCIPY = ("scipy.sparse", "scipy.linalg", "scipy.spatial", "scipy.ndimage")
WATCHED = (*SLOW, *PARTS_OF_SCIPY, "cembench.results.records", "cembench.running")


def loaded(statements):
    """The watched modules that a fresh interpreter has loaded after these statements."""
    code = f"""if True:
        import sys
        {statements}
        print(*[name for name in {WATCHED!r} if name in sys.modules], file=sys.stderr)
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stderr.split())


def command(*words):
    return (
        f"sys.argv = ['cembench', *{words!r}]\n"
        "        from cembench.commands.cli import main\n"
        "        try: main()\n"
        "        except SystemExit as ended: assert not ended.code"
    )


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["--version"]])
def test_a_help_text_needs_no_numerical_library(words):
    # Where a command has options, the library of the command line loads pydantic.
    assert loaded(command(*words)) <= {"pydantic"}


def test_a_command_line_loads_the_module_of_its_command():
    start = "from cembench.commands.app import load; load('cut')"
    names = [f"cembench.commands.{module}" for module in MODULES]
    code = f"import sys; {start}; print(*[n for n in {names!r} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "cembench.commands.cut" in done.stdout.split()
    assert not {"cembench.textures.map_command", "cembench.commands.status"} & set(
        done.stdout.split()
    )


def test_the_modules_name_all_commands():
    known = [one.name or one.callback.__name__ for one in cli.app.registered_commands]
    others = [entry.name for entry in brought()]
    assert sorted(known) == sorted([*chain.from_iterable(MODULES.values()), *others])


def test_the_help_describes_the_commands_in_their_own_words():
    texts = {
        one.name or one.callback.__name__: inspect.getdoc(one.callback).split("\n\n")[0]
        for one in cli.app.registered_commands
    }
    assert [*descriptions().items()] == [(k, " ".join(v.split())) for k, v in texts.items()]


def test_the_help_of_all_commands_loads_no_command():
    code = """if True:
        import sys
        sys.argv = ["cembench", "--help"]
        from cembench.__main__ import main
        try: main()
        except SystemExit: print(*sys.modules, file=sys.stderr)
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "Cut a surface open along short curves" in done.stdout
    assert "cembench.commands.app" in done.stderr.split()
    assert not {f"cembench.commands.{name}" for name in MODULES} & {*done.stderr.split()}


def test_a_command_line_without_a_word_prints_the_help():
    start = [sys.executable, "-m", "cembench"]
    bare, asked = (
        subprocess.run([*start, *more], capture_output=True, text=True, check=True).stdout
        for more in ([], ["--help"])
    )
    assert bare == asked
    assert "Commands:" in asked


def test_a_list_needs_no_scipy_and_no_records():
    # The command line library itself loads pydantic, where a command has options.
    assert loaded(command("list")) == {"numpy", "scipy", "pydantic"}


def test_a_map_loads_neither_other_algorithms_nor_what_draws(tmp_path):
    cembench.write_mesh(tmp_path / "a.obj", cembench.surface("flat-disk", 200))
    words = ["map", str(tmp_path / "a.obj"), "-a", "lscm", "-o", str(tmp_path / "b.obj")]
    others = ("cembench.algorithms.cem", "cembench.surfaces.cone", "cembench.running.local")
    slow = ("matplotlib", "PIL", "scipy.optimize", "pandas", "plotly", "igl", *others)
    code = f"""if True:
        import sys
        {command(*words)}
        print(*[name for name in {slow!r} if name in sys.modules], file=sys.stderr)
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.split() == []


def test_the_modules_are_seen_where_they_are_loaded():
    assert loaded("import numpy, scipy.sparse, cembench.running") >= {
        "numpy",
        "scipy.sparse",
        "cembench.running",
    }
