"""Wrapped rib: a thin strip is wound round a rigid hub by a drive, is held there, and springs open by its own bending.

The hub is a cylinder of radius R about z, its middle at the origin. A rib of length L is hinged or clamped at
(R, 0, 0), several ribs evenly round the hub; it starts straight, pointing outwards, and winds counterclockwise in the
plane z = 0. Its flat side faces the hub. EI and EA are its bending and axial stiffness, m its mass per length.

The parts of a case (`structure`) are the body "hub", and of each rib k from 1 the beam "rib-k", its joint "root-k", its
contact with the hub "contact-k", its drive "drive-k" and, of turns that touch, "layer-k". Closed forms: `reference`.
Theory, and where the paper is in error or silent: docs/systems/wrapped-rib.md.

Source: Yi, Yuan, Dong, Li (2017), a wrapped-rib antenna's rib wound round its hub.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.definition import SystemDefinition
from evolvent_papers.wrapped_rib import derived as fields, structure
from evolvent_papers.wrapped_rib.case import Case
from evolvent_papers.wrapped_rib.chart import study_figures
from evolvent_papers.wrapped_rib.initial_state import Start, check_follows, initial_state
from evolvent_papers.wrapped_rib.keys import ALPHA, IMPLICIT
from evolvent_papers.wrapped_rib.show import estimating_string, figures, motion, numbers

if TYPE_CHECKING:
    from evolvent.analysis.system import System
    from evolvent.cases import CasePlan
    from evolvent.solvers.common.solution import Solution

#: Interval, of the time in which a string would be wound, in which the tip's largest speed is sought between samples,
#: and the times in it.
WHIP, WHIP_SAMPLES = (0.99, 1.05), 2000


class WrappedRib(SystemDefinition):
    """The system `wrapped-rib`.

    Attributes
    ----------
    begin : Start of the case, read once for each plan; None: `build` finds it
    """

    Case = Case
    start_key = "start"
    keys = {
        "until": "solver.duration", "every": "output.every", "law": "contact.law", "damping": "contact.damping",
        "stiffness_damping": "damping.beta", "rib-*.damping": "damping.kind", "RigidBody.": "hub.",
    } | {name: f"solver.{name}" for name in ("method", "step", "tolerance", "spectral_radius")}  # fmt: skip
    check_follows = staticmethod(check_follows)
    numbers = staticmethod(numbers)
    figures = staticmethod(figures)
    motion = staticmethod(motion)
    study_figures = staticmethod(study_figures)

    def __init__(self, begin: Start | None = None) -> None:
        self.begin = begin

    def plan(self, case: Any, **options: Any) -> CasePlan:
        """As of `SystemDefinition`; a saved run, from which a case starts, is read once."""
        own = copy.copy(self)
        own.begin = initial_state(case)
        return SystemDefinition.plan(own, case, **options)

    def build(self, case: Any, *, laws: Mapping[str, Any] | None = None) -> System:
        """The parts of a case."""
        return structure.build(case, self.begin or initial_state(case))

    def settings(self, case: Any) -> dict[str, Any]:
        """Arguments of `System.simulate`."""
        solver, step = case.solver, None if case.solver.step == "auto" else float(case.solver.step)
        found = {"until": case.duration, "every": case.output.every, "fine": case.output.fine}
        found |= {"method": case.method, "step": step}
        if case.method in IMPLICIT:
            radius = 0.3 if case.method == ALPHA else 1.0 / 3.0
            radius = radius if solver.spectral_radius is None else solver.spectral_radius
            found |= {"tolerance": solver.tolerance, "spectral_radius": radius}
        return found

    def between(self, case: Any) -> np.ndarray:
        """Times about the end of winding: the last piece of a rib whips onto the hub within some milliseconds."""
        string = estimating_string(case) if case.solver.step == "auto" else None
        if string is None or not math.isfinite(string.end_time):
            return np.zeros(0)
        return string.end_time * np.linspace(*WHIP, WHIP_SAMPLES)

    def derived(self, case: Any, solution: Solution) -> dict[str, tuple[tuple[str, ...], np.ndarray, str, str]]:
        """Quantities of the field."""
        return fields.derived(case, self.begin or initial_state(case), solution)

    def warning(self, case: Any, solution: Solution) -> str:
        """Warnings about the case and its run."""
        return fields.warning(case, self.begin or initial_state(case), solution)


SYSTEM = WrappedRib()
