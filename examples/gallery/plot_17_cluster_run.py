"""
Run on a cluster of two local workers
=====================================

A run over many surfaces can be spread over the machines of a cluster. Here the cluster is two
workers on this machine; with ``"tcp://HOST:8786"`` the same program uses other machines. It needs
``pip install 'cembench[cluster]'``.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import cembench

# %%
# Each surface travels to one worker, with all its algorithms and rounds, so that ratios are formed
# on one machine. Workers are processes that import this file again: hence the condition.

if __name__ == "__main__":
    scratch = tempfile.TemporaryDirectory()
    names = ("hemi-ellipsoid", "cone", "spherical-cap")
    run = cembench.benchmark(
        [cembench.surface(name, 600) for name in names],
        ["cem", "lscm"],
        rounds=1,
        output=Path(scratch.name) / "run",
        cluster="local:2",
    )
    table = run.table()
    shown = ["surface", "algorithm", "status", "angle°"]
    print(table[shown].to_string(index=False))

# %%
# The records are on this machine, like those of any other run.

if __name__ == "__main__":
    print(len(run.records()), "records in", run.folder.name)
    errors = table.pivot(index="surface", columns="algorithm", values=shown[-1])
    errors.plot.bar(rot=0, ylabel="mean angle error in degrees", figsize=(6, 3.2))
    plt.show()
