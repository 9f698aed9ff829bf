"""Which stone goes into which cell of a wall, how it is turned, and how cells give way to stones."""
