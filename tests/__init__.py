"""Tests, and the fuzz campaign.

Before numpy loads: one thread, as in every process that measures. Threads of libraries wait for
each other actively, which takes most of the time where several processes share the cores; and a
pool of threads does not survive a fork.
"""

import os

for _variable in ("OMP", "OPENBLAS", "MKL", "IGL"):
    os.environ[f"{_variable}_NUM_THREADS"] = "1"
