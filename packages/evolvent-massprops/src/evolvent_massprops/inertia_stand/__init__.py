r"""Inertia stand: a large body oscillates on springs; its moments of inertia follow from the frequencies.

Axes: y up, x and z horizontal. The springs are attached at points of the body given from the stiffness centre of the
attachment plane; the centre of mass lies at (offset_x, -height, offset_z) from it. The level frame is the inertial one,
in which the unloaded stand is level; the ends of hanging springs are fixed vertically above the attachments.

Motion (Belyakov 2002, after Bogdanov): m x'' = sum F_i + m g and I eps + w x I w = sum r_i x F_i in full geometry, the
springs acting along the line between their ends. `hanging` leaves the body free in six degrees of freedom; `guided`
holds x and z of its centre of mass and its yaw, as the paper's limiters do. `standing` bodies on springs without
lateral stiffness fall over sideways, and are refused.

Identification: the displacements at the sensors are read as a sum of damped cosines
(`evolvent_massprops.identification`), and the moments of inertia follow from the frequencies
(`evolvent_massprops.inertia`).

What the paper says, with verdicts and our numbers: `evolvent claims stand`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops import batch
from evolvent_massprops.batch.definition import BatchedDefinition
from evolvent_massprops.inertia_stand import show
from evolvent_massprops.inertia_stand.case import Case
from evolvent_massprops.inertia_stand.chart import study_figures
from evolvent_massprops.inertia_stand.derived import findings
from evolvent_massprops.inertia_stand.describe import description_of
from evolvent_massprops.inertia_stand.structure import build, setup_of

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly


class InertiaStand(BatchedDefinition):
    """The system `inertia-stand`; the methods with fixed steps are those of the batch."""

    Case = Case
    seed_key = "sensors.seed"
    steps = False
    keys: ClassVar[Mapping[str, str]] = {
        "until": "sensors.duration", "every": "1 / sensors.rate", "tolerance": "solver.rtol",
        "absolute_tolerance": "solver.atol", "step": "solver.step", "method": "solver.method",
    }  # fmt: skip
    build = staticmethod(build)
    findings = staticmethod(findings)
    numbers = staticmethod(show.numbers)
    figures = staticmethod(show.figures)
    motion = staticmethod(show.motion)
    study_figures = staticmethod(study_figures)
    stand_description = staticmethod(description_of)

    def settings(self, case: Any) -> dict[str, Any]:
        """How the general engine runs the parts: by dopri5, whose tolerances the case gives; signals are even."""
        every, step = 1.0 / case.sensors.rate, case.solver.step
        found = {"until": (case.sensors.samples - 1) * every, "every": every, "fine": False, "method": "dopri5"}
        found |= {"tolerance": case.solver.rtol, "absolute_tolerance": case.solver.atol}
        return found | ({"step": step} if case.solver.method == "dopri5" and step != "auto" else {})  # refused

    def prepared_settings(self, case: Any, assembly: Assembly, laws: Mapping[str, Any]) -> dict[str, Any]:
        """As `settings`; refuses sensors too slow for the highest mode."""
        highest = float(setup_of(case).modes.natural_frequency.max())
        if np.pi * case.sensors.rate <= highest:
            raise InputError(
                f"sensors.rate is {case.sensors.rate:g} Hz; the highest mode has {highest / (2.0 * np.pi):.4g} Hz, so "
                f"it must be above {highest / np.pi:.4g} Hz"
            )
        return self.settings(case)

    def batch_case(self, case: Any, assembly: Assembly, times: np.ndarray) -> batch.BatchCase | None:
        """The case in the batch; None with dopri5."""
        solver = case.solver
        if solver.method == "dopri5":
            return None
        step = None if solver.step == "auto" else float(solver.step)
        highest = float(setup_of(case).modes.natural_frequency.max())
        return batch.plan(assembly, times, method=solver.method, frequency=highest, step=step, accuracy=solver.accuracy)


SYSTEM = InertiaStand()
