"""A run that is proposed: inside the table's capacity by the clip and by the device's own check, and why it is one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from devices.setpoints import first_refusal
from twin.errors import InputError
from twin.live import set_points
from twin.rehearsal import Rehearsal, rehearse
from twin.scene import Scene
from twin.search.family import Family
from twin.uncertainty.probability import Probability

RESOLUTION = 1e-9
"""Step of the set-points of a CiA 402 drive, m."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """One proposed run.

    Attributes
    ----------
    size, shape : float
        In the scene file's units; see `Family`.
    rehearsal : Rehearsal
        The run: its scene, motion and prediction.
    words : str
        The run in a few words.
    why : str
        Why it is proposed, one sentence.
    score : float
        Proposals of one goal are sorted by it, the largest first; what it is depends on the goal.
    overturning : Probability
        That the block overturns.
    numbers : mapping
        What else was found, by names that end in their units.
    """

    size: float
    shape: float
    rehearsal: Rehearsal
    words: str
    why: str
    score: float
    overturning: Probability
    numbers: Mapping[str, float | str | None] = field(default_factory=dict[str, "float | str | None"])

    @property
    def scene(self) -> Scene:
        """The scene of the run."""
        return self.rehearsal.scene


def admitted(family: Family, size: float, shape: float) -> Rehearsal | None:
    """Return the rehearsal of a run if the table makes it exactly as asked, None otherwise.

    Asked are the clip, payload, brake and stroke counted, and for a table that follows set-points the rule by which its
    drive takes or refuses each of them, over the whole run: approach, pulse, brake, return.
    """
    try:
        rehearsal = rehearse(family.scene_of(size, shape), family.capacity)
    except InputError:
        return None
    clipped = rehearsal.clipped
    if clipped is None or not clipped.feasible or clipped.limits:
        return None
    return rehearsal if refused(rehearsal) is None else None


def refused(rehearsal: Rehearsal) -> str | None:
    """Return why the device would refuse a set-point of the run; None where it takes them all, or is not sent any."""
    if rehearsal.capacity.machine is not None or rehearsal.capacity.kinds is not None:
        return None
    cycle_time = 1.0 / rehearsal.scene.twin.cycle_hz
    start = rehearsal.motion.displacement(0.0)
    targets = set_points(rehearsal.motion, rehearsal.after, cycle_time).tolist()
    found = first_refusal(rehearsal.capacity, cycle_time, RESOLUTION, start, targets)
    return None if found is None else found.sentence


def use_words(rehearsal: Rehearsal) -> str:
    """Return the number of the capacity that the run uses most of: "82 % of the stroke"."""
    clipped = rehearsal.clipped
    if clipped is None or not clipped.usage:
        return "nothing of the table"
    sizes = {name: share for name, share in clipped.usage.items() if name in ("stroke", "velocity", "acceleration")}
    name, share = max(sizes.items(), key=lambda item: item[1])
    return f"{share:.0%} of the {name}".replace("%", " %")


def beyond_words(family: Family, size: float, shape: float) -> str:
    """Return what a run asks that the table does not have, as a clause."""
    from twin.rehearsal import clip_scene

    pulse = family.pulse(size, shape)
    if pulse is None:
        return "there is no such pulse"
    limits = clip_scene(family.scene, family.capacity, pulse).limits
    return limits[0].sentence if limits else f"it fits {family.capacity.name}"
