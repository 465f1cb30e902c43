"""One rigid block rocking on a moving base: the equation, the impact, the solver. No I/O, no clock, no device."""
