r"""Inertia stand: a large body swings on springs; its frequencies tell its moments of inertia.

Axes: y up, x and z horizontal. The springs are attached at points of the body given from the stiffness centre of the
attachment plane; the centre of mass lies at (offset_x, -height, offset_z) from it. The level frame is the inertial one,
in which the unloaded stand is level; the ends of hanging springs are fixed vertically above the attachments.

Motion (Belyakov 2002, after Bogdanov): m x'' = sum F_i + m g and I eps + w x I w = sum r_i x F_i in full geometry, the
springs acting along the line between their ends. `hanging` leaves the body free in six degrees of freedom; `guided`
holds x and z of its centre of mass and its yaw, as the paper's limiters do. `standing` bodies on springs without
lateral stiffness fall over sideways, and are refused.

Identification: the displacements at the sensors are read as a sum of damped cosines (`evolvent.identification`), and
the moments of inertia follow from the frequencies (`evolvent.inertia`).

Where the paper is in error, or silent:

- Its step 7 prints no gyroscopic term; here it is there. Without it frequencies shift by up to 1e-5 of their value.
- It gives the order of its scheme as between 2 and 3. It is 2: the frequency of an oscillation is lower by
  (omega dt)^2 / 48 of itself. Its printed 24.59 rad/s for the roll is the linear 24.6015 (b = 0.87 m) seen through a
  step of about 6 ms.
- Three modes are said to be identifiable while the centre of mass is within about 20 % of the spacing of the springs
  from their middle. Curves of near-zero energy cross that box: 13 % of its area lies below 1 % of the energy at its
  middle. Which corner is loaded matters; `excitation.at: best` takes the best.
- An accuracy of 0.001 % by least-squares Prony from 100 samples is not reproducible; `identification.method: prony`
  shows what it gives.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evolvent.definition import SystemDefinition
from evolvent.system import System
from evolvent.systems.inertia_stand.case import Case
from evolvent.systems.inertia_stand.chart import study_figures
from evolvent.systems.inertia_stand.prepare import prepare
from evolvent.systems.inertia_stand.show import figures, motion, numbers
from evolvent.systems.inertia_stand.simulate import plan, run_batch
from evolvent.systems.inertia_stand.structure import system_of


class InertiaStand(SystemDefinition):
    """The system `inertia-stand`."""

    Case = Case
    seed_key = "sensors.seed"
    steps = False
    study_figures = staticmethod(study_figures)
    motion = staticmethod(motion)
    figures = staticmethod(figures)
    numbers = staticmethod(numbers)
    plan = staticmethod(plan)
    run_batch = staticmethod(run_batch)

    def build(self, case: Any, *, laws: Mapping[str, Any] | None = None) -> System:
        """Body, springs and guides, released from the position that the excitation gives the body."""
        self._given(laws)
        return system_of(prepare(case))

    def settings(self, case: Any) -> dict[str, Any]:
        """How `System.simulate` runs the parts; the methods of batches are those of `evolvent.run` alone."""
        every = 1.0 / case.sensors.rate
        found = {"until": (case.sensors.samples - 1) * every, "every": every, "method": "dopri5"}
        return found | {"tolerance": case.solver.rtol, "absolute_tolerance": case.solver.atol}


SYSTEM = InertiaStand()

__all__ = ["Case", "figures", "motion", "numbers", "plan", "run_batch", "study_figures"]
