"""What measured rotations say: their noise, impacts, and which impacts of two runs are the same. Pure: arrays only."""
