"""Structures of evolvent in other simulators: functional mock-up units, and the module of Basilisk."""
