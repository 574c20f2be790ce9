"""Compiled functions of arrays: no classes, no input or output, no printing."""
