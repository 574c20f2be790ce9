"""Beams and cables: elements by absolute nodal coordinates."""
