"""A case as a functional mock-up unit (FMI 3.0, co-simulation), which other simulators import.

The shared library of the unit is `shim.c`, compiled where the unit is written. It passes every call on to a worker
process (`evolvent_cosim.fmu.worker`), which steps the model; the host loads no Python.
"""
