"""Equilibria, and steady rotation."""
