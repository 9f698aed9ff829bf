"""What the verdict does when friction, weight, joints and the ground are not quite what was said."""
