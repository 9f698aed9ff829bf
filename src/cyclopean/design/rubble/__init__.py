"""Rubble: walls of stones as they were found, settled one by one and in equilibrium at every stage."""
