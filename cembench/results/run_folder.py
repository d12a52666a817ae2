"""The folder of a run: its marker, its own names, and its scratch folder.

A run writes only to these names, and deletes only files under names that it gave itself; see
:mod:`cembench.results.store`.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from pydantic import TypeAdapter

from cembench.core import folders
from cembench.core.atomic import clear_drafts
from cembench.core.errors import RecordError
from cembench.results.records import Cell

#: Folders of a run.
FOLDERS = ("records", "maps", "meshes", "environments", "samples", "exhibits", "others")
#: Files of a run, without its marker.
PLAN, LOCK, MACHINES, SIGNATURE = "plan.json", "lock", "machines.json", "signature"
#: The file of a bundle's metadata: author, licence, and the hash of each file.
METADATA = "ro-crate-metadata.json"
#: Adapter for the cells of a plan.
CELLS = TypeAdapter(list[Cell])


def check(folder: Path) -> None:
    """Raise :class:`RecordError` if a run must not write to a folder; nothing is changed."""
    folders.check(folder, "run")
    _check_names(folder)


def claim(folder: Path) -> folders.Marker:
    """Return the marker of a run's folder; write it if the folder is new."""
    check(folder)
    return folders.claim(folder, "run")


def is_own(folder: Path, path: Path) -> bool:
    """Whether a path belongs to the run in this folder."""
    try:
        inside = path.resolve().relative_to(folder.resolve())
    except ValueError:
        return False
    own = (*FOLDERS, PLAN, LOCK, MACHINES, SIGNATURE, folders.MARKERS["run"])
    return not inside.parts or inside.parts[0] in own


def empty_scratch(folder: Path) -> Path:
    """Return an empty folder for files exchanged between processes; leftovers are removed.

    Only one run at a time may call this. The folder's name contains the marker's random token.
    """
    scratch = folder / f"scratch-{claim(folder).token}"
    if scratch.is_dir() and not scratch.is_symlink():
        shutil.rmtree(scratch)
    scratch.mkdir()
    for place in (folder, *(folder / name for name in FOLDERS)):
        clear_drafts(place)
    for place in (*folder.glob("samples/*/"), *folder.glob("exhibits/*/")):
        if not place.is_symlink():
            clear_drafts(place)
    return scratch


def _check_names(folder: Path) -> None:
    """Raise if one of the run's names is a symbolic link or something of another kind."""
    lock, plan = folder / LOCK, folder / PLAN
    wrong = [folder / name for name in FOLDERS if folders.is_link_or_not_folder(folder / name)]
    if (lock.exists() or lock.is_symlink()) and not folders.is_empty_file(lock):
        wrong.append(lock)
    if plan.is_symlink() or (plan.exists() and not plan.is_file()):
        wrong.append(plan)
    if wrong:
        raise RecordError(
            f"{wrong[0]} is in the way: a run stores its own data under that name, and this is "
            "something else or a symbolic link. Nothing was changed. Move it away, or name another "
            "folder with -o."
        )
