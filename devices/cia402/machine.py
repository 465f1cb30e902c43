"""What a servo drive moves and measures, and what is set up in it before it runs."""

from __future__ import annotations

from typing import Annotated, NamedTuple, Protocol, runtime_checkable

from pydantic import BaseModel, ConfigDict, Field


class Machine(Protocol):
    """What a drive moves and measures. `Switched`, `Powered` and `Paced` say what more a machine may offer."""

    def advance(self, setpoint: float) -> None:
        """Live through one cycle while the set-point goes linearly from where it was to `setpoint`, m."""
        ...

    def measure_position(self) -> float:
        """Return the encoder's reading, m."""
        ...

    def measure_acceleration(self) -> float:
        """Return the accelerometer's reading, m/s2."""
        ...

    @property
    def velocity(self) -> float:
        """Velocity, m/s, by which standstill is told."""
        ...


class Switches(NamedTuple):
    """Digital inputs of a drive (object 60FD): limit switches, home switch, emergency stop; True is active."""

    negative: bool = False
    positive: bool = False
    home: bool = False
    stop: bool = False


@runtime_checkable
class Switched(Protocol):
    """A machine with switches."""

    @property
    def switches(self) -> Switches:
        """What the drive's digital inputs see now."""
        ...


@runtime_checkable
class Powered(Protocol):
    """A machine that knows whether the drive pushes; without it the set-point is held whatever the drive's state.

    Attributes
    ----------
    powered : bool
        Set by the drive. Where the power comes on the set-point is where the machine stands.
    """

    powered: bool


@runtime_checkable
class Paced(Protocol):
    """A machine whose cycle can be set (object 1006)."""

    def pace(self, cycle_time: float) -> None:
        """Let every later `advance` take `cycle_time`, s; the machine is at rest."""
        ...


_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class DriveOptions(BaseModel):
    """What is set up in an emulated drive before it runs: power-on values of its objects, which the host may write.

    Attributes
    ----------
    stop_deceleration : float
        Quick-stop and fault-reaction deceleration, m/s2 (object 6085), as long as the stroke left allows it. Default
        1 m/s2: under half of g tan(alpha) of block B6L, so that stopping does not rock it.
    patience : int
        Cycles without SYNC or without set-point that are bridged before the drive stops itself (object 2010); 200 at
        most, for the SYNC counter cannot tell 240 from none.
    start_window : float
        Largest distance of the first set-point from the measured position, m (object 2011).
    following_error : float
        Largest distance between set-point and measured position, m (object 6065); 20 mm are four times the lag of the
        ST-III's loop at its full speed.
    following_time : float
        How long it may be exceeded before the drive stops itself, s (object 6066).
    heartbeat_period : float
        s (object 1017).
    shared_clock : bool
        Whether drive and host run on one thread, so that they stand still together. Cycles left out between two SYNCs
        are then no silence: the set-point that came with the second one is known, and the gap is interpolated.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    stop_deceleration: _Positive = 1.0
    patience: Annotated[int, Field(ge=0, le=200)] = 20
    start_window: _Positive = 20e-6
    following_error: _Positive = 20e-3
    following_time: Annotated[float, Field(ge=0.0, le=65.0)] = 20e-3
    heartbeat_period: _Positive = 0.1
    shared_clock: bool = False
