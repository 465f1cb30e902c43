"""`find_runs`: which runs of a scene's kind of pulse meet a goal, inside the table's capacity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from excitation import Capacity
from twin.errors import InputError
from twin.scene import Scene
from twin.search.family import Family
from twin.search.field import APART, separation
from twin.search.goals import Aim, Goal
from twin.search.judge import FEWEST, Judge, ResponseOf, as_asked
from twin.search.overturning import find_overturning, nearest_beyond
from twin.search.proposal import Proposal, beyond_words
from twin.search.rocking_well import find_rocking
from twin.search.safety import find_safe
from twin.search.separation import find_separating
from twin.search.survey import SHAPES, SIZES, Survey, survey


@dataclass(frozen=True, slots=True)
class Effort:
    """How finely is looked: sizes x shapes of the field, and futures of every proposed run, at least."""

    sizes: int = SIZES
    shapes: int = SHAPES
    futures: int = 4000


DEFAULT = Effort()


@dataclass(frozen=True, slots=True)
class Search:
    """What was found for a goal.

    Attributes
    ----------
    proposals : tuple of Proposal
        The best first; empty where nothing inside the capacity meets the goal.
    remarks : tuple of str
        What else is to be known: why nothing was found, what lies beyond.
    survey : Survey
        What was looked through.
    futures : int
        In how many futures each proposal was judged.
    """

    goal: Goal
    scene: Scene
    capacity: Capacity
    proposals: tuple[Proposal, ...]
    remarks: tuple[str, ...]
    survey: Survey
    futures: int


def find_runs(
    scene: Scene,
    capacity: Capacity,
    goal: Goal,
    *,
    most: int = 5,
    seed: int = 1,
    restitution: float | None = None,
    response: ResponseOf = as_asked,
    effort: Effort = DEFAULT,
) -> Search:
    """Search amplitudes and shapes of the scene's kind of pulse inside `capacity` for runs that meet `goal`.

    Parameters
    ----------
    scene : Scene
        Its block, table and kind of pulse; its own amplitude and frequency are where a goal says "this frequency".
    capacity : Capacity
    goal : Goal
    most : int
        Proposals at most.
    seed : int
        Equal seeds give equal proposals.
    restitution : float, optional
        The measured restitution to tell from Housner's; the scene's unless given.
    response : callable
        How the table answers, of a rehearsed run.
    effort : Effort

    Returns
    -------
    Search

    Raises
    ------
    InputError
        One sentence: the scene has nothing to search, or the table makes no such pulse at all.
    """
    family = Family(scene, capacity)
    if goal.at is not None and family.shape.unit != "Hz":
        raise InputError(f"--find: scene {scene.name} shakes with a {scene.excitation.kind}, which has no frequency")
    shapes = np.geomspace(family.shape.low, family.shape.high, effort.shapes if family.shape.key else 1)
    if goal.at is not None or goal.aim is Aim.SAFE:
        shapes = np.array([family.asked[1] if goal.at is None else goal.at])
    field = survey(family, shapes, sizes=effort.sizes)
    least = math.ceil(4.0 / goal.limit)
    futures = max(effort.futures, 3 * least)
    judge = Judge(field, futures, max(least, FEWEST), seed, response)
    remarks: list[str] = []
    if goal.aim is Aim.SAFE:
        found, remarks = find_safe(field, judge, float(field.shapes[0]), goal.limit)
    elif goal.aim is Aim.ROCK:
        found = list(find_rocking(field, judge, goal.limit, most))
        remarks = [] if found else [f"nothing inside the capacity of {capacity.name} rocks the block and is that safe"]
    elif goal.aim is Aim.SEPARATE:
        etas = _restitutions(scene, restitution)
        found = list(find_separating(field, judge, etas, most, seed))
        remarks = _of_separation(etas, bool(found), capacity.name)
    else:
        found = list(find_overturning(goal.aim, field, judge, most))
        remarks = [] if found else [_nothing(goal, field, judge)]
    return Search(goal, scene, capacity, tuple(_distinct(found)[:most]), tuple(remarks), field, futures)


def _distinct(found: list[Proposal]) -> list[Proposal]:
    """Return the proposals, the best first, without those that are nearly a better one."""
    kept: list[Proposal] = []
    for proposal in sorted(found, key=lambda one: -one.score):
        here = proposal.size, proposal.shape
        if all(separation(here, (other.size, other.shape)) >= 0.5 * APART for other in kept):
            kept.append(proposal)
    return kept


def _restitutions(scene: Scene, measured: float | None) -> tuple[float, float]:
    """Return Housner's restitution and the measured one; raises `InputError` where there is no second one."""
    housner = scene.block.block().housner_restitution
    other = scene.block.restitution if measured is None else measured
    if other is None:
        raise InputError(
            f"scene {scene.name} has no restitution but Housner's: give the measured one with --restitution"
        )
    if not 0.0 <= other <= 1.0:
        raise InputError(f"--restitution is {other:g}; it is a ratio of velocities, from 0 to 1")
    if abs(other - housner) < 1e-6:
        raise InputError(f"the measured restitution is Housner's, {housner:.6g}: there is nothing to tell apart")
    return housner, other


def _of_separation(etas: tuple[float, float], found: bool, table: str) -> list[str]:
    what = f"Housner's {etas[0]:.4g} and the measured {etas[1]:.4g}"
    if not found:
        return [f"nothing inside the capacity of {table} tells {what} apart"]
    return [
        f"{what}: sigma is one reading's noise and the spreads of everything but the restitution, from run to run; "
        "runs in which the block stays up come first"
    ]


def _nothing(goal: Goal, field: Survey, judge: Judge) -> str:
    """Return why there is no proposal, and the run that would do it and asks least more than the table has."""
    family = field.family
    near = nearest_beyond(goal.aim, field, judge.scouts)
    found = f"no {family.scene.excitation.kind} inside the capacity of {family.capacity.name} does it"
    if near is None:
        return found
    return f"{found}; the nearest that does is {family.words(*near)}: {beyond_words(family, *near)}"
