"""Safe file names from names that anyone may have chosen: of meshes, algorithms, machines.

A name is data. It may hold slashes or bytes that are not text, be longer than a file system allows,
or be reserved on some system. Every name that becomes part of a path goes through this module.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches

#: Common file systems allow 255 bytes per file name; two names and a key share them.
LONGEST = 100
#: Digits of the hash that replaces what a file name cannot hold.
DIGITS = 12

_FORBIDDEN = re.compile(r'[<>:"/\\|?*]')
_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)
_MADE_HERE = re.compile(rf"~[0-9a-f]{{{DIGITS}}}$")


def printable(name: str) -> str:
    r"""Return a name with unprintable characters, and bytes that are not UTF-8, as escapes.

    >>> printable("caf\udce9"), printable("one\ntwo"), printable("ß")
    ('caf\\udce9', 'one\\ntwo', 'ß')
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a question with the known names that are nearest to a name; "" if none is near.

    >>> did_you_mean("fat-disk", ["flat-disk", "cone"]), did_you_mean("x", ["cone"])
    (' Did you mean flat-disk?', '')
    >>> did_you_mean("CEM", ["cem", "fdm"]), did_you_mean("tutte", ["cem", "harmonic-tutte"])
    (' Did you mean cem?', ' Did you mean harmonic-tutte?')
    """
    names, low = list(dict.fromkeys(known)), name.lower()
    close = [low] if low in map(str.lower, names) else get_close_matches(low, map(str.lower, names))
    near = [one for text in close for one in names if one.lower() == text]
    near = near or [one for one in names if one.lower().startswith(low)]
    near = near or [one for one in names if low in one.lower()]
    return f" Did you mean {' or '.join(near)}?" if name and near else ""


def file_name(name: str, longest: int = LONGEST) -> str:
    """Return a name for a file or folder: `name` itself if every system accepts it.

    Otherwise its usable part plus a hash, so that different names give different files. The
    result never leads out of its folder and has at most `longest` bytes.

    >>> file_name("face (1)"), file_name("../x")
    ('face (1)', 'x~d6b96a97d147')
    """
    if _is_ordinary(name, longest):
        return name
    readable = re.sub(r"[^A-Za-z0-9.+-]+", "_", name).strip("._")
    return f"{readable[: longest - DIGITS - 1]}~{digest(name)[:DIGITS]}"


#: Maximum number of known names that a message lists.
MAX_NAMED = 60


def unknown(kind: str, name: str, known: Iterable[str]) -> str:
    """Return a message for an unknown name, with those that are spelled alike before all others.

    >>> unknown("metric", "image_aera", ["dirichlet_energy", "image_area"])
    "unknown metric 'image_aera'. Did you mean image_area? Known: dirichlet_energy, image_area."
    """
    known = sorted(known)
    names = ", ".join(known[:MAX_NAMED]) or "none"
    names += f" and {len(known) - MAX_NAMED} more" if len(known) > MAX_NAMED else ""
    near = did_you_mean(name, known)
    return f"unknown {kind} {name!r}{f'.{near} Known' if near else '; known'}: {names}."


def slug(name: str, longest: int = LONGEST) -> str:
    """Return a name of lower-case letters, digits and hyphens, of at most `longest` characters.

    Different names may have the same slug: see :func:`distinct_slugs`.

    >>> slug("Ann's Wry Face")
    'ann-s-wry-face'
    """
    plain = re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-").lower() or "unnamed"
    if len(plain) <= longest:
        return plain
    return f"{plain[: longest - DIGITS - 1].rstrip('-')}-{digest(name)[:DIGITS]}"


def distinct_slugs(names: Mapping[str, str]) -> dict[str, str]:
    """Return a unique slug for each name; keys are hashes that distinguish equal names.

    >>> distinct_slugs({"12ab": "A b", "34cd": "a-b", "56ef": "c"})
    {'12ab': 'a-b-12ab', '34cd': 'a-b-34cd', '56ef': 'c'}
    """
    plain = {key: slug(name) for key, name in names.items()}
    shared = [one for one in set(plain.values()) if list(plain.values()).count(one) > 1]
    taken: set[str] = set()
    slugs = {}
    for key, name in plain.items():
        wanted = f"{name}-{slug(key)[:8]}" if name in shared else name
        tries = [wanted, *(f"{wanted}-{k}" for k in range(2, len(names) + 2))]
        slugs[key] = next(one for one in tries if one not in taken)
        taken.add(slugs[key])
    return slugs


def digest(name: str) -> str:
    """Return the SHA-256 of a name as hexadecimal digits."""
    return hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()


def in_lists(title: str) -> str:
    """Return an algorithm's title without a comma outside brackets, since titles stand in lists.

    >>> in_lists("CETM, flips"), in_lists("FDM, its authors' program (external)"), in_lists("CEM")
    ('CETM (flips)', "FDM (its authors' program, external)", 'CEM')
    """
    name, comma, rest = title.partition(", ")
    if not comma or "(" in name:
        return title
    return f"{name} ({rest.replace(' (', ', ').replace(')', '')})"


def _is_ordinary(name: str, longest: int) -> bool:
    """Whether every common system accepts a name as a file name."""
    return (
        0 < len(name.encode("utf-8", "surrogatepass")) <= longest
        and name.isprintable()
        and not name.startswith((".", " "))
        and not name.endswith((".", " "))
        and not _FORBIDDEN.search(name)
        and not _RESERVED.fullmatch(name)
        and not _MADE_HERE.search(name)
    )
