"""``python -m cembench``: the command line, which a Ctrl-C while it is loaded ends with a line."""

from __future__ import annotations

import sys


def main() -> None:
    """Load and run the command line."""
    try:
        from cembench.commands.app import load, run

        load(*sys.argv[1:2])
        run()
    except KeyboardInterrupt:
        sys.stderr.write("Stopped.\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
