"""What a recording can refuse.

RecordingError (a ValueError): one sentence for the person at the keyboard.
"""

from __future__ import annotations


class RecordingError(ValueError):
    """A recording cannot be written, or a file is not one that can be read; the message is one sentence."""
