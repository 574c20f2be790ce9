"""Torque and force margins of mechanisms, from the mechanism that is simulated.

Of every hinge and slide, over its whole travel: what drives and what resists, part by part, the factors of a standard,
and the margin. Each part counts by the virtual power of its force along the direction in which the mechanism moves
there (`mechanism`). Kinetic energy never counts.
"""
