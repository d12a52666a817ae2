"""What is printed is what is there: nothing in a name or a title is read as markup."""

import json

import pytest
from rich.text import Text

from cembench.commands.console import PlainConsole
from cembench.results.store import Store
from tests.records import changed, record_of

HOSTILE = ("[/fast]", "[bold red]x", ":smile:", "[link=file:///etc]x[/link]", "a\x1b[31mb", "[")


def printed(capsys, *things, **options):
    PlainConsole().print(*things, **options)
    return capsys.readouterr().out


@pytest.mark.parametrize("name", HOSTILE)
def test_a_string_is_printed_as_it_is(capsys, name):
    from rich.table import Table

    shown = name.replace("\x1b", "\u241b")
    table = Table(title=name, box=None)
    table.add_column(name)
    table.add_row(name)
    for thing in (name, Text(name), table):
        assert shown in printed(capsys, thing)
    with PlainConsole().status(name, spinner="line") as status:
        status.update(name)
    assert shown in printed(capsys, status.renderable)


def test_styles_of_our_own_are_kept(capsys):
    from rich.console import Console

    console = PlainConsole()
    assert isinstance(console, Console)
    assert printed(capsys, Text("x", style="bold")) == "x\n"


@pytest.mark.parametrize("name", HOSTILE)
def test_every_verb_that_shows_records_shows_hostile_names(cli, name):
    shown = name.replace("\x1b", "\u241b")
    for run, factor in (("one", 1.0), ("two", 2.0)):
        records = [
            record_of([factor, factor], algorithm="hostile", mesh="hat"),
            record_of([], algorithm="cem", mesh="hat"),
        ]
        hostile = {"target": name}, {"outcome": {"cause": name, "traceback": name}}
        for record, fields in zip(records, hostile, strict=True):
            Store(cli.folder / run).save(changed(record, title=name, **fields), None, {"id": "e"})
    code, out, err = cli("status", "one")
    assert (code, shown in out, err) == (0, True, "")
    code, out, _ = cli("show", "hat/hostile", "--run", "one")
    assert (code, f"{shown} ({shown})" in " ".join(out.split())) == (0, True)
    code, out, _ = cli("show", "hat/cem", "--run", "one")
    assert out.count(shown) >= 3
    assert cli("compare", "one", "two")[0] == 0
    assert cli("merge", "one", "two", "-o", "both")[0] == 0
    assert json.loads(cli("show", "hat/hostile", "--run", "one", "--json")[1])[0]["title"] == name


@pytest.mark.parametrize("name", HOSTILE)
def test_every_verb_that_takes_a_name_shows_a_hostile_one(cli, name):
    for verb in (
        ("map", f"{name}.obj"),
        ("run", "--mesh", f"{name}.obj"),
        ("run", "--surfaces", name),
        ("run", "--mesh-dir", name),
        ("run", "--reference", name, "--surfaces", "flat-disk"),
        ("run", "--memory", name, "--surfaces", "flat-disk"),
        ("list", "--plugin", name),
        ("list", name),
        ("status", name),
        ("show", name),
        ("theory", name),
        ("holes", name),
        ("morph", name, name),
        ("fetch", name),
        ("validate", name),
        ("export", "--format", name),
        ("report", name),
        ("merge", name, "-o", "x"),
        ("compare", name, name),
        (name,),
    ):
        code, _, err = cli(*verb)
        assert code == 2, (verb, err)
        assert "Traceback" not in err


def test_a_hostile_title_is_listed_and_mapped(cli):
    (cli.folder / "mine.py").write_text(
        "from cembench import DiskMesh, algorithm\n"
        "from cembench.conformal.harmonic import *\n"
        "from cembench.algorithms.harmonic_circle import harmonic_circle as h\n"
        "@algorithm('fast', title='[/fast]', target='disk', notes='[/notes]', source='[/source]')\n"
        "def fast(mesh: DiskMesh, *, word: str = '[/word]'):\n"
        "    return h(mesh)\n"
    )
    code, out, _ = cli("list", "algorithms", "--verbose", "--plugin", "mine.py")
    assert code == 0
    for part in ("[/fast]", "[/notes]", "[/source]", "[/word]"):
        assert part in out
    assert "[/word]" in cli("list", "--plugin", "mine.py")[1]
    few = ("--surfaces", "flat-disk", "--faces", 100, "-a", "fast", "--plugin", "mine.py")
    assert cli("run", *few, "--dry-run")[0] == 0


def test_what_the_terminal_cannot_encode_is_printed_all_the_same(cli):
    code, _, err = cli("map", "\udcff.obj")
    assert (code, "\\udcff.obj" in err) == (2, True)
