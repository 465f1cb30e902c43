"""Reading and writing objects of a device by SDO: canopen's client, fed by hand, bounded in time, without a thread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar, cast

from canopen.objectdictionary import ObjectDictionaryError
from canopen.sdo.client import SdoClient, WritableStream
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from devices.cia301.dictionary import Refused, load_eds, variable_of
from devices.cia301.frames import SDO_ANSWER, SDO_REQUEST
from devices.errors import DeviceTimeout, EdsError, FrameError, ObjectRefused

if TYPE_CHECKING:
    from collections.abc import Callable

    from canopen.objectdictionary import ODVariable

    from devices.cia301.host import Host

ANSWER_LIMIT = 0.2
"""For one answer, s, unless told: a hundred times what a device needs."""

_T = TypeVar("_T")
# Segments of one object; a server that never ends is given up.
_LONGEST = 200


class _Client(SdoClient):
    """canopen's client on a host's bus instead of a network with a thread."""

    def __init__(self, node: int, eds: str, host: Host, time_limit: float) -> None:
        super().__init__(SDO_REQUEST + node, SDO_ANSWER + node, load_eds(eds, node))
        self.network = cast("Any", self)
        self.requests = 0
        self._host = host
        self._time_limit = time_limit

    def send_message(self, can_id: int, data: bytes) -> None:
        """Send, as canopen asks its network to."""
        self._host.bus.send(can_id, bytes(data))

    def request_response(self, sdo_request: bytes) -> bytes:
        """Send one request and return its answer."""
        self.requests += 1
        if self.requests > _LONGEST:
            raise SdoCommunicationError(f"its answer has more than {_LONGEST} segments")
        return cast("bytes", super().request_response(sdo_request))  # pyright: ignore[reportUnknownMemberType]

    def read_response(self) -> bytes:
        """Wait for the answer and return it; raises canopen's errors."""
        data = self._host.await_frame(self.tx_cobid, self._time_limit)
        if data is None:
            raise SdoCommunicationError(f"no answer came within {self._time_limit:g} s")
        if len(data) != 8:
            raise SdoCommunicationError(f"its answer has {len(data)} bytes; an SDO frame has 8")
        self.responses.put(data)  # pyright: ignore[reportUnknownMemberType]
        return cast("bytes", super().read_response())


class Sdo:
    """The object dictionary of one device. Never used in the cycle, and no stop depends on it.

    Parameters
    ----------
    host : Host
    node : int
    eds : str
        Text of the device's electronic data sheet.
    name : str
        What messages call the device.
    time_limit : float
        For each answer, s.
    tries : int
        How often a lost answer is asked for again.
    """

    def __init__(
        self, host: Host, node: int, eds: str, name: str, *, time_limit: float = ANSWER_LIMIT, tries: int = 3
    ) -> None:
        self.node = node
        self.name = name
        self.dictionary = load_eds(eds, node)
        self._host = host
        self._client = _Client(node, eds, host, time_limit)
        self._tries = tries

    def read(self, index: int, sub: int = 0) -> int:
        """Return an integer object.

        Raises
        ------
        ObjectRefused
            Where the device aborts.
        DeviceTimeout
            Where it does not answer, or not in order.
        FrameError
            Where its bytes are none of the declared type.
        EdsError
            Where the data sheet declares no such object.
        """
        value = self._decoded(index, sub)
        if not isinstance(value, int):
            raise FrameError(f"{self._object(index, sub)} is no integer")
        return value

    def text(self, index: int, sub: int = 0) -> str:
        """Return a string object; errors as of `read`."""
        return str(self._decoded(index, sub))

    def write(self, index: int, value: int, sub: int = 0) -> None:
        """Write an integer object; errors as of `read`."""
        try:
            data = bytes(self._variable(index, sub).encode_raw(value))
        except ValueError:
            raise FrameError(f"{value} does not fit {self._object(index, sub)}") from None

        def download() -> None:
            # Unbuffered: a buffer would try to send again when it is closed after an error.
            with WritableStream(self._client, index, sub, len(data)) as stream:
                stream.write(data)  # pyright: ignore[reportUnknownMemberType]

        self._transfer(download, "write", index, sub)

    def _decoded(self, index: int, sub: int) -> object:
        variable = self._variable(index, sub)
        data = self._transfer(lambda: self._client.upload(index, sub), "read", index, sub)
        try:
            return variable.decode_raw(data)
        except ObjectDictionaryError:
            told = f"{len(data)} bytes; its EDS says {len(variable) // 8}"
            raise FrameError(f"{self._object(index, sub)} was answered with {told}") from None

    def _transfer(self, transfer: Callable[[], _T], verb: str, index: int, sub: int) -> _T:
        trouble = ""
        for _ in range(self._tries):
            self._host.drain()
            self._client.requests = 0
            try:
                return transfer()
            except SdoAbortedError as error:
                why = SdoAbortedError.CODES.get(error.code, "unknown reason").lower()
                what = f"refused to {verb} {self._object(index, sub)}"
                raise ObjectRefused(f"{self._who} {what}: {why} ({error.code:08X})", error.code) from None
            except SdoCommunicationError as error:
                trouble = str(error)
        raise DeviceTimeout(f"{self._who} did not {verb} {self._object(index, sub)}: {trouble}")

    @property
    def _who(self) -> str:
        return f"node {self.node} of {self.name}"

    def _object(self, index: int, sub: int) -> str:
        return f"object {index:04X}:{sub:02X} ({self._variable(index, sub).name})"

    def _variable(self, index: int, sub: int) -> ODVariable:
        try:
            return variable_of(self.dictionary, index, sub)
        except Refused:
            raise EdsError(f"EDS of {self._who} declares no object {index:04X}:{sub:02X}, which is needed") from None
