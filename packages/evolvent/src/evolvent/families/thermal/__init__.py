"""Temperatures of beams, rods and shells."""
