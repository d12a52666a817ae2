"""What the kept history measures at each commit; see docs/tracking.md.

One thread, set before any numerical library loads, as in every measurement of this project.
"""

import os

for _variable in ("OMP", "OPENBLAS", "MKL", "IGL"):
    os.environ[f"{_variable}_NUM_THREADS"] = "1"
