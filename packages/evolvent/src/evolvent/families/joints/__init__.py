"""Joints, links, gears and guides, and the coordinates that others act on."""
