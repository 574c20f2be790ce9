"""MoorDyn: the line in no water, with a free point as its bob, from its own catenary."""

from __future__ import annotations

import importlib.metadata
import itertools
import os
import tempfile
from collections.abc import Callable
from typing import Any

import moordyn
import numpy as np


def version() -> str:
    return importlib.metadata.version("moordyn")


def text(spec: dict[str, Any], step: float) -> str:
    """The input file; water of no density, far below, and no ground."""
    rule = "-" * 20
    x, _, z = spec["end"]
    return f"""{rule} MoorDyn input {rule}
a line with a bob
{rule} LINE TYPES {rule}
Name Diam MassDenInAir EA BA/-zeta EI Cd Ca CdAx CaAx
(name) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
cord 0.001 {spec["density"]!r} {spec["EA"]!r} {spec["BA"]!r} 0 0 0 0 0
{rule} POINTS {rule}
ID Type X Y Z M V CdA CA
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Fixed 0 0 0 0 0 0 0
2 Free {x!r} 0 {z!r} {spec["bob"]!r} 0 0 0
{rule} LINES {rule}
ID LineType AttachA AttachB UnstrLen NumSegs Outputs
(#) (name) (#) (#) (m) (-) (-)
1 cord 1 2 {spec["length"]!r} {spec["segments"]} -
{rule} OPTIONS {rule}
rk4 tScheme
{step!r} dtM
{spec["gravity"]!r} gravity
0 WtrDnsty
1000 WtrDpth
0 kBot
0 cBot
0 WriteLog
1 disableOutput
{rule} OUTPUTS {rule}
{rule} end {rule}
"""


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """Substeps of the given size, one call for each sample, without its relaxation at the start."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "line.txt")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text(spec, step))
        system = moordyn.Create(path)
        moordyn.SetVerbosity(system, moordyn.LEVEL_WRN)
        moordyn.Init_NoIC(system, [], [])
    line, bob = moordyn.GetLine(system, 1), moordyn.GetPoint(system, 2)
    nodes = [moordyn.GetLineNodePos(line, i) for i in range(spec["segments"] + 1)]
    gap = float(np.abs(np.array(nodes) - spec["nodes"]).max())

    def run() -> dict[str, Any]:
        times, places, steps = spec["samples"], [], 0
        try:
            for a, b in itertools.pairwise(times):
                moordyn.Step(system, [], [], a, b - a)
                steps += round((b - a) / step)
                places.append(list(moordyn.GetPointPos(bob)))
        finally:
            moordyn.Close(system)
        return {"places": places, "steps": steps, "gap_at_start": gap}

    return run
