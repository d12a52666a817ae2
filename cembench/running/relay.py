"""A solver of another version as an algorithm: its calls are passed to a process of that version.

The process (:mod:`cembench.running.version_server`) starts before the first call, and ends with the
one that measures. Calls are timed by our clock, which includes the passing of surface and map: a
millisecond for a small surface, alike for all versions.
"""

from __future__ import annotations

import json
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from subprocess import PIPE, Popen
from typing import Any

import numpy as np

from cembench.core.errors import AlgorithmFailed, RegistryError
from cembench.core.parameterization import Atlas, Parameterization
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.running.external.call import own_folder

SERVER = Path(__file__).with_name("version_server.py")
#: A plug-in that declares a solver of a version.
PLUGIN = """\
from cembench import DiskMesh, HoledMesh, TriangleMesh, algorithm
from cembench.running.relay import Relay

relay_{number} = Relay({name!r}, **{about!r})


@algorithm({name!r}, title={title!r}, target={target!r})
def solver_{number}(mesh: {takes}):
    return relay_{number}(mesh)
"""
#: The relays that this process has, by the names of their algorithms.
RELAYS: dict[str, Relay] = {}


@dataclass
class Relay:
    """Passes calls to a solver of a version.

    `python` is the version's interpreter. `folder` holds its code, unless that is installed.
    `version` says which code it is.
    """

    name: str
    python: str
    solver: str
    version: str
    folder: str = ""
    plugins: tuple[str, ...] = ()
    _process: Any = field(default=None, init=False)
    _exchange: Path = field(default=Path(), init=False)
    _open: ExitStack = field(default_factory=ExitStack, init=False)

    def __post_init__(self) -> None:
        """Make it known to :func:`start_solver`."""
        RELAYS[self.name] = self

    def start(self) -> dict[str, Any]:
        """Start the process; return what it says of the solver.

        Raises
        ------
        RegistryError
            The interpreter does not start, or the version has no such solver.
        """
        asked = {"name": self.solver, "folder": self.folder, "plugins": self.plugins}
        words = [self.python, "-P", str(SERVER), json.dumps(asked)]
        try:
            self._process = Popen(words, encoding="utf-8", stdin=PIPE, stdout=PIPE)
        except OSError as error:
            raise RegistryError(
                f"{self.version}: {self.python} cannot be started ({error.strerror}). Name the "
                "interpreter of an environment, such as .venv/bin/python."
            ) from None
        self._exchange = self._open.enter_context(own_folder())
        said = self._said()
        if "missing" in said:
            raise RegistryError(
                f"{self.version} has no solver {self.solver!r} that can be used: {said['missing']}"
            )
        return said

    def __call__(self, mesh: TriangleMesh) -> Parameterization | Atlas:
        """Return the version's map of a surface."""
        if self._process is None:
            self.start()
        for name, array in (("V", mesh.V), ("F", mesh.F)):
            np.save(self._exchange / f"{name}.npy", array)
        self._process.stdin.write(f"{self._exchange}\n")
        self._process.stdin.flush()
        said = self._said()
        if "failed" in said:
            failed = AlgorithmFailed if said["gave_up"] else RuntimeError
            words = "" if said["gave_up"] else f"{said['error']}: "
            raise failed(f"{words}{said['failed']}")
        uv = np.load(self._exchange / "uv.npy")
        return Parameterization(uv, said["iterations"]) if uv.ndim == 1 else Atlas(uv)

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.communicate()
            self._process = None
        self._open.close()

    def _said(self) -> dict[str, Any]:
        """Return the next answer of the process."""
        line = self._process.stdout.readline()
        if not line:
            code = self._process.wait()
            raise RegistryError(f"{self.version}: {self.python} ended with code {code}.")
        return dict(json.loads(line))


def declared(number: int, relay: Relay) -> str:
    """Return the plug-in of a relay, after asking its version for the solver.

    Raises
    ------
    RegistryError
        As :meth:`Relay.start`.
    """
    try:
        said = relay.start()
    finally:
        relay.close()
    names = ("python", "solver", "version", "folder", "plugins")
    about = {name: getattr(relay, name) for name in names}
    title = f"{said['title']} ({relay.name.rpartition('@')[2]})"
    facts = {"title": title, "target": said["target"], "takes": said["takes"]}
    return PLUGIN.format(number=number, name=relay.name, about=about, **facts)


def start_solver(name: str) -> None:
    """Start the process of a solver outside of the clock, if it is of another version."""
    if name in RELAYS:
        RELAYS[name].start()


def end_solvers() -> None:
    """End the processes of versions."""
    for relay in RELAYS.values():
        relay.close()
