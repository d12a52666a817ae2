"""The command line. Exit code 0 if every cell ended ok, 1 if one did not, 2 on wrong usage.

Other codes (a closed pipe, a signal, a fault of cembench itself) are in
:mod:`cembench.commands.exit_codes`.
"""

from __future__ import annotations

from importlib import import_module

from cembench.commands.app import app
from cembench.commands.exit_codes import ending

#: The modules that add commands to the application, in the order of the help.
MODULES = (
    *("catalogue", "map", "benchmark", "reproduce", "report", "run", "submit"),
    *("validate", "peers", "holes", "theory", "morph", "fetch", "repair", "cut"),
)
for _name in MODULES:
    import_module(f"cembench.commands.{_name}")


def main() -> None:
    """Run the command line; :mod:`cembench.commands.exit_codes` chooses the exit code."""
    with ending():
        app()


if __name__ == "__main__":
    main()
