"""The stack's equations, impacts and events, compiled."""
