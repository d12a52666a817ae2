"""The verbs of this room: send a run to a collection, check what others sent, publish, sign.

An entry point of the group ``cembench.verbs`` names each.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cembench.api.settings import AnyPath
from cembench.core.arguments import checked
from cembench.core.errors import ParameterError, RecordError
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.results.store import Store

    from .site import PublishedRun

__all__ = ["Submission", "check_submissions", "publish", "sign", "submit"]


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
    unlicensed : tuple of str
        Surfaces that were left out when it was packed, with no licence stated: nobody can compute
        the figures of their maps again.

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
    unlicensed: tuple[str, ...] = ()

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
    from cembench.core.overwriting import refuse_present
    from cembench.results.store import Store

    from .bundle import SUFFIX, pack

    path, store = Path(output), Store(Path(run))
    if path.suffix != SUFFIX:
        raise ParameterError(f"{path} is no name of a bundle; write {path.stem}{SUFFIX}.")
    refuse_present([path], force=overwrite)
    if not store.records():
        raise RecordError(f"{run} holds no record: no cell is finished yet. Run it to its end.")
    return pack(
        store,
        path,
        maps=maps,
        licence=licence,
        author=author or "",
        surfaces=_licences(store, surfaces_licence or ""),
        key=None if key is None else Path(key).expanduser(),
    )


def _licences(run: Store, own: str) -> dict[str, str]:
    """Return the licence of each surface by its hash; "" if none is stated.

    Generated surfaces are part of cembench; public ones have that of their publisher. A file that
    is named as a generated surface is not one: its family is not that.
    """
    from cembench.core.names import slug
    from cembench.registry import load_registry

    registry = load_registry()
    public = {d.mesh_hash: "" if d.fetch_only else d.licence for d in registry.datasets.values()}
    made = {slug(name) for name in registry.surfaces}
    cells = {record.cell.mesh_hash: record for record in run.records()}
    generated = {
        key
        for key, record in cells.items()
        if slug(record.cell.mesh) in made and record.mesh.family in registry.surfaces
    }
    return {key: public.get(key, "MIT" if key in generated else own) for key in cells}


def check_submissions(
    folder: AnyPath, *, require_signed: AnyPath | None = None
) -> list[Submission]:
    """Check bundles that others sent.

    Each is unpacked safely. Checked are the names and sizes of its files, their hashes, the schema
    and digest of each record, and its times: against the reference kernel of its machine, and
    against other machines. Where maps were sent, their figures are computed again.

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
    from .bundle import bundles_in, unpacked

    signers = None if require_signed is None else Path(require_signed)
    with unpacked(bundles_in(Path(folder)), signers) as bundles:
        return list(bundles.values())


@checked
def publish(
    runs: AnyPath | Sequence[AnyPath],
    output: AnyPath,
    *,
    require_signed: AnyPath | None = None,
    reporter: Reporter = SILENT,
) -> list[PublishedRun]:
    """Write a static site of several runs: leaderboard, machines, ratios, reports.

    It needs no network and no server: open index.html, or put the folder on a web server. Bundles
    (see :func:`submit`) are checked first, and none is published that is refused.

    Parameters
    ----------
    runs : path or sequence of paths
        Runs' folders, bundles, and folders of bundles.
    output : path
        Where the site goes: a new or empty folder, or an earlier site.
    require_signed : path, optional
        Refuse runs not signed by somebody in this file (ssh-keygen: ALLOWED SIGNERS).
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    list of PublishedRun
        What the index says of each run, in order of their dates.

    Raises
    ------
    ParameterError
        No run is named, or one twice, or `output` is one of them.
    RecordError
        A folder holds no run, a bundle is refused, or `output` holds other files.

    Examples
    --------
    >>> import cembench
    >>> cembench.publish(["results/may", "submissions"], "site")  # doctest: +SKIP
    """
    from cembench.core.overwriting import refuse_inputs
    from cembench.results.signing import signers_of
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records

    from .bundle import accepted, bundles_in, is_bundle
    from .site import write_site

    named = [runs] if isinstance(runs, str | os.PathLike) else runs
    paths = [Path(run) for run in named]
    signers = None if require_signed is None else Path(require_signed)
    refuse_inputs(Path(output), paths, force=False)
    sent = [bundle for path in paths if is_bundle(path) for bundle in bundles_in(path)]
    own = [path for path in paths if not is_bundle(path)]
    for run in own:
        sound_records(Store(run), Depth.sample)
    with accepted(sent, signers) as unpacked, reporter.counting() as count:
        known = signers_of(own, signers, reporter)
        known |= {folder: one.signer for folder, one in unpacked.items() if one.signer}
        return write_site([*own, *unpacked], Path(output), count, known)


@checked
def sign(run: AnyPath, key: AnyPath) -> Path:
    """Sign a run with your SSH key, so that others know who measured it.

    The signature is in RUN/signature, over all its files; sign again after the run has changed.
    `merge` and `publish` check it, if signatures are required.

    Parameters
    ----------
    run : path
        The run's folder.
    key : path
        Your private SSH key, or a public one whose private key an agent holds.

    Returns
    -------
    Path
        The file of the signature.

    Raises
    ------
    RecordError
        The folder holds no run, or a file in it cannot be read.
    ParameterError
        OpenSSH is not installed, or refuses the key.

    Examples
    --------
    >>> import cembench
    >>> cembench.sign("results/run", "~/.ssh/id_ed25519")  # doctest: +SKIP
    """
    from cembench.results import signing

    return signing.sign(Path(run), Path(key).expanduser())


def add_command() -> None:
    """Add the commands of these verbs."""
    from . import commands  # noqa: F401 - they register themselves
