"""Typical seconds and memory of the built-in algorithms, for estimates without records.

The seconds are those of a call on 10,000 triangles and their growth, under both linear-algebra
policies. The figures of the paper's algorithms are fits through runs over its models; the others
are CPU seconds measured in one sitting, on surfaces of 5,600 to 34,000 triangles. Other machines
differ by a factor: a record of the same algorithm has priority over this table.
"""

from __future__ import annotations

#: Number of triangles to which the seconds refer.
FACES = 10_000

#: Bytes per triangle of an algorithm that is not known.
ROUGH_BYTES_A_FACE = 2500.0

#: By algorithm name: seconds and exponent with reused factorisations, and without; peak bytes per
#: triangle of a call on 60,000 to 280,000 triangles, above those of an empty process, with reused
#: factorisations. Factors grow slightly faster than surfaces.
USUAL: dict[str, tuple[tuple[float, float], tuple[float, float], float]] = {
    "abf++": ((0.15, 1.06), (0.19, 1.14), 3900),
    "abf-linear": ((0.11, 1.25), (0.12, 1.11), 3400),
    "angenent-haker": ((0.023, 1.0), (0.033, 1.0), 870),
    "bff": ((0.046, 1.0), (0.095, 1.4), 880),
    "bff-free": ((0.033, 1.0), (0.067, 1.4), 880),
    "cem": ((0.029, 0.93), (0.10, 0.84), 860),
    "cetm": ((0.088, 1.3), (0.11, 1.4), 1050),
    "cetm-flips": ((0.13, 1.22), (0.32, 1.18), 1760),
    "cetm-free": ((0.060, 1.32), (0.090, 1.17), 1050),
    "circle-packing": ((0.52, 1.29), (0.52, 1.29), 950),
    "direct-cem": ((0.05, 0.95), (0.12, 1.2), 920),
    "direct-cem-holes": ((0.25, 1.0), (1.0, 1.0), 890),
    "fdm": ((0.19, 1.08), (0.22, 1.08), 1900),
    "gu-yau": ((0.46, 1.4), (0.48, 1.4), 1630),
    "harmonic-circle": ((0.0135, 0.98), (0.0145, 1.03), 620),
    "harmonic-filled": ((0.069, 1.0), (0.080, 1.0), 620),
    "harmonic-tutte": ((0.014, 1.0), (0.014, 1.0), 620),
    "koebe-cem": ((0.36, 1.06), (1.4, 1.2), 940),
    "ldm": ((0.071, 1.08), (0.073, 1.13), 1600),
    "lscm": ((0.023, 1.06), (0.024, 1.14), 1620),
    "mean-value": ((0.026, 1.1), (0.026, 1.1), 940),
    "qiem": ((0.27, 1.19), (0.47, 1.27), 1600),
    "scp": ((0.05, 0.95), (0.12, 1.2), 900),
}
