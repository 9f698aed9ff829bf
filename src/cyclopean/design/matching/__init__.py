"""Which stone goes into which cell of a wall, how it is turned, and what is carved away."""
