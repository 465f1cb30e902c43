"""Overturning maps: every pulse of a grid, decided; `overturning.overturning_map` is the way in."""
