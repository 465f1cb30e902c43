"""What the live cycle knows beyond its free prediction: the state that follows the specimen, and what comes next."""

from __future__ import annotations

import math

from twin.cycle import Estimated, Forecasted
from twin.forecast.ensemble import FUTURES
from twin.forecast.forecast import Branch, Forecast, Forecaster
from twin.forecast.loop import TableLoop
from twin.forecast.observer import Observer, Uncertainty
from twin.forecast.ramp import RampDown
from twin.rocking.compiled import FloatArray
from twin.scene import Scene
from twin.stopping import stop_deceleration

REACTION_CYCLES = 2
"""From the cycle that decides to stop until the drive's ramp begins: the command goes out with the next SYNC, and its
first set-point is reached one cycle later."""


class Foresight:
    """Observer and forecaster of one run: one call of `measure` a cycle, then read.

    Contract: no clock, deterministic, no exception for any finite or NaN reading; `estimate` and `forecast` are of the
    last `measure`.

    Parameters
    ----------
    observer : Observer
    forecaster : Forecaster
    """

    def __init__(self, observer: Observer, forecaster: Forecaster) -> None:
        self.observer = observer
        self.latest: Forecast | None = None
        self._forecaster = forecaster
        self._before = math.nan

    def measure(self, time: float, acceleration: float, rotation: float) -> None:
        """Take what was measured at `time`, s: base acceleration, m/s2, and rotation, rad (NaN for none)."""
        observer = self.observer
        observer.update(time, acceleration, rotation)
        self._before = rotation - observer.innovation
        self.latest = self._forecaster.update(observer)

    def follow(self, time: float, acceleration: float, rotation: float) -> None:
        """Take a sample as `measure` does, but forecast nothing: all that a `fan` needs."""
        self.observer.update(time, acceleration, rotation)
        self._forecaster.follow(self.observer)

    @property
    def rotation_before(self) -> float:
        """Estimated rotation before the last reading corrected it, rad; NaN without a reading."""
        return self._before

    def ramp_down(self, time: float) -> None:
        """Say that a stop was decided at `time`, s: from now on that is the plan."""
        self._forecaster.ramp_down(time)

    @property
    def estimate(self) -> Estimated:
        """The observer's state, as it is recorded."""
        observer = self.observer
        return Estimated(
            observer.rotation,
            observer.angular_velocity,
            observer.restitution,
            observer.restitution_deviation,
            observer.slenderness,
            observer.slenderness_deviation,
            observer.innovation,
        )

    @property
    def forecast(self) -> Forecasted | None:
        """The latest forecast, as it is recorded; None before the first."""
        latest = self.latest
        if latest is None:
            return None
        on, stop = latest.going_on, latest.stopping
        return Forecasted(
            on.outcome.value,
            on.margin,
            on.probability,
            on.overturning,
            stop.outcome.value,
            stop.margin,
            stop.probability,
            stop.overturning,
            latest.advice,
            latest.age,
            FUTURES,
            on.earliest,
            on.latest,
            stop.earliest,
            stop.latest,
        )

    def fan(self, horizon: float = 3.0) -> tuple[FloatArray, FloatArray]:
        """Return times, s, and rotations, rad, of the futures from here: for pictures, not for the cycle."""
        return self._forecaster.fan(self.observer, horizon)


def foresight(
    scene: Scene,
    pieces: FloatArray,
    stroke: float,
    acceleration: float,
    loop: TableLoop | None = None,
    until: float | None = None,
) -> Foresight:
    """Return observer and forecaster of a scene's run, before its first sample.

    Parameters
    ----------
    scene : Scene
    pieces : ndarray, shape (n, 7)
        The whole run the table is told to make, see `excitation.Pulse.pieces`; the forecast looks along it.
    stroke, acceleration : float
        Of the table's capacity, m and m/s2.
    loop : TableLoop, optional
        How the table follows its command; exactly and at once unless told.
    until : float, optional
        Time of the run from which on nothing stops the table, s; see `RampDown`.
    """
    twin, block = scene.twin, scene.block.block()
    unsure = Uncertainty(
        rotation_noise=twin.rotation_noise_rad,
        restitution=min(twin.restitution_spread, 1.0),
        slenderness=min(0.01 * twin.slenderness_spread_percent, 0.5),
        initial_tilt=min(math.radians(twin.initial_tilt_spread_deg), 1.5),
    )
    observer = Observer(
        block,
        scene.block.restitution,
        math.radians(scene.block.initial_rotation_deg),
        uncertainty=unsure,
    )
    stop = RampDown(
        min(stop_deceleration(scene, None), acceleration),
        0.5 * stroke,
        acceleration,
        REACTION_CYCLES / twin.cycle_hz,
        until,
    )
    return Foresight(observer, Forecaster(block, pieces, stop, loop=loop, seed=twin.seed))


def branch_words(branch: Branch) -> str:
    """Return one course's outlook in words: "overturns in 0.42 s (32 of 32)"."""
    share = f"{round(branch.probability * FUTURES)} of {FUTURES}"
    if branch.outcome.value == "overturned":
        return f"overturns in {branch.overturning:.2f} s ({share})"
    return f"{branch.outcome.value} ({share} overturn)"


def advice_words(forecast: Forecast) -> str:
    """Return the advice with its reasons, a sentence."""
    return (
        f"{forecast.advice}: if the run goes on the block {branch_words(forecast.going_on)}; "
        f"if it is ramped down now, {branch_words(forecast.stopping)}"
    )
