"""The short form of a report that the repository keeps."""

from __future__ import annotations

import csv
import io
import lzma
import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from benchmarks.origins import MEASURING, record
from benchmarks.pages import ROOT, Section, Table
from cembench.core.atomic import write_bytes, write_text
from cembench.results.report_records import PACKED, RECORDS

#: Columns of records that a kept report leaves out: long ones that nothing of it shows.
LEFT_OUT = ("energy_history", "phases", "extras", "seconds_calls")
#: Numbers longer than this many digits, which records are rounded to.
DIGITS, LONG = 6, re.compile(r"-?\d+\.\d{6,}(?:e[+-]?\d+)?")
#: JPEGs, and PNGs of more bytes, are kept as WebP of this quality, at most so many pixels across.
LARGE, WIDTH, QUALITY = 200_000, 1200, 70
#: Hashes, of which a quarter is kept: the first digits name them, and hashes do not pack.
HASH = re.compile(r"\b([0-9a-f]{16})[0-9a-f]{48}\b")
#: Links to what is left out, and the forms of a figure besides its picture: the records hold the
#: values that it was drawn from.
LINKS = re.compile(r"\[([^\]]*)\]\((?:records\.md#|pages/)[^)]*\)")
FORMS = re.compile(r" ?\((?:\[(?:SVG|PDF|data)\]\([^)]*\)(?:, )?)+\)")
FILES = re.compile(r"\]\(((?:figures|tables)/[^)#]*)")


def shortened(page: str, report: str) -> str:
    """Return a report's page without links to what is not kept; `report` is its kept folder."""
    page = FORMS.sub("", LINKS.sub(r"\1", page)).replace(f"({RECORDS})", f"({PACKED})")
    return re.sub(r"(Made by `cembench report \S+ -o )\S+`", rf"\1{report}`", page)


def short_records(text: str) -> str:
    """Return records in CSV without the columns that are left out, and with rounded numbers."""
    csv.field_size_limit(2**31 - 1)
    rows = list(csv.DictReader(io.StringIO(text)))
    columns = [name for name in rows[0] if name not in LEFT_OUT]
    lines = io.StringIO()
    writer = csv.DictWriter(lines, columns, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return rounded(lines.getvalue())


def rounded(text: str) -> str:
    """Return text with all numbers in it rounded, and hashes shortened.

    >>> rounded("[0.12345678901234567, 1.5e-12, 1.23456789012e-05]")
    '[0.123457, 1.5e-12, 1.23457e-05]'
    """
    return with_few_digits(HASH.sub(r"\1", text))


def with_few_digits(text: str) -> str:
    """Return text with all numbers in it rounded."""
    return LONG.sub(lambda number: f"{float(number[0]):.{DIGITS}g}", text)


def webp(file: Path) -> bytes:
    """Return a picture as WebP, made smaller if it is wider than kept ones are."""
    with Image.open(file) as opened:
        picture = opened.convert("RGB")
    picture.thumbnail((WIDTH, 10 * WIDTH))
    buffer = io.BytesIO()
    picture.save(buffer, "WEBP", quality=QUALITY, method=6)
    return buffer.getvalue()


def kept_report(report: Path, folder: Path, *, hide: Sequence[Path] = (), run: str = "") -> Section:
    """Shorten a report to what the repository keeps: page, plots, tables and records.

        cembench run ... -o results/real
        cembench report results/real -o results/real-report
        python -m benchmarks kept-report results/real-report reports/real --hide /home/me/meshes

    Pages and pictures of every surface, and every figure in three forms, make a clone heavy;
    `cembench report` makes them again from a run. Records are kept without their histories and
    phases, packed: six digits of numbers, sixteen of hashes. The folder is replaced if it holds
    a report. A folder of `hide`, one that others do not have, is named by its last part. `run` is
    the command that measured it, for `make refresh`.
    """
    folder = folder.absolute()
    name = folder.relative_to(ROOT) if folder.is_relative_to(ROOT) else folder
    page = shortened((report / "report.md").read_text(encoding="utf-8"), name.as_posix())
    records = short_records((report / RECORDS).read_text(encoding="utf-8"))
    if folder.exists():
        if not (folder / "report.md").exists():
            raise SystemExit(f"{folder} is there, but holds no report to replace.")
        shutil.rmtree(folder)
    for file in set(FILES.findall(page)):
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        kind = Path(file).suffix
        if kind == ".jpg" or (kind == ".png" and (report / file).stat().st_size > LARGE):
            small = Path(file).with_suffix(".webp")
            write_bytes(folder / small, webp(report / file))
            page = page.replace(f"]({file})", f"]({small.as_posix()})")
        else:
            shutil.copy(report / file, folder / file)
    write_text(folder / "report.md", page)
    for path in hide:
        records = records.replace(str(path), path.name)
    write_bytes(folder / PACKED, lzma.compress(records.encode(), preset=9 | lzma.PRESET_EXTREME))
    for file in folder.rglob("*"):
        if file.suffix in (".md", ".csv"):
            text = shown = file.read_text(encoding="utf-8")
            for path in hide:
                shown = shown.replace(str(path), path.name)
            if shown != text:
                write_text(file, shown)
    if folder.is_relative_to(ROOT):
        commits = re.findall(r"commit ([0-9a-f]{7,40})", page)
        record(name.as_posix(), MEASURING, run, None, commits[-1] if commits else "")
    files = [file for file in sorted(folder.rglob("*")) if file.is_file()]
    rows = [{"file": file.relative_to(folder), "bytes": file.stat().st_size} for file in files]
    return Section([Table(rows, "| file | bytes |\n|---|---:|\n| {file} | {bytes:,} |")])
