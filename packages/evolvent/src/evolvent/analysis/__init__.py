"""Analyses of a system: the method is chosen from its parts, the run becomes a tree of named results."""
