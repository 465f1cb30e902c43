"""The servo-drive profile CiA 402 on CAN, cyclic synchronous position mode and homing: host side and emulated drive.

`servo_drive.eds` declares the objects, and is loaded by both sides. `master` is the host's table, `link` its cycle,
`commissioning` what is checked and set before it; `drive` is the emulated drive's protocol, `axis` what it moves.
"""
