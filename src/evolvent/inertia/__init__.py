"""Inertia of a rigid body from how it vibrates on springs, or swings on wires."""
