"""Ways to damage a file: cut it, flip bits, shuffle lines, lie about numbers and counts."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

Mutation = Callable[[bytes, random.Random], bytes]

_NUMBER = re.compile(rb"(?<![\w.])-?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?(?![\w.])")
_NUMBERS = (
    *(b"nan", b"inf", b"-inf", b"1e200", b"1e400", b"-1", b"0", b"4294967295", b"2147483648"),
    *(b"99999999999999999999", b"1.5", b"", b"x", b"0x10", b"1,5", b"-0", b"+1", b"1e-320"),
)


def mutate(data: bytes, rng: random.Random) -> tuple[bytes, tuple[str, ...]]:
    """Apply one to three mutations; which they were is the second value."""
    names = [rng.choice(list(MUTATIONS)) for _ in range(rng.choice((1, 1, 1, 2, 3)))]
    for name in names:
        data = MUTATIONS[name](data, rng)
    return data, tuple(names)


def cut_anywhere(data: bytes, rng: random.Random) -> bytes:
    """Keep a beginning."""
    return data[: rng.randint(0, len(data))]


def cut_in_header(data: bytes, rng: random.Random) -> bytes:
    """Keep part of what a header would be."""
    return data[: rng.randint(0, min(len(data), 400))]


def cut_at_line(data: bytes, rng: random.Random) -> bytes:
    """Keep whole lines."""
    lines = data.splitlines(keepends=True)
    return b"".join(lines[: rng.randint(0, len(lines))])


def cut_near_end(data: bytes, rng: random.Random) -> bytes:
    """Take away the last bytes: part of a line or a record."""
    return data[: len(data) - rng.randint(1, 60)]


def cut_at_record(data: bytes, rng: random.Random) -> bytes:
    """Take away whole records of the usual sizes of binary formats."""
    return data[: len(data) - rng.choice((13, 50, 12, 24, 4, 8)) * rng.randint(1, 3)]


def cut_out(data: bytes, rng: random.Random) -> bytes:
    """Take away a piece from the middle."""
    start = rng.randint(0, len(data))
    return data[:start] + data[start + rng.randint(1, 80) :]


def flip_bits(data: bytes, rng: random.Random) -> bytes:
    """Flip a few bits."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8)) if data else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def flip_bits_in_header(data: bytes, rng: random.Random) -> bytes:
    """Flip a bit near the beginning."""
    changed = bytearray(data)
    if data:
        changed[rng.randrange(min(len(changed), 200))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def replace_bytes(data: bytes, rng: random.Random) -> bytes:
    """Overwrite some bytes by anything."""
    start, junk = rng.randint(0, len(data)), rng.randbytes(rng.choice((1, 4, 16)))
    return data[:start] + junk + data[start + len(junk) :]


def extreme_bytes(data: bytes, rng: random.Random) -> bytes:
    """Overwrite four or eight bytes by what makes the largest numbers, or NaN."""
    junk = rng.choice((b"\xff" * 4, b"\x7f" * 8, b"\0" * 4, b"\0\0\xf0\x7f", b"\xff\xff\xff\x7f"))
    start = rng.randint(0, len(data))
    return data[:start] + junk + data[start + len(junk) :]


def insert_junk(data: bytes, rng: random.Random) -> bytes:
    """Insert bytes of any value."""
    start = rng.randint(0, len(data))
    return data[:start] + rng.randbytes(rng.choice((1, 3, 50, 2000))) + data[start:]


def append_junk(data: bytes, rng: random.Random) -> bytes:
    """Append bytes."""
    return data + rng.choice((rng.randbytes(7), b"\0" * 50, b"\n3 0 1 2\n", b"\nf 1 2 3\n"))


def long_line(data: bytes, rng: random.Random) -> bytes:
    """Insert a line, or lengthen one, by many characters."""
    lines = data.split(b"\n")
    k = rng.randrange(len(lines))
    long = rng.choice((b"x", b" ", b"1 ", b"#")) * rng.choice((5_000, 200_000))
    lines[k] = rng.choice((long, lines[k] + b" " + long, lines[k] + b"\n" + long))
    return b"\n".join(lines)


def duplicate_line(data: bytes, rng: random.Random) -> bytes:
    """Write a line twice."""
    lines = data.split(b"\n")
    k = rng.randrange(len(lines))
    return b"\n".join([*lines[: k + 1], *lines[k:]])


def delete_line(data: bytes, rng: random.Random) -> bytes:
    """Leave a line out."""
    lines = data.split(b"\n")
    del lines[rng.randrange(len(lines))]
    return b"\n".join(lines)


def swap_lines(data: bytes, rng: random.Random) -> bytes:
    """Exchange two lines."""
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def drop_word(data: bytes, rng: random.Random) -> bytes:
    """Leave out a word of a line."""
    lines = data.split(b"\n")
    k = rng.randrange(len(lines))
    words = lines[k].split(b" ")
    del words[rng.randrange(len(words))]
    lines[k] = b" ".join(words)
    return b"\n".join(lines)


def replace_number(data: bytes, rng: random.Random) -> bytes:
    """Write another number, or none, for a number."""
    results = list(_NUMBER.finditer(data))
    if not results:
        return replace_bytes(data, rng)
    where = rng.choice(results)
    return data[: where.start()] + rng.choice(_NUMBERS) + data[where.end() :]


def change_count(data: bytes, rng: random.Random) -> bytes:
    """Change one of the first numbers, where counts are declared, by a little or by much."""
    found = list(_NUMBER.finditer(data[:600]))[:6]
    if not found:
        return extreme_bytes(data, rng)
    where = rng.choice(found)
    try:
        value = int(where.group())
    except ValueError:
        value = 7
    new = rng.choice((value - 1, value + 1, 2 * value, 0, -value, 10**9, 2**31, 2**63, 10**30))
    return data[: where.start()] + str(new).encode() + data[where.end() :]


def change_binary_count(data: bytes, rng: random.Random) -> bytes:
    """Change the count of a binary STL, or what stands at its place."""
    new = rng.choice((0, 1, 2, 10**6, 2**32 - 1)).to_bytes(4, "little")
    return data[:80] + new + data[84:]


def change_endianness(data: bytes, rng: random.Random) -> bytes:
    """Say of a PLY that it is of the other order, or that it is text; swap bytes elsewhere."""
    little, big, text = b"binary_little_endian", b"binary_big_endian", b"ascii"
    for form in (little, big, text):
        if form in data:
            return data.replace(form, rng.choice([f for f in (little, big, text) if f != form]), 1)
    start = rng.randint(0, len(data))
    return data[:start] + data[start : start + 4][::-1] + data[start + 4 :]


def change_encoding(data: bytes, rng: random.Random) -> bytes:
    """Write it as another encoding of text would, or with another end of line."""
    kind = rng.choice(("utf-16", "utf-8-sig", "cr", "crlf", "latin-1 comment", "nul"))
    if kind in ("utf-16", "utf-8-sig"):
        return data.decode("latin-1").encode(kind)
    if kind == "cr":
        return data.replace(b"\n", b"\r")
    if kind == "crlf":
        return data.replace(b"\n", b"\r\n")
    if kind == "nul":
        return data.replace(b" ", b"\0", 3)
    return data.replace(b"\n", b"\n# \xe4\xf6\xfc\n", 1)


def repeat_all(data: bytes, rng: random.Random) -> bytes:
    """Append the file to itself."""
    return data + data


def exchange_keyword(data: bytes, rng: random.Random) -> bytes:
    """Misspell or change the case of a keyword."""
    results = list(re.finditer(rb"[A-Za-z_]{1,16}", data[:2000]))
    if not results:
        return flip_bits(data, rng)
    where = rng.choice(results)
    word = where.group()
    new = rng.choice((word.upper(), word[:-1], word + b"s", word + b" ", b"list", b"vertex", b""))
    return data[: where.start()] + new + data[where.end() :]


MUTATIONS: dict[str, Mutation] = {
    mutation.__name__.replace("_", " "): mutation
    for mutation in (
        *(cut_anywhere, cut_in_header, cut_at_line, cut_near_end, cut_at_record, cut_out),
        *(flip_bits, flip_bits_in_header, replace_bytes, extreme_bytes, insert_junk, append_junk),
        *(long_line, duplicate_line, delete_line, swap_lines, drop_word, replace_number),
        *(change_count, change_binary_count, change_endianness, change_encoding, repeat_all),
        exchange_keyword,
    )
}
