"""The thesis' scheme: Newmark's average acceleration, Newton-Raphson, the step at a contact with its length unknown.

Source: N. M. Newmark, J. Eng. Mech. Div. ASCE 85(3), 1959 (gamma = 1/2, beta = 1/4); N. Ceh, doctoral thesis, Rijeka
2018, chapter 3. Order 2. Two things differ from the thesis. A step in which two contacts could hide is halved until it
holds one or none. Newton-Raphson goes on until its corrections are rounding, and a step for which rounding alone leaves
more than the thesis' residual of 1e-8 (here in units of p2) is refused, as is one where the tangent vanishes (2/p).
"""

from __future__ import annotations

from dataclasses import dataclass

from twin.rocking.methods.fixed import solve_fixed
from twin.rocking.methods.problem import LINEARISED, NONLINEAR, MethodRefused, Problem, Solution
from twin.rocking.methods.schemes import NEWMARK

RESIDUAL = 1e-8
ROUNDING = 2.2e-16


@dataclass(frozen=True, slots=True)
class Newmark:
    """See the module; `step` s, 1 ms unless told."""

    name: str = "newmark"
    models: tuple[str, ...] = (NONLINEAR, LINEARISED)
    source: str = "Newmark 1959; Ceh 2018, chapter 3"

    def solve(self, problem: Problem) -> Solution:
        """Return the answer; refuses steps its equation cannot be solved for."""
        if problem.step is not None:
            _refuse(problem, problem.step)
        return solve_fixed(problem, self.name, NEWMARK, 2.0)


def _refuse(problem: Problem, step: float) -> None:
    p = problem.block.frequency_parameter
    if step >= 2.0 / p:
        raise MethodRefused(
            f"newmark is asked for a step of {step:g} s; the tangent of its equation vanishes at 2/p = {2.0 / p:.6g} s"
        )
    least = 4.0 * ROUNDING * problem.block.slenderness / (p * step) ** 2
    if least > RESIDUAL:
        raise MethodRefused(
            f"newmark is asked for a step of {step:g} s; rounding alone leaves a residual of {least:.2g} there, "
            f"above its {RESIDUAL:g}"
        )
