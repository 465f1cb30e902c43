"""What every CANopen node is (CiA 301): bus, frames, network management, heartbeat, object dictionary, SDO, emergency.

python-can carries the frames, the canopen library the object dictionary (EDS) and SDO; both live in `devices` alone.
"""

import logging

# Without a handler Python prints canopen's errors to stderr; each of them reaches our caller as an exception.
logging.getLogger("canopen").addHandler(logging.NullHandler())
