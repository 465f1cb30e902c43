"""Base motions that a shake table is asked to make, what a table can do, and the motions it can really perform.

SI units throughout: s, m, m/s, m/s2, m/s3, Hz, kg. Nothing here reads a file or a clock.
"""

from excitation.capacity import Capacity
from excitation.clip import Clipped, clip
from excitation.constant import ConstantPulse
from excitation.double_pulse import DoublePulse
from excitation.limits import Limit
from excitation.motion import Motion
from excitation.pulse import Pulse
from excitation.record import Record
from excitation.released import ReleasedMachine, ReleasedRun
from excitation.reshaped import Ramped, Saturated
from excitation.table_run import Phase, TableRun
from excitation.wave import CosineWave, SineWave, Wave

__all__ = [
    "Capacity",
    "Clipped",
    "ConstantPulse",
    "CosineWave",
    "DoublePulse",
    "Limit",
    "Motion",
    "Phase",
    "Pulse",
    "Ramped",
    "Record",
    "ReleasedMachine",
    "ReleasedRun",
    "Saturated",
    "SineWave",
    "TableRun",
    "Wave",
    "clip",
]
