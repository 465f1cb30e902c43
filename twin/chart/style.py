"""Colours and markers of the chart: told apart without colour, and by every kind of colour sight (Okabe & Ito 2008)."""

from __future__ import annotations

from typing import Any

SMALL, LARGE = 10.5, 12.0

_OWN = {
    "taylor": ("#D55E00", "o"),
    "closed-form": ("#009E73", "s"),
    "dop853": ("#0072B2", "^"),
    "rk4": ("#E69F00", "D"),
    "newmark": ("#CC79A7", "v"),
    "model linearised": ("#56B4E9", "X"),
    "model quasi-linear": ("#56B4E9", "P"),
    "model auto": ("#009E73", "*"),
}
_PEERS = {"heyoka": ("black", "o"), "SciPy events": ("0.4", "s"), "CVODE": ("0.55", "^")}
_OTHER = ("#D55E00", "h")


def style(solver: str) -> dict[str, Any]:
    """Return what `plot` needs for a solver: ours filled with full lines, peers hollow with broken ones."""
    if solver in _PEERS:
        colour, marker = _PEERS[solver]
        return {
            "color": colour,
            "marker": marker,
            "markersize": 8.5,
            "markerfacecolor": "white",
            "lw": 1.3,
            "ls": "--",
            "markeredgewidth": 1.6,
        }
    colour, marker = _OWN.get(solver, _OTHER)
    big = {"*": 13.0, "s": 12.0}.get(marker, 8.5)
    return {
        "color": colour,
        "marker": marker,
        "markersize": big,
        "markeredgecolor": "white",
        "markeredgewidth": 0.6,
        "lw": 1.6,
        "zorder": 4 if solver == "taylor" else 3,
    }
