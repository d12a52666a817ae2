"""Run Python so that file modes bind it: root otherwise reads and writes whatever they say."""

import ctypes
import os
import sys
import tempfile
from contextlib import ExitStack

import pytest

from cembench.commands.cli import main
from tests.forked import forked

#: The version of the kernel's sets of capabilities, and the two that pass over modes.
_VERSION, _OVERRIDE, _READ_SEARCH = 0x20080522, 1, 2


def _give_up():
    """Give up the capabilities of root that pass over modes."""
    if os.getuid() == 0:
        libc = ctypes.CDLL(None, use_errno=True)
        header, sets = (ctypes.c_uint32 * 2)(_VERSION, 0), (ctypes.c_uint32 * 6)()
        failed = libc.capget(header, sets)
        for number in range(2):  # the effective ones, and those that `access` looks at
            sets[number] &= ~(1 << _OVERRIDE | 1 << _READ_SEARCH)
        if failed or libc.capset(header, sets):
            raise OSError(ctypes.get_errno(), "the capabilities cannot be given up")


def bound_by_modes(folder, function):
    """Exit code, output and messages of a function that a fork calls in a folder."""
    if os.name != "posix" or (os.getuid() == 0 and sys.platform != "linux"):
        pytest.skip("file modes do not bind this user")

    def bound():
        os.chdir(folder)
        _give_up()
        return function()

    with ExitStack() as stack:
        streams = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(3)]
        code = forked(bound, streams)
        for stream in streams:
            stream.seek(0)
        return (code, *(stream.read().decode() for stream in streams[1:]))


def command_bound_by_modes(folder, *words):
    """Exit code, output and messages of a command."""

    def command():
        sys.argv = ["cembench", *words]
        main()

    return bound_by_modes(folder, command)
