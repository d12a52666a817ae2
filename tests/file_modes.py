"""Run Python so that file modes bind it: root otherwise reads and writes whatever they say."""

import os
import subprocess
import sys

import pytest

#: The capabilities of root that pass over modes are given up, then the command is started.
_BOUND = """
import ctypes, os, sys
drop, override, read_search = 24, 1, 2
if os.getuid() == 0:
    for capability in (override, read_search):
        if ctypes.CDLL(None, use_errno=True).prctl(drop, capability, 0, 0, 0):
            raise OSError(ctypes.get_errno(), "the capability cannot be given up")
os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
"""


def bound_by_modes(folder, *arguments, **environment):
    """Exit code, output and messages of `python ARGUMENTS` in a folder."""
    if os.name != "posix" or (os.getuid() == 0 and sys.platform != "linux"):
        pytest.skip("file modes do not bind this user")
    done = subprocess.run(
        [sys.executable, "-c", _BOUND, *map(str, arguments)],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr
