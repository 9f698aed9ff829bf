"""Walls laid of stones as they are: rubble settled on a height map, ashlar in courses, best-fit packing."""
