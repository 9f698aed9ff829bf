"""Ashlar: walls of sawn stones in level courses, laid to a bond or as they fit best."""
