"""Sign a run with its measurer's SSH key, and check who signed one.

A digest shows that a file was not damaged; a signature shows who vouches for all files of a run.
It is OpenSSH's (``ssh-keygen -Y``, namespace "cembench"), detached, in ``RUN/signature``, over the
names and SHA-256 of the files, those of a bundle with its metadata: author and licence. It does not
prove that the measurements are true.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from cembench.core.atomic import is_draft, write_bytes
from cembench.core.errors import ParameterError, RecordError
from cembench.core.loading import check_no_link, is_there, open_file, read_bytes
from cembench.core.reporter import SILENT, Reporter
from cembench.results.run_folder import METADATA, PLAN, SIGNATURE
from cembench.results.store import Store

_NAMESPACE = "cembench"
#: What is signed: all that a run keeps but the journals of unfinished cells.
_SIGNED = ("records", "maps", "meshes", "environments", "exhibits", "others")


def sign(run: Path, key: Path) -> Path:
    """Sign a run with a key, or one that an agent holds; return the file of the signature."""
    write_bytes(run / SIGNATURE, _signature(_contents(run), key))
    return run / SIGNATURE


def signature_of(files: Mapping[str, bytes], key: Path) -> bytes:
    """Return the signature of a run that consists of these files; raises as :func:`sign`."""
    hashes = [(name, hashlib.sha256(content).hexdigest()) for name, content in files.items()]
    return _signature(_message(hashes), key)


def _signature(message: bytes, key: Path) -> bytes:
    signed = _ssh_keygen(["sign", "-f", str(key)], message)
    if signed is None:
        raise ParameterError(
            f"ssh-keygen does not sign with {key}. Name a private key, as ~/.ssh/id_ed25519, or "
            "the public key of one that your agent holds."
        )
    return signed


def _message(hashes: Iterable[tuple[str, str]]) -> bytes:
    return json.dumps(sorted(hashes)).encode()


def signer(run: Path, allowed: Path, bundle: str = "") -> str:
    """Return who signed a run: a principal of a file of allowed signers.

    Parameters
    ----------
    run : Path
        The run's folder.
    allowed : Path
        Who may sign, as ``man ssh-keygen`` describes under ALLOWED SIGNERS: a line has a name and
        a public key.
    bundle : str
        The name of the bundle that the folder was unpacked from, if any.

    Raises
    ------
    RecordError
        The run is not signed, or by none of them, or was changed since.
    ParameterError
        OpenSSH is not installed, or there is no such file.
    """
    if not allowed.is_file():
        raise ParameterError(f"{allowed}, the file of allowed signers, does not exist.")
    contents, path = _contents(run), run / SIGNATURE
    named = bundle or str(run)
    command = f"cembench submit RUN -o {bundle} --key KEY" if bundle else f"cembench sign {run}"
    if not is_there(path):
        raise RecordError(f"{named} is not signed; its measurer can run `{command}`.")
    read_bytes(path, run)  # a regular file, and no link
    arguments = ["-f", str(allowed), "-s", str(path)]
    names = _ssh_keygen(["find-principals", *arguments], b"")
    if names is None:
        raise RecordError(
            f"{named} is signed by nobody whom {allowed} names. Add its measurer there, or leave "
            "it out."
        )
    name = names.decode(errors="replace").splitlines()[0]
    if _ssh_keygen(["verify", *arguments, "-I", name], contents) is None:
        raise RecordError(
            f"{named} was changed after {name} signed it, or the signature is of something else. "
            "Get it anew, or have it signed again."
        )
    return name


def signers_of(
    runs: Iterable[Path], allowed: Path | None, reporter: Reporter = SILENT
) -> dict[Path, str]:
    """Return who signed each run, as :func:`signer`; without `allowed`, nothing is known."""
    names = {} if allowed is None else {run: signer(run, allowed) for run in runs}
    for run, name in names.items():
        reporter.info(f"{run}: signed by {name}")
    return names


def _contents(run: Path) -> bytes:
    """Return what is signed: the names and hashes of a run's files."""
    Store(run).check_is_run()
    lines = []
    for path in _files(run):
        with os.fdopen(open_file(path, run), "rb") as file:
            hashed = hashlib.file_digest(file, "sha256").hexdigest()
        lines.append((path.relative_to(run).as_posix(), hashed))
    return _message(lines)


def _files(run: Path) -> Iterator[Path]:
    """Yield the files of a run that are signed; a link among them is refused."""
    below = [path for name in _SIGNED for path in (run / name).rglob("*")]
    places = [run / PLAN, run / METADATA, *below]
    for path in places:
        check_no_link(path, run)
        if is_there(path) and not path.is_dir() and not is_draft(path):
            yield path


def _ssh_keygen(words: Sequence[str], message: bytes) -> bytes | None:
    """Return what ssh-keygen prints, given a message; None if it refuses."""
    command = ["ssh-keygen", "-Y", *words]
    if words[0] != "find-principals":
        command += ["-n", _NAMESPACE]
    try:
        ended = subprocess.run(command, input=message, capture_output=True, check=False)
    except FileNotFoundError as error:
        raise ParameterError(
            "ssh-keygen is not installed; signatures are OpenSSH's. Install its client."
        ) from error
    return ended.stdout if ended.returncode == 0 else None
