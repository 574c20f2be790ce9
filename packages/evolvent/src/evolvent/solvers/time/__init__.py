"""Time integration: runs by explicit and implicit methods."""
