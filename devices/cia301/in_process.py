"""CAN frames inside one process: python-can's virtual bus, without what costs a control cycle a quarter of its time."""

from __future__ import annotations

import queue
import time
from copy import deepcopy

import can
from can.interfaces.virtual import VirtualBus


class InProcessBus(VirtualBus):
    """One end of a channel of python-can's virtual bus; python-can's own ends on that channel hear it and are heard.

    Two things are done otherwise. The only listener, or the last of several, gets the message itself instead of a deep
    copy: it belongs to the bus from `send` on, whoever sent it must not use it again. And to look whether a frame is
    there takes neither the time nor, where none is, an exception.
    """

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame; CanOperationError where a listener's queue stays full for `timeout`, s."""
        if self.receive_own_messages:
            super().send(msg, timeout)
            return
        self._check_if_open()
        msg.timestamp = time.time()
        msg.channel = self.channel_id
        listeners = [listener for listener in self.channel if listener is not self.queue]
        full = False
        for k, listener in enumerate(listeners):
            try:
                listener.put(deepcopy(msg) if k + 1 < len(listeners) else msg, timeout=timeout)
            except queue.Full:
                full = True
        if full:
            raise can.CanOperationError("could not send message to one or more recipients")

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame, or None where none comes within `timeout`, s; without a timeout it waits for one."""
        if timeout != 0.0 or self.filters:
            return super().recv(timeout)
        self._check_if_open()
        return None if self.queue.empty() else self.queue.get_nowait()
