r"""Film blade: a strip of film that a spinning body pays out, with bending, twist and buckling in its plane.

The body turns about Z and keeps its angular momentum, H = (J + N m_k L0^2) W0. N blades alike leave at the distance L0
from the axis, their chord in the plane of the spin, as film from a roll whose axis lies there. Each is a rod of the
section `strip` (bending about both axes, twist, stiffness of the tension against twist) whose length follows a drive
(`evolvent.parts.Rod`, key `payout`). The root turns freely out of the plane; in the plane it is free or held.

Coriolis forces of the pay-out and the falling spin bend the blade edgewise. From a rate on that depends on length,
width and spin it buckles: it twists out of its plane (`evolvent.closed_forms.payout_buckling`). A run passes through
all lengths up to its last, so that the length at which it buckles at a rate is where this rate is the largest.

Light, the roll's inertia and the wrinkling of a film that nothing keeps flat are left out.
"""

from __future__ import annotations

from typing import Any, ClassVar

from evolvent.analysis.definition import SystemDefinition
from evolvent_papers.film_blade import show
from evolvent_papers.film_blade.case import BUCKLED, Case
from evolvent_papers.film_blade.derived import derived
from evolvent_papers.film_blade.structure import build


class FilmBlade(SystemDefinition):
    """The system `film-blade`."""

    Case = Case
    keys: ClassVar = {
        "until": "payout.length", "every": "output.samples", "tolerance": "solver.tolerance", "blade.": "blade.",
        "RigidBody.": "body.",
    }  # fmt: skip
    build = staticmethod(build)
    derived = staticmethod(derived)
    numbers = staticmethod(show.numbers)
    figures = staticmethod(show.figures)
    study_figures = staticmethod(show.study_figures)

    def settings(self, case: Any) -> dict[str, Any]:
        """How a case is run."""
        end = case.duration
        found = {"until": end, "every": end / case.output.samples, "method": "generalized-alpha"}
        return found if case.solver.tolerance is None else found | {"tolerance": case.solver.tolerance}


SYSTEM = FilmBlade()
__all__ = ["BUCKLED", "SYSTEM", "Case", "FilmBlade", "build", "derived"]
