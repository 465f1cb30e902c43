"""Air track: a cart drawn by a falling mass. Capacity only; it has neither driver nor emulator yet."""
