"""SciPy's DOP853, order 8, with events done safely: the reference.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, II.10, as in
`scipy.integrate`. SciPy's own event rule looks at the signs at both ends of a step and loses a contact it starts on.
Here every step's interpolant is searched window by window: |phi''| is bounded on it, so a window whose chord stays
above the base by more than M h^2 / 8 holds no contact; a leg that starts on the base at v is not looked at before
v / M.
"""

from __future__ import annotations

from dataclasses import dataclass

from twin.rocking.march import FELL, REACHED
from twin.rocking.methods.comparison import Track, begin, solution
from twin.rocking.methods.equations import centre, model_code, model_parameters
from twin.rocking.methods.fixed import refuse_endless
from twin.rocking.methods.legs import Legs, advance
from twin.rocking.methods.problem import MODELS, Problem, Solution
from twin.rocking.run import STILL_BASE
from twin.rocking.state import ALPHA, SIDE

# Tolerance per step, relative; a run at the looser one stands beside it for the error.
SHARE, LOOSER = 1e-2, 1e3
LEAST = 3e-14


@dataclass(frozen=True, slots=True)
class Dop853:
    """See the module."""

    name: str = "dop853"
    models: tuple[str, ...] = MODELS
    source: str = "Hairer, Norsett & Wanner 1993, through SciPy"

    def solve(self, problem: Problem) -> Solution:
        """Return the answer at the problem's tolerance; refuses runs of too many steps."""
        refuse_endless(problem)
        relative = max(SHARE * problem.tolerance, LEAST)
        fine = _run(problem, relative)
        coarse = _run(problem, min(relative * LOOSER, 1e-4))
        return solution(problem, fine, coarse, 2.0)


def _run(problem: Problem, relative: float) -> Track:
    model = model_code(problem.model)
    body = model_parameters(problem)
    state = begin(problem, body, centre(model, float(body[ALPHA])))
    legs = Legs(model, body, relative)
    code = REACHED
    for piece in problem.pieces:
        if float(piece[0]) >= problem.end or code != REACHED:
            break
        code = advance(legs, state, piece, min(float(piece[1]), problem.end))
    standing, fallen_before = state.copy(), code == FELL
    if code == REACHED and problem.end > problem.shaking and state[SIDE] != 0.0:
        code = advance(legs, state, STILL_BASE[0], problem.end)
    return Track(model, body, standing, fallen_before, state, code == FELL, legs.recorded_events(), legs)
