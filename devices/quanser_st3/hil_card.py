"""Quanser's HIL board: the only module that calls `quanser.hardware`, which comes with Quanser's software.

Read in Quanser's public examples and in the docstrings of its Python package: names, order and kind of all arguments;
`task_read` waits for samples and returns how many it read, fewer where the task was stopped; `watchdog_reload` returns
whether the watchdog had not expired; an expired one leaves the outputs as they are, unless their expiration state was
set before it was started, which not every board can do. Not tried on a board: all of it; in particular that another
thread may call `task_stop` while `task_read` waits.
"""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from devices.errors import BusFailure, BusUnavailable, DriveStopped

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.quanser_st3.hil_settings import HilSettings

_BUFFER = 0.1
"""Of samples that were not read yet, s, before the board calls it an error: many times the watchdog."""


class Reading(NamedTuple):
    """One sample, in counts and volts."""

    encoder: int
    rotation: int
    accelerometer: float


def quanser_hardware() -> Any:
    """Return the module `quanser.hardware`.

    Raises
    ------
    BusUnavailable
        Where it is not installed, or its library cannot be loaded.
    """
    try:
        return import_module("quanser.hardware")
    except (ImportError, OSError) as error:
        reason = " ".join(str(error).split())
        raise BusUnavailable(
            f"quanser.hardware is not installed here: {reason} (it comes with Quanser's software, not from PyPI)"
        ) from error


class HilCard:
    """One board: opened, sampled by a task of its own clock, watched, and left at 0 V.

    Parameters
    ----------
    hardware : module
        `quanser.hardware`, or what stands in for it.
    settings : HilSettings
    cycle_time : float
        s.
    """

    def __init__(self, hardware: Any, settings: HilSettings, cycle_time: float) -> None:
        self.name = f"HIL board {settings.board} {settings.identifier}"
        self._hardware = hardware
        self._settings = s = settings
        self._rate = 1.0 / cycle_time
        self._card: Any = None
        self._task: Any = None
        self._watched = False
        self._out = np.array([s.output_channel], np.uint32)
        self._in = np.array([s.accelerometer_channel], np.uint32)
        self._encoders = np.array([s.encoder_channel, s.rotation_channel], np.uint32)
        self._volts = np.zeros(1)
        self._counts = np.zeros(2, np.int32)
        self._output = np.zeros(1)

    def open(self) -> None:
        """Connect, and put the output at 0 V.

        Raises
        ------
        BusUnavailable
            Where there is no such board.
        """
        s = self._settings
        card = self._hardware.HIL()
        try:
            card.open(s.board, s.identifier)
        except self._hardware.HILError as error:
            raise BusUnavailable(f"{self.name} cannot be opened: {_text(error)}") from error
        self._card = card
        self.write(0.0)

    def version(self) -> str:
        """Return the version of Quanser's HIL software."""
        version = self._call("tell its version", lambda: self._hardware.HIL.get_version())
        return f"{version.major}.{version.minor}.{version.release}"

    def look(self) -> Reading:
        """Return what is measured now, without waiting."""
        self._call(
            "read its encoders", lambda: self._card.read_encoder(self._encoders, len(self._encoders), self._counts)
        )
        self._call("read its input", lambda: self._card.read_analog(self._in, len(self._in), self._volts))
        return self._reading()

    def start(self) -> None:
        """Sample every cycle from now on; the output falls to 0 V where `reload` is not called in time."""
        s, card = self._settings, self._card
        if not s.built_in_zero:
            self._set_expiration(card)
        self._task = self._call(
            "make a task",
            lambda: card.task_create_reader(
                max(2, round(_BUFFER * self._rate)),
                self._in, len(self._in), self._encoders, len(self._encoders), None, 0, None, 0,
            ),
        )  # fmt: skip
        clock = self._hardware.Clock.HARDWARE_CLOCK_0
        self._call(
            "start its task", lambda: card.task_start(self._task, clock, self._rate, self._hardware.HIL.INFINITE)
        )

    def _set_expiration(self, card: Any) -> None:
        """Let the output fall to 0 V as the watchdog expires: it stays what it is otherwise."""
        what = "take 0 V for an expired watchdog"
        self._call(what, lambda: card.watchdog_set_analog_expiration_state(self._out, len(self._out), np.zeros(1)))
        if lines := self._settings.tristate_channels:
            channels = np.array(lines, np.uint32)
            states = np.full(len(lines), self._hardware.DigitalState.TRISTATE, np.int32)
            self._call(what, lambda: card.watchdog_set_digital_expiration_state(channels, len(channels), states))

    def watch(self) -> None:
        """Start the watchdog; from now on `reload` is called every cycle."""
        self._call("start its watchdog", lambda: self._card.watchdog_start(self._settings.watchdog))
        self._watched = True

    def read(self) -> Reading:
        """Wait for the next sample of the task, and return it."""
        count = self._call(
            "read a sample", lambda: self._card.task_read(self._task, 1, self._volts, self._counts, None, None)
        )
        if count != 1:
            raise DriveStopped(f"{self.name} stopped sampling by itself")
        return self._reading()

    def reload(self) -> None:
        """Keep the watchdog quiet for another while.

        Raises
        ------
        DriveStopped
            Where it had expired: the output is 0 V.
        """
        if not self._call("reload its watchdog", self._card.watchdog_reload):
            raise DriveStopped(
                f"the watchdog of {self.name} expired: the host was more than {self._settings.watchdog * 1e3:g} ms "
                "late, and the output is 0 V"
            )

    def write(self, voltage: float) -> None:
        """Put `voltage`, V, on the output."""
        self._output[0] = voltage
        self._call("write its output", lambda: self._card.write_analog(self._out, len(self._out), self._output))

    def interrupt(self) -> None:
        """From another thread: let a `read` that waits return, with the output at 0 V."""
        for what in (
            lambda: self._card.write_analog(self._out, len(self._out), np.zeros(1)),
            lambda: self._card.task_stop(self._task),
        ):
            self._attempt(what)

    def stop(self) -> None:
        """Put the output at 0 V, then end watchdog and task; every step is tried whatever the others do.

        Raises
        ------
        BusFailure
            Where 0 V could not be written. The watchdog is then left alone: it does that.
        """
        failure: BusFailure | None = None
        try:
            self.write(0.0)
        except BusFailure as error:
            failure = error
        if self._watched and failure is None:
            self._attempt(self._card.watchdog_stop)
            self._watched = False
        if self._task is not None:
            task, self._task = self._task, None
            self._attempt(lambda: self._card.task_stop(task))
            self._attempt(lambda: self._card.task_delete(task))
        if failure is not None:
            raise failure

    def close(self) -> None:
        """Disconnect; what fails on the way is passed over. `stop` comes first: it says whether the output is 0 V."""
        if self._card is not None:
            card, self._card = self._card, None
            self._attempt(card.close)

    @property
    def expired(self) -> bool:
        """Whether the watchdog has expired."""
        return bool(self._call("tell of its watchdog", self._card.watchdog_is_expired))

    def clear(self) -> None:
        """Forget that the watchdog expired; the output is 0 V."""
        self.write(0.0)
        self._call("forget an expired watchdog", self._card.watchdog_clear)

    def _reading(self) -> Reading:
        return Reading(int(self._counts[0]), int(self._counts[1]), float(self._volts[0]))

    def _call(self, what: str, call: Callable[[], Any]) -> Any:
        try:
            return call()
        except self._hardware.HILError as error:
            raise BusFailure(f"{self.name} did not {what}: {_text(error)}") from error

    def _attempt(self, call: Callable[[], Any]) -> None:
        """Do what is done on the way out, where no failure may stop the rest."""
        with suppress(self._hardware.HILError):
            call()


def _text(error: Any) -> str:
    """Return Quanser's own words; its errors carry a number and look the text up."""
    words = error.get_error_message() if hasattr(error, "get_error_message") else str(error)
    return " ".join(str(words).split())
