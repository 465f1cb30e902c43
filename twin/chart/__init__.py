"""`twin chart`: speed against accuracy of every solver, measured here, and where each fails."""
