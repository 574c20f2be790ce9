"""Loads on points, bodies and along beams; light and magnetic fields."""
