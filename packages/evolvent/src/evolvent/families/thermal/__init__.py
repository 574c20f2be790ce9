"""Temperatures of beams and rods."""
