"""Load the user's plug-ins, each in a separate process first.

Importing a plug-in runs its code, which may end the process, crash, or never return. So another
process imports it first. If that process ends early, or does not end, an error names the plug-in.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cembench.core.errors import RegistryError, describe_error
from cembench.registry import COMMAND, Registry, declared_by, load_registry
from cembench.running.environment import importing
from cembench.running.process import Limits, ProcessEnd, die_with_parent, run_limited, spawning

#: Time limit for importing a plug-in, in wall-clock seconds.
IMPORT_SECONDS = 60.0
#: Written by the process on success; anything else it writes is an error message.
_LOADED = b"loaded"


def load_with_plugins(plugins: Sequence[str], seconds: float = IMPORT_SECONDS) -> Registry:
    """Load the registry with these plug-ins, after loading each in a separate process.

    Raises
    ------
    RegistryError
        As :func:`~cembench.registry.load_registry`; also if importing a plug-in ends the process,
        or takes longer than `seconds`.
    """
    for plugin in plugins:
        if not plugin.startswith(COMMAND):  # data only, which imports nothing
            _try(plugin, seconds)
    with importing():
        return load_registry(plugins)


def _try(plugin: str, seconds: float) -> None:
    """Load a plug-in in a separate process."""
    with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
        answer = Path(folder) / "answer"
        command = [sys.executable, "-P", "-m", "cembench.running.plugins", plugin, str(answer)]
        start = spawning([*command, str(os.getpid())], os.environ)
        ending = run_limited(start, Limits(seconds), Path(folder) / "log")
        said = answer.read_bytes() if answer.is_file() else None
    if said is None or ending.limit:
        raise RegistryError(
            f"plug-in {plugin!r} cannot be imported: {_ending(ending, seconds)}. Repair it: "
            "importing a plug-in must only declare functions."
        )
    if said != _LOADED:
        raise RegistryError(said.decode(errors="replace"))


def _ending(ending: ProcessEnd, seconds: float) -> str:
    if ending.limit:
        return f"the import took more than {seconds:g} s"
    return f"the importing process {ending.how}".removesuffix(".")


def _main(plugin: str, answer: Path, parent: int) -> None:
    die_with_parent(parent)
    try:
        declared_by(plugin)
        content = _LOADED
    except RegistryError as error:
        content = str(error).encode(errors="replace")
    except BaseException as error:  # only the plug-in can interrupt this process
        content = f"plug-in {plugin!r} cannot be imported: {describe_error(error)}.".encode(
            errors="replace"
        )
    answer.write_bytes(content)
    os._exit(0)


if __name__ == "__main__":
    _main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))
