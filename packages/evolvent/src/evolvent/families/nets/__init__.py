"""Nets of cords."""
