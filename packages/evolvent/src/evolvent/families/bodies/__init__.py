"""Rigid bodies, point masses and reduced bodies."""
