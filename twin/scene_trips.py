"""`[trips]` of a scene file: when a run is to be stopped, and how."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from twin.scene_parts import NotNegative, Part, Positive

Action = Literal["off", "indicate", "ramp_down", "cut_power"]
"""What a trip does: nothing, a warning, a stop by the drive's ramp, or the power off at once (the table runs down
freely: only where a ramp would be worse)."""
Stop = Literal["ramp_down", "cut_power"]
"""What a trip does that cannot be switched off."""


class FollowingErrorTrip(Part):
    """|command - feedback| of the base beyond `limit_mm`. The command is the one the feedback answers."""

    limit_mm: Positive = 20.0
    action: Action = "ramp_down"


class PredictionErrorTrip(Part):
    """|estimate - measurement| of the rotation beyond `limit_rad` for `lasting_s`.

    The estimate is the state that follows the specimen, before the sample corrects it: the free prediction drifts out
    of phase in every run and proves nothing.
    """

    limit_rad: Positive = 0.05
    lasting_s: NotNegative = 0.05
    action: Action = "indicate"


class ForecastTrip(Part):
    """Overturning forecast with at least `probability`, without a break for `lasting_s`, and the block not lying yet.

    With `ramp_down` the table is stopped only while the forecast says that stopping is the better half.
    """

    probability: Annotated[float, Field(gt=0.0, le=1.0)] = 0.9
    lasting_s: NotNegative = 0.02
    action: Action = "indicate"


class RotationTrip(Part):
    """|measured rotation| beyond `limit_alpha` times the slenderness angle."""

    limit_alpha: Positive = 1.2
    action: Action = "indicate"


class CapacityTrip(Part):
    """A set-point refused, or the measured base beyond the stroke, or faster than the capacity by `margin_percent`."""

    margin_percent: NotNegative = 10.0
    action: Stop = "ramp_down"


class OverrunTrip(Part):
    """More than `in_a_row` cycles missed one after the other, or more than `share_percent` of the last second's."""

    in_a_row: Annotated[int, Field(ge=1, le=200)] = 100
    share_percent: Annotated[float, Field(gt=0.0, le=100.0)] = 25.0
    action: Action = "ramp_down"


class ConnectionTrip(Part):
    """A heartbeat, an answer or the bus lost, either way."""

    action: Stop = "ramp_down"


class SensorTrip(Part):
    """A sensor stuck while the table moves, or out of its range."""

    action: Action = "ramp_down"


class OperatorTrip(Part):
    """Ctrl-C, a polite kill, a closed terminal. A second Ctrl-C cuts the power whatever this says."""

    action: Stop = "ramp_down"


class TripsPart(Part):
    """`[trips]`: level and action of every trip. A fault the drive reports itself always stops it: it has no entry."""

    following_error: FollowingErrorTrip = FollowingErrorTrip()
    prediction_error: PredictionErrorTrip = PredictionErrorTrip()
    forecast: ForecastTrip = ForecastTrip()
    rotation: RotationTrip = RotationTrip()
    capacity: CapacityTrip = CapacityTrip()
    overrun: OverrunTrip = OverrunTrip()
    connection: ConnectionTrip = ConnectionTrip()
    sensor: SensorTrip = SensorTrip()
    operator: OperatorTrip = OperatorTrip()


TRIPS: dict[str, type[Part]] = {
    "trips": TripsPart,
    **{name: type(field.default) for name, field in TripsPart.model_fields.items()},
}
"""The tables of `[trips]` by their names in a scene file."""
