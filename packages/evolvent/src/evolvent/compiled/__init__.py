"""Compilation: decorators, cache of machine code, structures by pointer, users' laws."""
