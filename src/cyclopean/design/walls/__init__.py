"""Walls of polygonal stones: the pattern, the surface it is laid on, exact joints, and how well they interlock."""
