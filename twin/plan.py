"""Plan a run without a device: what the table can do of it, what the block will do, how far from toppling that is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from excitation import Capacity, Clipped, TableRun
from excitation.released import Settings
from twin.achieved import Achieved
from twin.margin import Margin, find_margin
from twin.rehearsal import NotPossibleError, Rehearsal, initial_rotation, rehearse
from twin.rocking.block import Block
from twin.rocking.response import Outcome, Response
from twin.rocking.validity import Validity
from twin.scene import Scene
from twin.simulation import simulate
from twin.stopping import stop_deceleration
from twin.uncertainty.foresee import Uncertain, foresee
from twin.uncertainty.table import AS_ASKED, TableResponse
from twin.whole_run.check import WholeRun, check_whole_run
from twin.whole_run.mechanics import TableMechanics


@dataclass(frozen=True, slots=True)
class Plan:
    """A planned run. From `motion` on all are None where the table cannot make any such pulse.

    `contact` is what the predicted motion asks of the contact, `sufficient` the answer of the simplest model that would
    do (`response` itself is the nonlinear one's). `settings` are what an operator sets on a released machine,
    `achieved` what is known of the table's own answer to the asked motion (`response` is to the motion as asked).
    """

    scene: Scene
    block: Block
    restitution: float
    capacity: Capacity
    clipped: Clipped | None
    motion: TableRun | None = None
    response: Response | None = None
    margin: Margin | None = None
    uncertain: Uncertain | None = None
    contact: Validity | None = None
    sufficient: Response | None = None
    settings: Settings | None = None
    achieved: tuple[Achieved, ...] = ()
    whole_run: WholeRun | None = None

    @property
    def feasible(self) -> bool:
        """Whether the table can perform the excitation exactly as asked."""
        return self.motion is not None and (self.clipped is None or self.clipped.feasible)

    @property
    def stays_up(self) -> bool:
        """Whether the block is predicted not to overturn."""
        return self.response is not None and self.response.outcome in (Outcome.STAYED, Outcome.ROCKED)

    @property
    def stop(self) -> tuple[float, float, float]:
        """The drive's ramp from the run's peak velocity: deceleration m/s2, time s, distance m.

        The drive takes a steeper ramp where the stroke left asks for it.
        """
        deceleration = stop_deceleration(self.scene, self.capacity)
        speed = 0.0 if self.motion is None else self.motion.peak_velocity
        return deceleration, speed / deceleration, 0.5 * speed * speed / deceleration


def plan_run(
    scene: Scene,
    capacity: Capacity,
    achieve: Callable[[Rehearsal], Sequence[Achieved]] = lambda _: (),
    mechanics: TableMechanics | None = None,
    response: Callable[[Rehearsal], TableResponse] = lambda _: AS_ASKED,
) -> Plan:
    """Plan `scene` on a table of `capacity`: clip, predict, search the margin, draw the futures.

    `achieve` says what is known of the table's own answer to a run; see `twin.achieved`. `mechanics` is how the table
    moves, for the checks of the whole run; it follows its command exactly unless given. `response` says what base
    motion the futures feel; see `twin.uncertainty.table`.

    Raises
    ------
    InputError
        Where the scene's numbers cannot be used together.
    """
    try:
        rehearsal = rehearse(scene, capacity)
    except NotPossibleError as refusal:
        return Plan(scene, refusal.block, refusal.restitution, capacity, refusal.clipped)
    block, eta, motion, given = rehearsal.block, rehearsal.restitution, rehearsal.motion, rehearsal.given
    return Plan(
        scene,
        block,
        eta,
        capacity,
        rehearsal.clipped,
        motion,
        rehearsal.response,
        None if given is None else find_margin(rehearsal, given),
        foresee(rehearsal, response(rehearsal)),
        rehearsal.response.validity(friction=scene.block.friction),
        simulate(block, motion, restitution=eta, initial_rotation=initial_rotation(scene), model="auto"),
        rehearsal.settings,
        tuple(achieve(rehearsal)),
        whole_run=check_whole_run(rehearsal, mechanics),
    )
