"""A case as an FMU 3.0 for co-simulation, which other simulators step.

`pythonfmu3` (MIT) packs it; its compiled wrapper starts Python where the FMU runs, and `evolvent.fmu.instance` answers
there through an `evolvent.Stepper`. The library is imported when it is used, and comes with the extra ``fmu``.
"""
