"""Files of a user that look like the package's own, and whether they are still as they were."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

#: Where, and what: names that the package uses itself, or might take for its own.
FILES = {
    "scratch/thesis.txt": "three years of work",
    "scratch/figures/.draft-figure": "a figure",
    ".draft-notes": "notes",
    ".draft-letters/to-mother.txt": "a letter",
    ".cembench-mine/diary.txt": "a diary",
    ".report-mine/page.html": "a page",
    "draft.obj": "not a mesh",
    "contents.json": '["notes.txt", "scratch/thesis.txt", "index.html", "mesh-of-mine.obj"]',
    "index.html": "<p>a home page</p>",
    "report.md": "# A report of mine",
    "report.tex": "mine",
    "records.csv": "a,b\n1,2\n",
    "figures/photo.png": "a photo",
    "tables/prices.csv": "apples,2\n",
    "pages/one.md": "a page",
    "notes.txt": "more notes",
    "mesh-of-mine.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "plan.json": '{"plan": "rest"}',
    "lock": "a lock of hair",
    "log.txt": "a log",
    "job.json": "{}",
    "samples/tea/green.jsonl": "{}\n",
    "maps/city.npz": "a city",
    "meshes/mine.npz": "a mesh",
    "environments/office.json": "{}",
    "records/mine.json": '{"record": 33}',
    "tiny.mat.part": "a part",
}
#: When they were last written, so that a touch shows.
LONG_AGO = 1_000_000_000


def plant(folder: Path, outside: Path) -> None:
    """Fill a folder with decoys: files, read-only ones, symlinks, one that leads nowhere."""
    for name, content in FILES.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    for name in ("scratch/thesis.txt", "records/mine.json", "notes.txt"):
        (folder / name).chmod(0o444)
    outside.mkdir(parents=True, exist_ok=True)
    (outside / "will.txt").write_text("my last will")
    (folder / "link-to-a-folder").symlink_to(outside)
    (folder / ".draft-link").symlink_to(outside / "will.txt")
    (folder / "link-to-nothing").symlink_to(outside / "nothing")
    for path in [*folder.rglob("*"), *outside.rglob("*")]:
        os.utime(path, (LONG_AGO, LONG_AGO), follow_symlinks=False)


def snapshot(folder: Path) -> dict[str, str]:
    """Describe everything in a folder: bytes, mode and time of files, targets of symlinks."""
    return {str(path.relative_to(folder)): _described(path) for path in sorted(folder.rglob("*"))}


def _described(path: Path) -> str:
    if path.is_symlink():
        return f"symlink to {path.readlink()}"
    if path.is_dir():
        return "folder"
    about = path.stat()
    digest = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    return f"{digest}, mode {about.st_mode:o}, written at {about.st_mtime_ns}"


def harmed(before: dict[str, str], folder: Path) -> list[str]:
    """Return the files of a snapshot that are gone or not as they were."""
    now = snapshot(folder)
    return sorted(name for name, about in before.items() if now.get(name) != about)
