"""NumPy archives, in full precision."""

from __future__ import annotations

import io

import numpy as np

from cembench.mesh.writers.textured import Textured


def npz_bytes(surface: Textured) -> bytes:
    """Return an archive of `V` (n, 3), `F` (m, 3), `uv` (k, 2) and, with seams, `F_uv` (m, 3)."""
    arrays = {"V": surface.V, "F": surface.F}
    if surface.uv is not None:
        arrays["uv"] = surface.uv
    if surface.has_seams and surface.corners is not None:
        arrays["F_uv"] = surface.corners
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()
