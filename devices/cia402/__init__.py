"""The servo-drive profile CiA 402 on CAN, cyclic synchronous position mode: host side, emulated drive, frames.

Here: NMT, SYNC with counter, heartbeat, EMCY and the process data of one cycle. Not here yet: object dictionary, SDO
and EDS.
"""
