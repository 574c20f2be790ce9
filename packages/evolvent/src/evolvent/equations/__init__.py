"""The functions of a model that solvers call."""
