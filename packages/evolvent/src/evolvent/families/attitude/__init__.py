"""Wheels, thrusters and controllers of attitude."""
