"""Send a run to a collection of results, and check what others sent."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cembench.api.settings import AnyPath
from cembench.core.arguments import checked
from cembench.core.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from cembench.results.bundle import Submission
    from cembench.results.store import Store


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
    from cembench.results.bundle import SUFFIX, pack
    from cembench.results.store import Store

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
    from cembench.results.bundle import bundles_in, unpacked

    signers = None if require_signed is None else Path(require_signed)
    with unpacked(bundles_in(Path(folder)), signers) as bundles:
        return list(bundles.values())
