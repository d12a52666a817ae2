"""The records of a run, which the repository keeps so that its report can be made again."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

from benchmarks.kept_report import with_few_digits
from benchmarks.origins import MEASURING, record
from benchmarks.pages import ROOT, Section
from cembench.core.atomic import write_text
from cembench.core.errors import RecordError
from cembench.results import run_folder
from cembench.results.records import digest
from cembench.results.store import Store

#: What a kept run lacks: maps and surfaces, which a report draws, and what a run alone needs.
LEFT_OUT = ("maps", "meshes", "samples", "lock")


def shorten(file: Path, hide: Sequence[Path] = ()) -> None:
    """Write a JSON file of a run in short: a record's figures rounded, and its digest anew."""
    text = file.read_text(encoding="utf-8")
    for path in hide:
        text = text.replace(str(path), path.name)
    content = json.loads(text)
    if "digest" in content:
        content["outcome"] = json.loads(with_few_digits(json.dumps(content["outcome"])))
        content["digest"] = digest(content)
    write_text(file, json.dumps(content, separators=(",", ":"), ensure_ascii=False) + "\n")


def kept_run(run: Path, folder: Path, *, hide: Sequence[Path] = (), command: str = "") -> Section:
    """Keep a run's records, without maps and surfaces: `cembench report` makes its page again.

        cembench run ... -o results/ldm
        python -m benchmarks kept-run results/ldm reports/papers/ldm2018 --hide ~/ldm
        cembench report reports/papers/ldm2018 --paper ldm2018

    A folder of `hide`, one that others do not have, is named by its last part. Figures are rounded
    as in a kept report, and records get their digests anew. The folder is replaced if it holds a
    run. `command` is the one
    that measured it, for `make refresh`.
    """
    run_folder.check(run)
    folder = folder.absolute()
    if folder.exists():
        try:
            run_folder.check(folder)
        except RecordError as error:
            raise SystemExit(f"{folder} is there, but holds no run to replace.") from error
        shutil.rmtree(folder)
    shutil.copytree(run, folder, ignore=shutil.ignore_patterns(*LEFT_OUT))
    files = sorted(folder.rglob("*.json"))
    for file in files:
        shorten(file, hide)
    if folder.is_relative_to(ROOT):
        measured = [one.get("git") for one in Store(folder).environments().values()]
        commit = max(((git or {}).get("commit") or "" for git in measured), default="")[:12]
        record(folder.relative_to(ROOT).as_posix(), MEASURING, command, None, commit)
    size = sum(file.stat().st_size for file in files)
    return Section([f"{folder.name}: {len(files)} files, {size:,} bytes"])
