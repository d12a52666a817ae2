"""A program on its own, in Python: Tutte's embedding of a disk. It knows nothing of cembench.

python tutte.py INPUT.obj OUTPUT.txt
"""

import sys
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu


def read(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices (n, 3) and triangles (m, 3), counted from 0, of a plain OBJ file."""
    lines = [line.split() for line in Path(path).read_text(encoding="utf-8").splitlines()]
    V = [[float(x) for x in words[1:4]] for words in lines if words[:1] == ["v"]]
    F = [[int(x.split("/")[0]) - 1 for x in words[1:4]] for words in lines if words[:1] == ["f"]]
    return np.array(V), np.array(F)


def boundary_loop(F: np.ndarray) -> list[int]:
    """Follow the edges that belong to one triangle only, in its direction."""
    edges = {(int(a), int(b)) for f in F for a, b in zip(f, np.roll(f, -1), strict=True)}
    after = {a: b for a, b in edges if (b, a) not in edges}
    loop = [next(iter(after))]
    while after[loop[-1]] != loop[0]:
        loop.append(after[loop[-1]])
    return loop


V, F = read(sys.argv[1])
n, loop = len(V), boundary_loop(F)
i, j = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]).T
A = sparse.csr_matrix((np.ones(len(i)), (i, j)), (n, n))
A = ((A + A.T) > 0).astype(float)
L = sparse.diags(np.asarray(A.sum(axis=1)).ravel()) - A

lengths = np.linalg.norm(V[np.roll(loop, -1)] - V[loop], axis=1)
angles = 2 * np.pi * np.concatenate([[0], np.cumsum(lengths)[:-1]]) / lengths.sum()
uv = np.zeros((n, 2))
uv[loop] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
inside = np.setdiff1d(np.arange(n), loop)
uv[inside] = splu(L[inside][:, inside].tocsc()).solve(-L[inside][:, loop] @ uv[loop])
np.savetxt(sys.argv[2], uv, fmt="%.17g")
