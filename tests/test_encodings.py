"""Texts have a stated encoding, whatever the locale is, and output may be closed."""

import ast
import os
import subprocess
import sys

import pytest

from tests.test_direct_writes import PACKAGES, PROJECT

#: Functions that open a text unless they are told otherwise.
OPENING = ("open", "fdopen", "NamedTemporaryFile", "TemporaryFile", "TextIOWrapper")
#: What `open` is a method of that gives no text.
OTHERS = ("os", "Image", "archive", "tarfile", "webbrowser", "member", "zipfile", "zip")


def without_encoding(source):
    """The lines of calls that read or write a text in the encoding of the locale."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call) and is_of_the_locale(node)
    ]


def is_of_the_locale(call):
    function, method = call.func, isinstance(call.func, ast.Attribute)
    name = function.attr if method else getattr(function, "id", "")
    owner = ast.unparse(function.value) if method else ""
    named = {keyword.arg: keyword.value for keyword in call.keywords}
    if "encoding" in named:
        return False
    if name in ("read_text", "write_text") and method:
        return True
    if owner == "subprocess" and {"text", "universal_newlines"} & named.keys():
        return True
    if name not in OPENING or (name == "open" and owner in OTHERS):
        return False
    given = [one.value for one in (*call.args, named.get("mode")) if isinstance(one, ast.Constant)]
    modes = [str(one) for one in given if set(str(one)) <= set("rwxabt+")]
    is_binary_by_itself = name.endswith("TemporaryFile")
    return not any("b" in mode for mode in modes) and (bool(modes) or not is_binary_by_itself)


def test_every_text_file_has_an_encoding():
    offenders = [
        f"{path.relative_to(PROJECT)}:{line}"
        for package in PACKAGES
        for path in sorted((PROJECT / package).rglob("*.py"))
        for line in without_encoding(path.read_text(encoding="utf-8"))
    ]
    assert offenders == []


@pytest.mark.parametrize(
    "code",
    [
        "path.read_text()",
        "path.write_text(text)",
        "open(path)",
        "path.open('w')",
        "os.fdopen(handle)",
        "tempfile.NamedTemporaryFile('w')",
        "subprocess.run(command, text=True)",
    ],
)
def test_a_text_in_the_encoding_of_the_locale_is_noticed(code):
    assert without_encoding(code) == [1]
    told = code.removesuffix(")") + ("" if code.endswith("()") else ", ") + "encoding='utf-8')"
    assert without_encoding(told) == []


@pytest.mark.parametrize(
    "code",
    [
        "path.open('rb')",
        "os.open(path, flags)",
        "tempfile.NamedTemporaryFile()",
        "Image.open(path)",
    ],
)
def test_what_has_no_encoding_is_not(code):
    assert without_encoding(code) == []


def cembench(*words, folder, closed=(), **environment):
    """Run the command as a supervisor would: in another locale, with streams closed."""
    known = {k: v for k, v in os.environ.items() if not k.startswith(("LC_", "LANG", "PYTHONIO"))}
    close = "".join(f" {number}>&-" if number else " 0<&-" for number in closed)
    command = [sys.executable, "-m", "cembench.commands.cli", *map(str, words)]
    script = f'"$@"{close}'
    return subprocess.run(
        ["sh", "-c", script, "sh", *command],
        cwd=folder,
        env=known | environment,
        capture_output=True,
        check=False,
    )


#: Locales whose texts are not UTF-8; Python turns plain C into UTF-8 unless it is told not to.
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
CP1252 = {**ASCII, "PYTHONIOENCODING": "cp1252"}
ROUND = ("run", "-a", "harmonic-circle", "--surfaces", "cone", "--faces", 300, "--rounds", 1)


@pytest.mark.skipif(sys.platform == "win32", reason="a POSIX shell closes the streams")
@pytest.mark.parametrize("closed", [(1,), (0, 1, 2)])
def test_closed_streams_are_no_fault(tmp_path, closed):
    for words in (("list", "algorithms"), ROUND):
        ended = cembench(*words, folder=tmp_path, closed=closed)
        assert ended.returncode == 0, ended.stderr
        assert b"internal error" not in ended.stderr
    assert list((tmp_path / "results/run/records").glob("*.json"))
    ended = cembench("list", "no-such", folder=tmp_path, closed=closed)
    assert ended.returncode == 2


@pytest.mark.parametrize("locale", [ASCII, CP1252])
def test_in_another_locale_everything_is_written_as_utf_8(tmp_path, locale):
    plugin = tmp_path / "mine.py"
    plugin.write_text(
        "from cembench import AlgorithmFailed, DiskMesh, Parameterization, algorithm\n\n\n"
        "@algorithm('mine', title='Müller ∘ Möbius', target='disk')\n"
        "def mine(mesh: DiskMesh) -> Parameterization:\n"
        "    raise AlgorithmFailed('kein Kreis: ∮ ≠ 0')\n",
        encoding="utf-8",
    )
    ended = cembench(*ROUND, "--plugin", plugin, "-a", "mine", folder=tmp_path, **locale)
    assert ended.returncode == 1, ended.stderr
    assert b"internal error" not in ended.stderr
    (record,) = (tmp_path / "results/run/records").glob("*--mine--*.json")
    assert "kein Kreis: ∮ ≠ 0" in record.read_text(encoding="utf-8")
    ended = cembench("report", "results/run", folder=tmp_path, **locale)
    assert ended.returncode == 0, ended.stderr
    page = (tmp_path / "results/run/report/index.html").read_text(encoding="utf-8")
    assert "Müller ∘ Möbius" in page
    for words in (("status", "results/run"), ("show", "results/run"), ("doctor",)):
        assert b"internal error" not in cembench(*words, folder=tmp_path, **locale).stderr
