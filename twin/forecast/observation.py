"""One sample of the observer: predict as the solver does, then let the measured rotation correct what is believed.

While the block rocks, the estimate is a Kalman filter's (`twin.forecast.belief`): gain K = P h / (h P h + r^2) with the
sensor's noise r, from noise and process alone, so that between impacts it settles to a steady gain; the impacts are the
solver's own, with their jump. What a filter for a smooth system would get wrong is decided here:

* A correction that would take phi below 0 is no rotation about the wrong corner. Where the block is coming down it
  strikes now, with its jump: the predicted instant was late. Where it has just struck it stays on the contact: the
  predicted instant was early, and it waits for the specimen.
* At rest nothing is corrected. The block is lifted only when the mean of the last readings is beyond what noise makes.
* A reading further off than `GATE` deviations is not believed, nor one that stays the same to the last bit.
"""

from __future__ import annotations

import math

from twin.forecast.belief import ALPHA as B_ALPHA
from twin.forecast.belief import ETA as B_ETA
from twin.forecast.belief import INITIAL_TILT, NOISE, SIZE, correct, fly, lift, settle, strike
from twin.forecast.belief import PHI as B_PHI
from twin.forecast.belief import RATE as B_RATE
from twin.forecast.compiled import compiled
from twin.rocking.compiled import FloatArray
from twin.rocking.march import FELL, FULL, HALF_TURN, march
from twin.rocking.series import C0, C1, T0, T1, base_acceleration
from twin.rocking.state import (
    ALPHA,
    GRAVITY,
    IMPACT,
    PHI,
    PSI,
    RATE,
    REST,
    RESTITUTION,
    SIDE,
    THRESHOLD,
    TIME,
    UPLIFT,
    P,
)

# What the observer remembers: at rest the mean of the readings and their number; the mean of the normalised innovation
# squared; the last reading, how often it came in a row, and the prediction when it first did; the last innovation, rad
# and in deviations; how many were not believed in a row; impacts that taught; whether the last reading was believed;
# the last correction.
(MEAN, COUNT, SQUARED, READING, SAME, SINCE, INNOVATION, NORMALISED, REJECTED, TAUGHT, BELIEVED, CHANGE) = range(12)
MEMORY = CHANGE + SIZE

GATE = 5.0
REPEATED = 2.0  # times a reading may come in a row: one that repeats itself to the last bit teaches nothing new
LONGEST_REPEAT = 5.0  # times, before it is thought to be stuck rather than slow
MOVED = 4.0  # deviations the prediction may move meanwhile, before that is held against the sensor
AVERAGED = 8.0  # readings at rest, in the mean that lifts the block
LIFT = 1.5  # deviations of one reading; of that mean, six
SMOOTHED = 32.0  # innovations, in the mean of their squares
STILL = 0.1  # of the noise: an estimate that rises no more than this, and is held down, rests
HELD = 0.3  # of sin(alpha)
FARTHEST = 4.0  # prior deviations a parameter may be moved


@compiled
def observe(
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    sample: FloatArray,
    reading: float,
    cov: FloatArray,
    prior: FloatArray,
    settings: FloatArray,
    memory: FloatArray,
    steps: FloatArray,
    events: FloatArray,
    used: FloatArray,
    f: FloatArray,
    c: FloatArray,
    work: FloatArray,
) -> None:
    """Go on by one sample of the base acceleration, linear in it, then take the `reading` (rad, NaN for none).

    Parameters
    ----------
    body, state : ndarray
        As for `twin.rocking.march.march`; changed. The body's slenderness and restitution are the estimate's.
    sample : ndarray, shape (3,)
        Its length, s, and the accelerations at its ends, m/s2.
    cov : ndarray, shape (4, 4)
        See `twin.forecast.belief`; changed.
    prior : ndarray, shape (4,)
        Mean and standard deviation of alpha, then of eta.
    settings, memory : ndarray
    piece, steps, events, used, f, c, work : ndarray
        Room to work in; `steps` has no rows.
    """
    _predict(
        body,
        state,
        piece,
        sample,
        cov,
        settings,
        memory,
        steps,
        events,
        used,
        f,
        c,
        work,
    )
    memory[INNOVATION] = math.nan
    memory[NORMALISED] = math.nan
    memory[BELIEVED] = 0.0
    if math.isnan(reading):
        return
    predicted = state[SIDE] * state[PHI]
    noise = settings[NOISE]
    memory[SAME] += 1.0
    if reading != memory[READING]:
        memory[READING] = reading
        memory[SINCE] = predicted
        memory[SAME] = 1.0
    repeated = memory[SAME] >= REPEATED
    if state[PHI] >= HALF_TURN:
        _judge(memory, reading - predicted, noise * noise)
    elif state[SIDE] == 0.0:
        _watch_at_rest(body, state, cov, settings, memory, reading)
    else:
        variance = cov[B_PHI, B_PHI] + noise * noise
        _judge(memory, reading - predicted, variance)
        if not abs(memory[NORMALISED]) <= GATE or (repeated and abs(predicted - memory[SINCE]) > MOVED * noise):
            memory[REJECTED] += 1.0
        elif not repeated:
            memory[REJECTED] = 0.0
            memory[BELIEVED] = 1.0
            _correct(body, state, cov, prior, settings, memory, sample[2], variance)


@compiled
def _predict(
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    sample: FloatArray,
    cov: FloatArray,
    settings: FloatArray,
    memory: FloatArray,
    steps: FloatArray,
    events: FloatArray,
    used: FloatArray,
    f: FloatArray,
    c: FloatArray,
    work: FloatArray,
) -> None:
    """Advance the state as `twin.rocking.track.TrackedBlock` does, to the last bit, and the covariance with it."""
    start = state[TIME]
    end = start + sample[0]
    piece[T0] = start
    piece[T1] = end
    piece[C0] = sample[1]
    piece[C1] = (sample[2] - sample[1]) / sample[0]
    p = body[P]
    side = state[SIDE]
    psi = state[PSI]
    t = start
    code = FELL if state[PHI] >= HALF_TURN else FULL
    while code == FULL:
        used[1] = 0.0
        code = march(body, state, piece, end, steps, events, used, f, c, work)
        for k in range(int(used[1])):
            time = events[k, 0]
            kind = events[k, 2]
            force = side * base_acceleration(piece, t) / body[GRAVITY]
            if side != 0.0:
                fly(cov, psi, force, p * (time - t), settings)
            t = time
            psi = body[ALPHA]
            if kind == IMPACT:
                before = -abs(events[k, 1]) / p
                force = side * base_acceleration(piece, t) / body[GRAVITY]
                if before < 0.0 and strike(cov, body[ALPHA], body[RESTITUTION], before, force, settings):
                    memory[TAUGHT] += 1.0
                side = -side
            elif kind == UPLIFT:
                side = 1.0 if base_acceleration(piece, t) <= 0.0 else -1.0
                lift(cov, body[ALPHA])
            elif kind == REST:
                side = 0.0
                _come_to_rest(cov, settings, memory)
    state[TIME] = end
    if state[SIDE] != 0.0 and state[PHI] < HALF_TURN:
        force = state[SIDE] * base_acceleration(piece, t) / body[GRAVITY]
        fly(cov, psi, force, p * (end - t), settings)
    elif side != 0.0:
        _come_to_rest(cov, settings, memory)


@compiled
def _come_to_rest(cov: FloatArray, settings: FloatArray, memory: FloatArray) -> None:
    settle(cov, settings[NOISE])
    memory[MEAN] = 0.0
    memory[COUNT] = 0.0


@compiled
def _judge(memory: FloatArray, innovation: float, variance: float) -> None:
    """Note an innovation and what it says of the filter: squares of normalised ones average 1 where all is well."""
    z = innovation / math.sqrt(variance)
    memory[INNOVATION] = innovation
    memory[NORMALISED] = z
    memory[SQUARED] += (min(z * z, GATE * GATE) - memory[SQUARED]) / SMOOTHED


@compiled
def _watch_at_rest(
    body: FloatArray, state: FloatArray, cov: FloatArray, settings: FloatArray, memory: FloatArray, reading: float
) -> None:
    """Average the readings of a block at rest; lift it where they say that it leans, beyond their noise."""
    noise = settings[NOISE]
    variance = noise * noise * (1.0 + 1.0 / AVERAGED)
    if memory[COUNT] == 0.0:
        variance += cov[B_PHI, B_PHI]
    _judge(memory, reading - memory[MEAN], variance)
    memory[INNOVATION] = reading
    if not abs(memory[NORMALISED]) <= GATE:
        memory[REJECTED] += 1.0
        return
    memory[REJECTED] = 0.0
    memory[BELIEVED] = 1.0
    memory[COUNT] += 1.0
    memory[MEAN] += (reading - memory[MEAN]) / min(memory[COUNT], AVERAGED)
    cov[B_PHI, B_PHI] *= noise * noise / (cov[B_PHI, B_PHI] + noise * noise)
    leans = memory[COUNT] >= AVERAGED and abs(memory[MEAN]) > LIFT * noise
    if leans and memory[SAME] < LONGEST_REPEAT:
        state[SIDE] = math.copysign(1.0, memory[MEAN])
        state[PHI] = abs(memory[MEAN])
        state[PSI] = body[ALPHA] - state[PHI]
        state[RATE] = 0.0
        cov[B_PHI, B_PHI] = noise * noise
        # As fast as a fall from there makes it, either way.
        cov[B_RATE, B_RATE] = 8.0 * math.sin(body[ALPHA]) * state[PHI]
        memory[SINCE] = memory[MEAN]


@compiled
def _correct(
    body: FloatArray,
    state: FloatArray,
    cov: FloatArray,
    prior: FloatArray,
    settings: FloatArray,
    memory: FloatArray,
    acceleration: float,
    variance: float,
) -> None:
    """Let a believed innovation change state and parameters, on this side of the contact or over it."""
    change = memory[CHANGE : CHANGE + SIZE]
    correct(cov, state[SIDE] * memory[INNOVATION], variance, change)
    alpha = _held(body[ALPHA] + change[B_ALPHA], prior[0], prior[1])
    eta = min(max(_held(body[RESTITUTION] + change[B_ETA], prior[2], prior[3]), 0.0), 1.0)
    phi = state[PHI] + change[B_PHI]
    v = state[RATE] + change[B_RATE]
    body[ALPHA] = alpha
    body[THRESHOLD] = body[GRAVITY] * math.tan(alpha)
    body[RESTITUTION] = eta
    force = state[SIDE] * acceleration / body[GRAVITY]
    if phi < 0.0 and v < 0.0:
        if strike(cov, alpha, eta, v, force, settings):
            memory[TAUGHT] += 1.0
        state[SIDE] = -state[SIDE]
        force = -force
        # It struck phi / v ago, and has gone on since.
        phi = -eta * phi
        v = -eta * v
    phi = max(phi, 0.0)
    weak = math.sin(alpha) - abs(force) * math.cos(alpha)
    height = phi + v * v / (2.0 * max(weak, 1e-9))
    if weak > HELD * math.sin(alpha) and height < STILL * settings[NOISE]:
        state[SIDE] = 0.0
        phi = 0.0
        v = 0.0
        _come_to_rest(cov, settings, memory)
    state[PHI] = phi
    state[PSI] = alpha - phi
    state[RATE] = v


@compiled
def _held(value: float, mean: float, deviation: float) -> float:
    return min(max(value, mean - FARTHEST * deviation), mean + FARTHEST * deviation)


@compiled
def begin_at(cov: FloatArray, prior: FloatArray, settings: FloatArray) -> None:
    """Write the covariance of the first instant: tilt, slenderness and restitution as the scene states them."""
    cov[:] = 0.0
    cov[B_PHI, B_PHI] = settings[INITIAL_TILT] ** 2
    cov[B_ALPHA, B_ALPHA] = prior[1] ** 2
    cov[B_ETA, B_ETA] = prior[3] ** 2
