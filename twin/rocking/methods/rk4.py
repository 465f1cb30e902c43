"""The classical Runge-Kutta method of order 4 with exact contact location: the step is repeated, its length unknown.

Source: W. Kutta, Z. Math. Phys. 46, 1901; the impact costs no order because the step that ends there is of the method
itself (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, II.6).
"""

from __future__ import annotations

from dataclasses import dataclass

from twin.rocking.methods.fixed import solve_fixed
from twin.rocking.methods.problem import MODELS, Problem, Solution
from twin.rocking.methods.schemes import RK4


@dataclass(frozen=True, slots=True)
class RungeKutta4:
    """See the module; `step` s, 1 ms unless told."""

    name: str = "rk4"
    models: tuple[str, ...] = MODELS
    source: str = "Kutta 1901"

    def solve(self, problem: Problem) -> Solution:
        """Return the answer; refuses steps too long for the block."""
        return solve_fixed(problem, self.name, RK4, 4.0)
