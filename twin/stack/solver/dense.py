"""Small dense linear systems, solved in place."""

from __future__ import annotations

from twin.rocking.compiled import FloatArray
from twin.stack.solver.compiled import lent


@lent
def factor(a: FloatArray, n: int, order: FloatArray) -> bool:
    """Replace the leading n x n part of `a` by its LU factors with partial pivoting; False where it is singular."""
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(a[i, j]) > abs(a[best, j]):
                best = i
        order[j] = best
        if best != j:
            for k in range(n):
                keep = a[j, k]
                a[j, k] = a[best, k]
                a[best, k] = keep
        pivot = a[j, j]
        if pivot == 0.0:
            return False
        for i in range(j + 1, n):
            ratio = a[i, j] / pivot
            a[i, j] = ratio
            for k in range(j + 1, n):
                a[i, k] -= ratio * a[j, k]
    return True


@lent
def solve(a: FloatArray, n: int, order: FloatArray, b: FloatArray) -> None:
    """Replace b[:n] by the solution of the system factored in `a`."""
    for j in range(n):
        best = int(order[j])
        if best != j:
            keep = b[j]
            b[j] = b[best]
            b[best] = keep
    for i in range(1, n):
        y = b[i]
        for k in range(i):
            y -= a[i, k] * b[k]
        b[i] = y
    for i in range(n - 1, -1, -1):
        y = b[i]
        for k in range(i + 1, n):
            y -= a[i, k] * b[k]
        b[i] = y / a[i, i]
