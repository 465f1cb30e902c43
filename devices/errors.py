"""Everything that goes wrong with a device, in one tree.

::

    DeviceError
    ├── BusUnavailable      the bus cannot be opened here (driver, dependency or network missing)
    ├── BusFailure          an open bus failed while sending or receiving
    ├── BusDisturbed        somebody else commands the table, or the bus repeats, reorders or spoils frames
    ├── FrameError          a frame's bytes do not carry what they should (also a ValueError)
    ├── EdsError            an electronic data sheet cannot be read or lacks what is needed (also a ValueError)
    ├── ObjectRefused       a device aborted the reading or writing of an object of its dictionary (SDO)
    ├── DeviceMismatch      the device is not the one its electronic data sheet describes
    ├── DeviceTimeout       an answer did not come within its time limit
    ├── DeviceNotReady      a call out of order: exchange before enable, enable before open
    ├── DriveFault          the drive is in fault or said so with an emergency frame
    ├── DriveStopped        the drive left operation enabled by itself, without a fault
    ├── LoopUnstable        a position loop the host cannot close at its rate (also a ValueError)
    ├── SetpointRefused     a set-point beyond the table's capacity (also a ValueError)
    ├── FaultRefused        a fault that cannot be injected: its name, a number of it, or where (also a ValueError)
    ├── LogFileError        a log of CAN frames cannot be written (also a ValueError)
    └── UnknownDevice       no device of that name (also a ValueError)
"""

# ruff: noqa: N818 - a name says what happened ("bus unavailable"); that it is an error the tree says.
from __future__ import annotations


class DeviceError(Exception):
    """Something is wrong with a device; the message is one sentence."""


class BusUnavailable(DeviceError):
    """The bus cannot be opened on this machine."""


class BusFailure(DeviceError):
    """An open bus failed while sending or receiving."""


class BusDisturbed(DeviceError):
    """Somebody else commands the table, or the bus repeats, reorders or spoils frames."""


class FrameError(DeviceError, ValueError):
    """Bytes that are not the frame they should be, or a value that does not fit its frame."""


class EdsError(DeviceError, ValueError):
    """An electronic data sheet that cannot be read, or lacks what is needed."""


class ObjectRefused(DeviceError):
    """A device aborted the reading or writing of an object.

    Attributes
    ----------
    code : int
        SDO abort code (CiA 301).
    """

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class DeviceMismatch(DeviceError):
    """The device is not the one its electronic data sheet describes; nothing was enabled."""


class DeviceTimeout(DeviceError):
    """An answer did not come within its time limit."""


class DeviceNotReady(DeviceError):
    """A call out of order; nothing was sent."""


class DriveFault(DeviceError):
    """The drive is in fault, or announced one.

    Attributes
    ----------
    code : int
        CiA 301/402 emergency error code; 0 where only the statusword told.
    """

    def __init__(self, message: str, code: int = 0) -> None:
        super().__init__(message)
        self.code = code


class DriveStopped(DeviceError):
    """The drive left operation enabled by itself, without a fault."""


class LoopUnstable(DeviceError, ValueError):
    """A position loop that is not stable at the rate the host would close it with."""


class SetpointRefused(DeviceError, ValueError):
    """A set-point beyond the table's capacity; it was not sent.

    Attributes
    ----------
    limit : str
        What bound it: "stroke", "velocity", "acceleration", "braking" (no way left to stop inside the stroke)
        or "start" (too far from where the table stands).
    """

    def __init__(self, message: str, limit: str) -> None:
        super().__init__(message)
        self.limit = limit


class FaultRefused(DeviceError, ValueError):
    """A fault that cannot be injected: no such fault, a number outside its bounds, or not here."""


class UnknownDevice(DeviceError, ValueError):
    """No device of that name."""


class LogFileError(DeviceError, ValueError):
    """A log of CAN frames that cannot be written."""
