"""Functions of MATLAB and Octave are called by code; nothing in a path becomes part of it."""

import re
import shlex

import pytest

from cembench.core.errors import RegistryError
from cembench.core.program import Program, matlab_string, of_matlab_function

HOSTILE = [
    "it's/me",
    'a"); system("touch pwned"); ("',
    "'); system('touch pwned'); ('",
    "{threads}/{input}",
    "back\\slash %s",
    "ä b",
]


def value_of(code):
    """Read strings at the start of code as MATLAB does; return the value and the rest."""
    text, at = "", 1
    assert code[0] == "["
    while code[at] != "]":
        literal = re.match(r" *(?:'((?:[^']|'')*)'|char\((\d+)\))", code[at:])
        assert literal, code[at:]
        text += chr(int(literal[2])) if literal[2] else literal[1].replace("''", "'")
        at += literal.end()
    return text, code[at + 1 :]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_string_is_the_same_in_the_code(name):
    assert value_of(matlab_string(name)) == (name, "")


@pytest.mark.parametrize("name", HOSTILE)
def test_paths_are_strings_of_a_functions_code_whatever_they_are_called(tmp_path, name):
    folder = tmp_path / name
    made = of_matlab_function(folder / "flat.m")
    assert made.pop("language") == "matlab"
    words = Program(tuple(shlex.split(made["command"])), language="matlab").words(
        {"input": f"/in/{name}", "output": f"/out/{name}", "threads": "1"}
    )
    code = words[-1]
    collected = []
    for before in ("addpath(", "load(", "save('-v7', "):
        text, code = value_of(code[code.index(before) + len(before) :])
        collected.append(text)
    assert collected == [str(folder), f"/in/{name}", f"/out/{name}"]
    assert code == ", 'uv');"


@pytest.mark.parametrize("name", ["a; system('x').m", "1st.m", "a-b.m", "ä.m", "line\nbreak/a.m"])
def test_a_file_that_cannot_be_called_is_refused(tmp_path, name):
    with pytest.raises(RegistryError, match="cannot be called as a function"):
        of_matlab_function(tmp_path / name)
