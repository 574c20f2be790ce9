"""Rods, strips and tape springs: elements with directors."""
