"""The chain of pivots: numbers of a stack as compiled code wants them, its state, and where its bodies are.

A rotation theta, positive towards +x, turns a vector (x, z) of a body into r(theta)(x, z) = (x cos + z sin, -x sin +
z cos). Interface i lies under block i. Its pivot is at sigma_i c_i from its middle, on both bodies, c_i being half the
width of the contact; a closed interface (sigma_i = 0) ties the rotations of its two bodies, and its middle serves as
well as any point. From the middle E_i of interface i up:

    G_i = E_i + r(theta_(i-1)) (sigma_i c_i, 0) + r(theta_i) (-sigma_i c_i, h_i / 2),  E_(i+1) likewise with h_i.

Time inside is counted in 1/p, so accelerations come divided by p2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN as HALF_TURN
from twin.stack.solver.compiled import lent
from twin.stack.stack import Stack

# Scales of a chain.
GRAVITY, P, TOLERANCE, STICK, RULE, LOST = range(6)
UNILATERAL, ANGULAR_MOMENTUM = 0.0, 1.0
ENDS, FALLS, PULLS = 0.0, 1.0, 2.0


class Chain(NamedTuple):
    """What the equations need of a stack; every array but the last has one number a block, from the base up."""

    half: FloatArray  # c_i, m
    height: FloatArray  # h_i, m
    mass: FloatArray
    inertia: FloatArray  # about the centre of mass
    upper_face: FloatArray  # 1 where the face that a pivot presses on is the upper block's (it is the wider one)
    share: FloatArray  # k_i
    scales: FloatArray  # g / p2, p, local tolerance rad, sticking rate, rule of impact, what a pulling pivot does


class State(NamedTuple):
    """Where a stack is: sides sigma_i, gaps theta_i - theta_(i-1) rad, their rates in units of p, and the clock."""

    side: FloatArray
    gap: FloatArray
    rate: FloatArray
    clock: FloatArray
    peak: FloatArray  # largest |theta_i| so far, rad
    fallen: FloatArray  # when block i fell, s; nan while it stands
    lying: FloatArray  # theta_i where it fell, rad


# The clock: time s; blocks still standing; whether accelerations may have jumped; row of the pieces; when all closed
# last, s; whether anything has opened; counts; and, contact lost, the interface above which all falls for good, or -1.
TIME, BLOCKS, FRESH, PIECE, AT_REST, LIFTED, IMPACTS, STEPS, RECLOSED, FALLING = range(10)
CLOCK_SIZE = 10


class Place(NamedTuple):
    """Positions relative to the base, and room for one set of forces or impulses; one row a block or interface."""

    middle: FloatArray  # E_i, shape (n, 2)
    pivot: FloatArray  # E_i + sigma_i c_i t, shape (n, 2)
    centre: FloatArray  # G_i, shape (n, 2)
    turn: FloatArray  # cos, sin of theta_i, shape (n, 2)
    force: FloatArray  # of each body: x, z, moment, shape (n, 3)
    normal: FloatArray  # normal force at each interface
    moment: FloatArray  # about its middle


def chain_of(
    stack: Stack, tolerance: float = 1e-15, stick: float = 1e-11, rule: float = UNILATERAL, lost: float = ENDS
) -> Chain:
    """Return the numbers of `stack`; `tolerance` is the truncation of a step, rad, `stick` a rate in units of p."""
    p = stack.frequency_parameter
    blocks = stack.blocks
    mass = np.array(stack.masses)
    size = np.array([(block.width**2 + block.height**2) / 12.0 for block in blocks])
    below = [blocks[0], *blocks[:-1]]
    return Chain(
        np.array(stack.half_contacts),
        np.array([block.height for block in blocks]),
        mass,
        mass * size,
        np.array([float(block.width > under.width) for block, under in zip(blocks, below, strict=True)]),
        np.ones(len(blocks)) if stack.impulse_shares is None else np.array(stack.impulse_shares, dtype=np.float64),
        np.array([stack.gravity / (p * p), p, tolerance, stick, rule, lost]),
    )


def new_state(n: int) -> State:
    """Return a stack of `n` blocks at rest at time 0."""
    state = State(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(CLOCK_SIZE), np.zeros(n), np.full(n, math.nan), np.zeros(n)
    )
    state.clock[BLOCKS] = n
    state.clock[FRESH] = 1.0
    return state


def new_place(n: int) -> Place:
    """Return room for the positions of `n` blocks."""
    return Place(
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 3)),
        np.zeros(n),
        np.zeros(n),
    )


@lent
def set_out(chain: Chain, n: int, side: FloatArray, gap: FloatArray, place: Place) -> None:
    """Write the positions of the first `n` blocks."""
    x = 0.0
    z = 0.0
    theta = 0.0
    under_cos = 1.0
    under_sin = 0.0
    for i in range(n):
        theta += gap[i]
        c = math.cos(theta)
        s = math.sin(theta)
        place.turn[i, 0] = c
        place.turn[i, 1] = s
        place.middle[i, 0] = x
        place.middle[i, 1] = z
        reach = side[i] * chain.half[i]
        x += reach * under_cos
        z -= reach * under_sin
        place.pivot[i, 0] = x
        place.pivot[i, 1] = z
        x -= reach * c
        z += reach * s
        place.centre[i, 0] = x + 0.5 * chain.height[i] * s
        place.centre[i, 1] = z + 0.5 * chain.height[i] * c
        x += chain.height[i] * s
        z += chain.height[i] * c
        under_cos = c
        under_sin = s


@lent
def reactions(chain: Chain, n: int, place: Place) -> None:
    """Write what each interface must give for the forces in `place.force`: normal force, moment about its middle.

    Newton and Euler from the top down, forces being mass times acceleration less gravity (or impulses). For an open
    interface the moment means nothing.
    """
    fx = 0.0
    fz = 0.0
    for i in range(n - 1, -1, -1):
        fx += place.force[i, 0]
        fz += place.force[i, 1]
        face = i if chain.upper_face[i] != 0.0 else i - 1
        c = 1.0 if face < 0 else place.turn[face, 0]
        s = 0.0 if face < 0 else place.turn[face, 1]
        place.normal[i] = s * fx + c * fz
        m = 0.0
        for k in range(i, n):
            # Virtual work of a turn about E_i: perp(x, z) = (z, -x).
            m += (place.centre[k, 1] - place.middle[i, 1]) * place.force[k, 0]
            m -= (place.centre[k, 0] - place.middle[i, 0]) * place.force[k, 1]
            m += place.force[k, 2]
        place.moment[i] = m
