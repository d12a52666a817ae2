"""No code decides on the wording of a message: kinds are data, texts are for people."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: Methods that look into a text.
LOOKS = ("startswith", "endswith", "find", "index", "count", "partition", "split")
#: What may look at words all the same: the file, what it looks for, and why.
ALLOWED = {
    ("cembench/running/environment.py", "model name"): "a key of /proc/cpuinfo",
    ("cembench/report/pictures.py", "A"): "a band of an image",
}
#: Values of enumerations and of Literal types that are written with a space, or a capital.
DATA = {
    "circular holes", "free boundary", "harmonic measure", "too few rounds", "not claimed",
    "Figure 2", "E_C", "at the outer boundary", "File", "UNSTRUCTURED_GRID",
}  # fmt: skip


def is_wording(node):
    if not (isinstance(node, ast.Constant) and isinstance(node.value, str)):
        return False
    text = node.value.strip()
    return any(c.isalpha() for c in text) and (" " in text or text[:1].isupper())


def texts(node):
    """The constants that an expression stands for: itself, or the entries of a tuple."""
    return node.elts if isinstance(node, ast.Tuple) else [node]


def looked_for(node):
    """Every text that this expression decides on, if it is one that does."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        if node.func.attr in LOOKS:
            yield from (t for argument in node.args for t in texts(argument))
    elif isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        for operator, left, right in zip(node.ops, sides, sides[1:], strict=False):
            if isinstance(operator, ast.In | ast.NotIn) and not isinstance(
                right, ast.Tuple | ast.List | ast.Set
            ):
                yield left
            elif isinstance(operator, ast.Eq | ast.NotEq):
                yield from (left, right)


def decisions(source):
    """The line and the words, wherever the source decides on words."""
    for node in ast.walk(ast.parse(source)):
        for text in looked_for(node):
            if is_wording(text) and text.value not in DATA:
                yield node.lineno, text.value


def test_no_code_decides_on_the_wording_of_a_message():
    found, used = [], set()
    for folder in ("cembench", "algorithms", "meshes_gen", "papers", "sharing", "textures"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            for line, words in decisions(path.read_text()):
                used.add((name, words))
                if (name, words) not in ALLOWED:
                    found.append(f"{name}:{line} decides on {words!r}")
    assert not found
    assert used == ALLOWED.keys(), "an exception that nothing needs any more"


@pytest.mark.parametrize(
    "source",
    [
        'bad = notice.startswith("Definition 1")',
        'bad = cause.endswith(("so", "are folded"))',
        'bad = any("not deterministic" in note for note in notes)',
        'bad = why == "not asked for"',
        'bad = "the boundary" != why',
        'bad = why.split("because of ")',
    ],
)
def test_what_the_check_finds(source):
    assert list(decisions(source))


@pytest.mark.parametrize(
    "source",
    [
        'fine = path.name.endswith(".json")',
        'fine = target in ("disk", "circular holes")',
        'fine = kind == "ok"',
        'fine = words.split(", ")',
    ],
)
def test_what_it_leaves_alone(source):
    assert not list(decisions(source))
