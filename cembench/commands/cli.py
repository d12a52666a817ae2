"""The command line. Exit code 0 if every cell ended ok, 1 if one did not, 2 on wrong usage.

Other codes (a closed pipe, a signal, a fault of cembench itself) are in
:mod:`cembench.commands.exit_codes`.
"""

from __future__ import annotations

from cembench.commands.app import app, load
from cembench.commands.app import run as main

__all__ = ["app", "main"]

load()

if __name__ == "__main__":
    main()
