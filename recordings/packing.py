"""Values of `twin.cycle` as the numbers of a topic, and as the bytes of a message record."""

from __future__ import annotations

from operator import attrgetter
from struct import Struct
from typing import TYPE_CHECKING, Any

from mcap.opcode import Opcode

from recordings.chunked_file import HEADER_LENGTH, MESSAGE_HEAD

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from recordings.topic import Topic


class Numbers:
    """Turns a dataclass into the numbers of a topic's fields and back: choices are codes there, names here.

    `layout` is the `struct` format of the numbers, without byte order.

    >>> from recordings.schema import FORECAST
    >>> from twin.cycle import Forecasted
    >>> seen = Forecasted("rocked", 0.4, 0.0, 9.0, "overturned", -0.1, 1.0, 0.6, "stopping would topple it", 0.0, 32)
    >>> Numbers(FORECAST).of(seen)
    [2, 0.4, 0.0, 9.0, 3, -0.1, 1.0, 0.6, 3, 0.0, 32, nan, nan, nan, nan]
    >>> Forecasted(*Numbers(FORECAST).values(Numbers(FORECAST).of(seen))).advice
    'stopping would topple it'
    """

    def __init__(self, topic: Topic) -> None:
        self.layout = "".join(field.struct_code for field in topic.fields)
        self._read = attrgetter(*(field.source for field in topic.fields))
        self._choices = [(place, field.choices.names) for place, field in enumerate(topic.fields) if field.choices]

    def of(self, value: object) -> list[Any]:
        """Numbers of `value`, in the order of the fields; ValueError where a choice has no such name."""
        numbers = list(self._read(value))
        for place, names in self._choices:
            numbers[place] = names.index(numbers[place])
        return numbers

    def values(self, numbers: Iterable[Any]) -> list[Any]:
        """The attributes again; a code that has no name is the first, "not said"."""
        values = list(numbers)
        for place, names in self._choices:
            values[place] = names[values[place]] if values[place] < len(names) else names[0]
        return values


class Packing:
    """Packs the one layout of a topic's message records.

    Parameters
    ----------
    topic : Topic
    channel : int
        Of the file.
    """

    def __init__(self, topic: Topic, channel: int) -> None:
        self.channel = channel
        layout = Struct(MESSAGE_HEAD + topic.struct_format)
        self._pack: Callable[..., bytes] = layout.pack
        self._template: list[float] = [Opcode.MESSAGE, layout.size - HEADER_LENGTH, channel, 0, 0, 0]
        for tag in topic.tags:
            self._template += [tag, 0]

    def record(self, sequence: int, log_time: int, publish_time: int, *values: float) -> bytes:
        """One message record; struct.error where a value does not fit its field."""
        parts = self._template.copy()
        parts[3:6] = sequence, log_time, publish_time
        parts[7::2] = values
        return self._pack(*parts)
