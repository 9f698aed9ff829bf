"""Stones cut back to their cells: solids, cuts, and the wall that they make."""
