"""Decide whether the vertices next to the boundary are eliminated just before it.

CEM's energy and its boundary steps (23), (30) need a harmonic map only at these vertices N, the
*ring*. With the order "other interior, N, boundary B" the factor ends in a dense triangle of order
|N| + |B|, and an iteration needs nothing else; the other interior is solved for once, at the end.
The price is that triangle, which is dense instead of sparse in N's rows.
"""

from __future__ import annotations

import math

#: Entries of a factor over n log2(n), on average; real disks have 45 / 14 to 95 / 14.
ENTRIES = 4.5
#: Operations of a dense factorisation in the time in which a substitution of two columns passes one
#: entry of a sparse factor, which waits for memory.
OPERATIONS_AN_ENTRY = 60
#: What share of a factor leads from the ring and the boundary to its end, on real disks: an
#: iteration in the usual order passes no more (:mod:`cembench.linear_algebra.factor_part`).
LEADING_SHARE = 0.35
#: How many iterations are expected where more are allowed: from 1 on large surfaces to all 20.
LIKELY_ITERATIONS = 4


def ring_pays(interior: int, ring: int, boundary: int, iterations: int) -> bool:
    """Return whether the ring's order is the cheaper one, by an estimate of the operations.

    The dense triangle costs ((N + B)^3 - B^3) / 3 operations more. Each iteration then passes
    N^2 / 2 + N B numbers instead of a third of the factor's, which has about 4.5 n log2(n) for n
    interior vertices, and :data:`OPERATIONS_AN_ENTRY` operations are worth one number.

    Parameters
    ----------
    interior, ring, boundary : int
        Numbers of vertices; the ring's are among the interior's.
    iterations : int
        Maximum number of iterations, capped at :data:`LIKELY_ITERATIONS`.

    Examples
    --------
    >>> ring_pays(17_089, 270, 245, iterations=20)
    True
    >>> ring_pays(137_142, 1_482, 1_488, iterations=20)
    False
    """
    if ring == interior:
        return False
    denser = ((ring + boundary) ** 3 - boundary**3) / 3
    passed = LEADING_SHARE * ENTRIES * interior * math.log2(interior)
    spared = passed - ring * (ring / 2 + boundary)
    likely = min(iterations, LIKELY_ITERATIONS)
    return likely * spared * OPERATIONS_AN_ENTRY > denser
