"""OFF, whose texture coordinates other programs do not read."""

from __future__ import annotations

from cembench.mesh.writers.textured import Textured


def off_bytes(surface: Textured) -> bytes:
    """Return an OFF file; numbers are the shortest decimals that read back unchanged."""
    lines = ["OFF", f"{len(surface.V)} {len(surface.F)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in surface.V.tolist()]
    lines += [f"3 {i} {j} {k}" for i, j, k in surface.F.tolist()]
    return ("\n".join(lines) + "\n").encode()
