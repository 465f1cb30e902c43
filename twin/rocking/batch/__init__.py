"""Many cells of a map at once: vectorised passes with an error bound, the accurate solver for what they leave."""
