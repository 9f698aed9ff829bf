"""Models whose blocks have moved: pushover curves, and settlements that are not small."""
