"""Shake tables and sensors, real and emulated, behind one small abstract class.

A table refuses a set-point beyond its capacity; it never clips. python-can lives in this package and only here.
"""
