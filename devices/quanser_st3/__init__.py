"""Quanser Shake Table III XY, one axis: capacity, driver over CiA 402, emulator."""
