"""Quanser Shake Table III XY, one axis: over CiA 402, or over Quanser's HIL API; emulated over CiA 402."""
