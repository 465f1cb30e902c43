"""N blocks on each other: one formulation of which one block and two are cases."""
