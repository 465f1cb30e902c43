"""Which model is enough: bounds of what a simpler equation gets wrong, computed without running the richer one."""
