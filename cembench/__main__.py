"""Run the command line: ``python -m cembench``."""

from cembench.commands.cli import main

if __name__ == "__main__":
    main()
