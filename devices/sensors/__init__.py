"""Sensors that are CAN nodes of their own."""
