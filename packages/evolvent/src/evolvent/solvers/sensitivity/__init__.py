"""Derivatives of a run: neighbours that take its steps, and the adjoint."""
