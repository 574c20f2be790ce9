"""Shells: four-node elements between bodies."""
