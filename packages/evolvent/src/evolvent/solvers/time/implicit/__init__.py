"""Generalized-alpha and the energy-momentum method."""
