"""Wavefront OBJ files: vertices and faces only.

Own code, because meshio, trimesh and libigl each lose faces of valid files silently (after a tab,
in an indented line, in a truncated last line) or refuse them (comments after a face, texture seams,
Latin-1 text).
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from pathlib import Path

from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import BYTE_ORDER_MARK, Soup, damaged, refuse_underscores, shown, words_of

#: Statements without polygons, which are skipped; any other word is reported.
_SKIPPED = frozenset(
    "vt vn vp deg bmat step cstype p l curv curv2 surf parm trim hole scrv sp end con bevel "  # noqa: SIM905
    "c_interp d_interp lod shadow_obj trace_obj ctech stech call csh bsp bzp cdc cdp res".split()
)
#: Statements that end with a name, which may end with a backslash.
_NAMED = frozenset(("o", "g", "s", "mg", "usemtl", "mtllib", "usemap", "maplib"))


def read_obj(path: Path) -> Soup:
    """Read the vertices and polygons of an OBJ file; texture seams do not cut the surface."""
    coordinates, corners, sizes = array("d"), array("q"), array("q")
    unknown: list[str] = []
    # Latin-1 decodes any bytes: names and comments may have any encoding.
    with path.open(encoding="latin-1") as file:
        lines = enumerate(file, 1)
        for number, line in lines:
            words = statement_words(number, line, lines)
            if not words or words[0] in _NAMED:
                continue
            try:
                if words[0] == "v":
                    coordinates.extend(_point(words))
                elif words[0] in ("f", "fo"):
                    face = _face(words, len(coordinates) // 3)
                    corners.extend(face)
                    sizes.append(len(face))
                elif words[0] and words[0] not in _SKIPPED and words[0] not in _NAMED:
                    unknown.append(f"line {number}, {shown(line)}")
            except (ValueError, OverflowError) as error:
                raise damaged(f"line {number}, {shown(line)}: {error}") from None
    return Soup.from_arrays(
        coordinates, corners, sizes, counted_from=1, notices=_unknown_notice(unknown)
    )


def statement_words(number: int, line: str, lines: Iterator[tuple[int, str]]) -> list[str]:
    """Return the words of the statement that starts in a line, including continuation lines."""
    words = words_of(line)
    if words and words[0] not in _NAMED and ("#" in line or "\\" in line or number == 1):
        return _whole_statement(line, lines)
    return words


def _whole_statement(line: str, lines: Iterator[tuple[int, str]]) -> list[str]:
    """Return the words of a line without its comment, and of the lines that continue it.

    The result is never empty: an empty statement is one empty word.
    """
    words: list[str] = []
    while True:
        text, comment, _ = line.removeprefix(BYTE_ORDER_MARK).partition("#")
        words += words_of(text)
        if comment or not words or not words[-1].endswith("\\"):
            return words or [""]
        words[-1:] = words[-1].removesuffix("\\").split()
        line = next(lines, (0, ""))[1]


def _point(words: list[str]) -> list[float]:
    """Return the three coordinates; a weight or a colour may follow them."""
    numbers = [float(word) for word in words[1:]]
    if len(numbers) < 3:
        raise ValueError(f"a vertex needs 3 numbers, but this one has {len(numbers)}")
    refuse_underscores(words)
    return numbers[:3]


def _face(words: list[str], vertices: int) -> list[int]:
    """Return vertex indices, counted from 1; negative ones count back from the latest vertex."""
    face = [int(word.split("/", 1)[0]) for word in words[1:]]
    if len(face) < 3:
        raise ValueError(f"a face needs 3 corners, but this one has {len(face)}")
    refuse_underscores(words)
    if min(face) < 1:
        if 0 in face or min(face) < -vertices:
            raise ValueError(
                f"vertex index out of range; allowed are 1 to {vertices}, or -1 to -{vertices} "
                "counted backward"
            )
        face = [k if k > 0 else vertices + 1 + k for k in face]
    return face


def _unknown_notice(unknown: list[str]) -> tuple[Notice, ...]:
    if not unknown:
        return ()
    told = (
        f"lines that are not statements of OBJ were ignored: {len(unknown)}, the first: "
        f"{unknown[0]}"
    )
    return (Notice(NoticeKind.LINES_IGNORED, told),)
