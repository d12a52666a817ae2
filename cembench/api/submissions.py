"""Send a run to a collection of results, and check what others sent."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cembench.api.settings import AnyPath
from cembench.core.arguments import checked
from cembench.core.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from cembench.results.bundle import Bundle
    from cembench.results.store import Store

#: How the file of a bundle ends.
SUFFIX = ".zip"


@dataclass(frozen=True)
class Submission:
    """A bundle that was checked.

    Parameters
    ----------
    name : str
        Its file's name without the suffix.
    faults : tuple of str
        Why it is refused; empty if it is accepted.
    cells : int
        The number of its records.
    machines : tuple of str
        The machines, as they named themselves.
    maps : int
        The number of maps whose figures were computed again.
    signer : str
        Who signed it, if that was asked for.

    Examples
    --------
    >>> from cembench import Submission
    >>> Submission("mine", faults=("it holds no record",)).accepted
    False

    """

    name: str
    faults: tuple[str, ...] = ()
    cells: int = 0
    machines: tuple[str, ...] = ()
    maps: int = 0
    signer: str = ""

    @property
    def accepted(self) -> bool:
        """Whether there is no fault."""
        return not self.faults


@checked
def submit(
    run: AnyPath,
    output: AnyPath,
    *,
    maps: bool = False,
    licence: str = "CC-BY-4.0",
    surfaces_licence: str | None = None,
    author: str | None = None,
    key: AnyPath | None = None,
    overwrite: bool = False,
) -> Submission:
    """Write a run as one checked file that can be sent to a collection of results.

    The file is a zip archive with RO-Crate metadata: the records, the hashes of the maps, machine,
    commit, versions, and the licences of the surfaces. It is checked as the collection will do.

    Parameters
    ----------
    run : path
        The run's folder. Of a merged run, what it holds of other machines is not sent.
    output : path
        The file to write, with the suffix .zip.
    maps : bool
        Send the maps too, and the surfaces whose licence is known, so that all figures can be
        computed again.
    licence : str
        Licence of what you send, as SPDX names it.
    surfaces_licence : str, optional
        Licence of your own surfaces; without it they are not sent.
    author : str, optional
        Your name.
    key : path, optional
        Your SSH key, to sign with.
    overwrite : bool
        Replace an existing file.

    Returns
    -------
    Submission
        What was found in the file.

    Raises
    ------
    RecordError
        The folder holds no run, or a collection would refuse it.
    ParameterError
        The file exists, or the key cannot sign.

    Examples
    --------
    >>> import cembench
    >>> sent = cembench.submit("results/run", "mine.zip", maps=True)  # doctest: +SKIP
    >>> sent.accepted, sent.cells  # doctest: +SKIP
    (True, 24)

    """
    from cembench.core.atomic import write_bytes
    from cembench.core.overwriting import refuse_present
    from cembench.results.bundle import contents, pack
    from cembench.results.run_folder import SIGNATURE
    from cembench.results.signing import signature_of
    from cembench.results.store import Store

    path, store = Path(output), Store(Path(run))
    if path.suffix != SUFFIX:
        raise ParameterError(f"{path} is no name of a bundle; write {path.stem}{SUFFIX}.")
    refuse_present([path], force=overwrite)
    if not store.records():
        raise RecordError(f"{run} holds no record: no cell is finished yet. Run it to its end.")
    licences = _licences(store, surfaces_licence or "")
    files = contents(store, maps=maps, surfaces=licences)
    if key is not None:
        files[SIGNATURE] = signature_of(files, Path(key).expanduser())
    about = {"name": path.stem, "licence": licence, "author": author or ""}
    with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
        draft = Path(folder) / path.name
        pack(files, store, draft, about, licences)
        with unpacked([draft]) as (bundle,):
            found = _judged(bundle)
        if found.faults:
            raise RecordError(
                f"{run} was not packed, as a collection would refuse it:\n"
                + "\n".join(f"  {fault}" for fault in found.faults[:10])
                + "\nMeasure these cells again, with `cembench run`."
            )
        write_bytes(path, draft.read_bytes())
    return found


def _licences(run: Store, own: str) -> dict[str, str]:
    """Return the licence of each surface by its hash; "" if none is stated.

    Generated surfaces are part of cembench; public ones have that of their publisher.
    """
    from cembench.core.names import slug
    from cembench.registry import load_registry

    registry = load_registry()
    public = {d.mesh_hash: "" if d.fetch_only else d.licence for d in registry.datasets.values()}
    made = {slug(name) for name in registry.surfaces}
    cells = {record.cell.mesh_hash: record.cell.mesh for record in run.records()}
    return {
        key: public[key] if key in public else "MIT" if slug(name) in made else own
        for key, name in cells.items()
    }


@contextmanager
def unpacked(paths: Sequence[Path]) -> Iterator[list[Bundle]]:
    """Unpack and check bundles in a temporary folder; one that cannot be has that as its fault."""
    from cembench.core.names import distinct_slugs
    from cembench.results.bundle import Bundle, far_from_others, unpack
    from cembench.results.store import Store

    found: list[Bundle] = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="cembench-")))
        names = distinct_slugs({str(path): path.stem for path in paths})
        for path in paths:
            place = folder / names[str(path)]
            place.mkdir()
            try:
                found.append(replace(unpack(path, place), name=names[str(path)]))
            except RecordError as error:
                told = (str(error),)
                found.append(Bundle(names[str(path)], Store(place), (), {}, told))
        far = far_from_others(found)
        yield [replace(b, faults=(*b.faults, *far.get(b.name, ()))) for b in found]


def _judged(bundle: Bundle, signers: Path | None = None) -> Submission:
    from cembench.results.signing import signer

    faults, name = bundle.faults, ""
    if signers is not None and not faults:
        try:
            name = signer(bundle.store.folder, signers)
        except RecordError as error:
            faults = (str(error),)
    maps = sum(
        bundle.store.map_file(r.cell).is_file() and bundle.store.mesh_file(r.cell).is_file()
        for r in bundle.records
    )
    return Submission(bundle.name, faults, len(bundle.records), bundle.machines, maps, name)


def check_submissions(
    folder: AnyPath, *, require_signed: AnyPath | None = None
) -> list[Submission]:
    """Check all bundles in a folder.

    Of each the names and sizes of its files, their hashes, the schema and digest of each record,
    and its times: against the reference kernel of its machine, and against other machines. Where
    maps are sent, their figures are computed again.

    Parameters
    ----------
    folder : path
        A folder of bundles, or one bundle.
    require_signed : path, optional
        A file of allowed signers (``man ssh-keygen``); bundles not signed by one of them are
        refused.

    Returns
    -------
    list of Submission
        One a bundle, by name.

    Raises
    ------
    RecordError
        The folder holds no bundle.

    Examples
    --------
    >>> import cembench
    >>> for one in cembench.check_submissions("submissions"):  # doctest: +SKIP
    ...     print(one.name, one.accepted, *one.faults)

    """
    signers = None if require_signed is None else Path(require_signed)
    with unpacked(bundles_in(Path(folder))) as bundles:
        return [_judged(bundle, signers) for bundle in bundles]


def bundles_in(place: Path) -> list[Path]:
    """Return the bundles in a folder, or the one that a file is; raise where there is none."""
    from cembench.core.loading import files_in

    found = [place] if place.is_file() else files_in(place, f"*{SUFFIX}")
    if not found:
        raise RecordError(
            f"{place} holds no bundle, which are files *{SUFFIX}. Make one with `cembench submit`."
        )
    return found


def is_bundle(place: Path) -> bool:
    """Whether a path is a bundle, or a folder of bundles that is no run."""
    if place.is_dir() and not (place / "records").exists():
        return any(path.suffix == SUFFIX for path in place.iterdir())
    return place.is_file()


@contextmanager
def accepted(paths: Sequence[Path]) -> Iterator[list[Path]]:
    """Unpack bundles into temporary folders; raise :class:`RecordError` if one is refused."""
    with unpacked(paths) as bundles:
        refused = [f"  {one.name}: {one.faults[0]}" for one in bundles if one.faults]
        if refused:
            raise RecordError(
                "some bundles are refused:\n"
                + "\n".join(refused)
                + "\nLeave them out; `cembench submissions check` lists all that is wrong."
            )
        yield [one.store.folder for one in bundles]
