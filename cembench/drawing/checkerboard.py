"""A checkerboard whose squares are subdivided where they would be large on the surface.

A square is divided 3 by 3 as a whole or not at all, so that finer squares never appear as fragments
among coarser ones. The parts are divided again if they are still too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Indices, Real

#: Parts along the side of a divided square; odd, so that corners keep their colour.
FINER = 3
#: Maximal depth of the subdivision.
MAX_LEVELS = 10


@dataclass(frozen=True)
class Checkerboard:
    """The subdivision of a checkerboard: a forest whose roots are the squares of side 1.

    Parameters
    ----------
    low : int64 (2,)
        Lower left corner of the lowest square.
    across : int
        Number of squares of side 1 along the board's width; they are stored row by row.
    first_part : int64 (k,)
        For each square the number of its first part, row by row; -1 for an undivided square.
    depth : int
        How often the smallest squares are divided; 0 if none is.
    """

    low: Indices
    across: int
    first_part: Indices
    depth: int = 0

    @classmethod
    def of(cls, places: Real, fineness: Real, weights: Real) -> Checkerboard:
        """Divide squares whose parts would still be large, judged by samples.

        Parameters
        ----------
        places : float64 (k, 2)
            Sample points on the board.
        fineness : float64 (k,)
            Required depth of subdivision at the samples; not rounded.
        weights : float64 (k,)
            Weight of each sample: its share of the surface.
        """
        low = np.floor(places.min(axis=0)).astype(np.int64)
        across, up = np.floor(places.max(axis=0)).astype(np.int64) - low + 1
        board = np.full(int(across * up), -1, dtype=np.int64)
        node = _roots(places, low, int(across))
        active, start, depth = np.arange(len(places)), 0, 0
        for level in range(MAX_LEVELS):
            size = len(board)
            weight = np.bincount(node[active], weights[active], minlength=size)
            total = np.bincount(node[active], (weights * fineness)[active], minlength=size)
            divided = np.flatnonzero((total > level * weight) & (np.arange(size) >= start))
            if not len(divided):
                break
            board[divided] = size + FINER**2 * np.arange(len(divided))
            board = np.concatenate([board, np.full(FINER**2 * len(divided), -1, dtype=np.int64)])
            active = active[board[node[active]] >= 0]
            node[active] = board[node[active]] + _part(places[active], level + 1)
            start, depth = size, level + 1
        return cls(low, int(across), board, depth)

    def at(self, places: Real) -> tuple[NDArray[np.bool_], Indices]:
        """Return whether the board is dark at points (k, 2), and the depth of subdivision there.

        Points off the board take the nearest square's value.
        """
        roots = len(self.first_part)
        node = np.clip(_roots(places, self.low, self.across), 0, roots - 1)
        dark = _is_dark(places, 0)
        level = np.zeros(len(places), dtype=np.int64)
        active = np.flatnonzero(self.first_part[node] >= 0)
        while len(active):
            depth = int(level[active[0]]) + 1
            level[active] = depth
            dark[active] = _is_dark(places[active], depth)
            parts = self.first_part[node[active]] + _part(places[active], depth)
            node[active] = parts
            active = active[self.first_part[parts] >= 0]
        return dark, level


def _roots(places: Real, low: Indices, across: int) -> Indices:
    """Return the square of side 1 that holds each point."""
    column = np.floor(places[:, 0]).astype(np.int64) - low[0]
    row = np.floor(places[:, 1]).astype(np.int64) - low[1]
    return np.asarray(column.clip(0, across - 1) + across * row)


def _part(places: Real, level: int) -> Indices:
    """Return which of its parent's parts holds each point at this level."""
    place = np.floor(places * FINER**level).astype(np.int64) % FINER
    return np.asarray(place[:, 0] + FINER * place[:, 1])


def _is_dark(places: Real, level: int) -> NDArray[np.bool_]:
    """Whether points lie on dark squares of this level."""
    scale = FINER**level
    whole = np.floor(places[:, 0] * scale) + np.floor(places[:, 1] * scale)
    return np.asarray(whole.astype(np.int64) & 1 == 1)
