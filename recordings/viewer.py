"""Start a Rerun viewer that only this machine can reach."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from devices.clock import WallClock
from recordings.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Sequence

LOOPBACK = "127.0.0.1"
POLL_INTERVAL = 0.05
"""Time between two looks whether the viewer listens, s."""
START_LIMIT = 30.0
"""Most time a viewer may take to listen, s."""
WINDOW_LIMIT = 1.5
"""Time in which a viewer without a display or a graphics driver ends, after it listens, s."""
END_LIMIT = 5.0
"""Most time a viewer may take to end when asked, s."""


@dataclass(frozen=True)
class Viewer:
    """A running viewer: its process and the address it takes data at."""

    process: subprocess.Popen[bytes]
    url: str


@dataclass(frozen=True)
class WebViewer(Viewer):
    """A running server of the viewer that runs in a browser; `page` is what the browser opens."""

    page: str


def start_viewer(arguments: Sequence[str] = ()) -> Viewer:
    """Start a viewer on a free port of the loopback interface and wait until it listens.

    `rerun.spawn` is not used: it cannot be told an interface, and Rerun's servers bind every one unless told.

    Parameters
    ----------
    arguments : sequence of str
        More arguments of the `rerun` command, such as ``("--headless",)``.

    Raises
    ------
    RecordingError
        The viewer ended at once (no display, no graphics driver) or did not listen in time.
    """
    port = _free_port()
    process = _started(["--port", str(port), *arguments])
    _wait_until_it_listens(process, [port])
    # It listens before it has a window; one that cannot have any ends within this time.
    with suppress(subprocess.TimeoutExpired):
        process.wait(WINDOW_LIMIT)
        raise _ended_at_once(process)
    return Viewer(process, _url(port))


def start_web_viewer() -> WebViewer:
    """Start a server of the browser's viewer on free ports of the loopback interface and wait until it listens.

    It keeps what is sent to it for browsers that come later, and ends when its process is ended.

    Raises
    ------
    RecordingError
        It ended at once or did not listen in time.
    """
    port, page_port = _free_port(), _free_port()
    process = _started(["--serve-web", "--port", str(port), "--web-viewer-port", str(page_port)])
    _wait_until_it_listens(process, [port, page_port])
    url = _url(port)
    return WebViewer(process, url, f"http://{LOOPBACK}:{page_port}/?url={quote(url, safe='')}")


def end(viewer: Viewer) -> None:
    """End a viewer's process, by force where it does not go."""
    viewer.process.terminate()
    with suppress(subprocess.TimeoutExpired):
        viewer.process.wait(END_LIMIT)
        return
    viewer.process.kill()
    viewer.process.wait()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def _url(port: int) -> str:
    return f"rerun+http://{LOOPBACK}:{port}/proxy"


def _started(arguments: Sequence[str]) -> subprocess.Popen[bytes]:
    # A session of its own: the viewer outlives a Ctrl-C in the terminal. Its log would drown the run's own lines.
    return subprocess.Popen(  # noqa: S603
        [*_program(), "--bind", LOOPBACK, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "RERUN_APP_ONLY": "true"},
        start_new_session=True,
    )


def _wait_until_it_listens(process: subprocess.Popen[bytes], ports: Sequence[int]) -> None:
    clock = WallClock()
    deadline = clock.now() + START_LIMIT
    waiting = list(ports)
    while waiting and process.poll() is None and clock.now() < deadline:
        try:
            socket.create_connection((LOOPBACK, waiting[0]), timeout=1.0).close()
        except OSError:
            clock.wait_until(clock.now() + POLL_INTERVAL)
        else:
            waiting.pop(0)
    if process.poll() is not None:
        raise _ended_at_once(process)
    if waiting:
        process.kill()
        raise RecordingError(f"the Rerun viewer did not start within {START_LIMIT:g} s")


def _ended_at_once(process: subprocess.Popen[bytes]) -> RecordingError:
    return RecordingError(f"the Rerun viewer ended at once (exit code {process.returncode}): is there a display?")


def _program() -> list[str]:
    # The program itself where it is where the wheel puts it: ending the Python wrapper would leave the viewer running.
    package = find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise RecordingError("the Rerun viewer is not installed: rerun-sdk brings it")
    program = Path(package.origin).with_name("rerun.exe" if sys.platform == "win32" else "rerun")
    return [str(program)] if program.is_file() else [sys.executable, "-m", "rerun_cli"]
