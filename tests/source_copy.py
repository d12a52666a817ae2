"""The project's files in a folder of their own, without what a checkout gathers."""

import shutil
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: What lies at the top and is not needed to build or to test.
AT_THE_TOP = {"reports", "results", "build", "dist"}
#: What is made, anywhere.
MADE = {"__pycache__", "_build"}


def copy_source(folder):
    """Copy the project to a folder that is not there yet."""

    def left_out(where, names):
        at_the_top = AT_THE_TOP if Path(where) == ROOT else set()
        return {
            name
            for name in names
            if name.startswith(".") or name in MADE or name.endswith(".egg-info")
        } | at_the_top & set(names)

    shutil.copytree(ROOT, folder, ignore=left_out)
    return folder
