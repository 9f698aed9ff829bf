"""Sheets for whoever builds: elevations to scale, order, a card for each stone, cuts and templates."""
