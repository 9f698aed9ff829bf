"""Stones as found: what one is, an inventory of them, and a synthetic quarry."""
