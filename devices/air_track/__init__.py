"""Air track: a cart drawn by a falling mass."""
