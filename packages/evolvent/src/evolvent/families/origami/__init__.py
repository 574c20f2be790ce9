"""Origami: sheets of facets that fold along creases, from files."""
