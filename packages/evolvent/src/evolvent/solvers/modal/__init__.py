"""Modes, and linear models about an equilibrium."""
