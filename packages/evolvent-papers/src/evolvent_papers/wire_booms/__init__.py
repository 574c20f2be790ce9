r"""Wire booms: a spinning spacecraft pays out four wires with spheres at their ends, pair after pair.

The spacecraft is a free body with four reels, booms 1 and 2 along +X and -X, 3 and 4 along +Y and -Y. A wire is a
thread (`evolvent_papers.heliogyro`, eqs. 1 to 17) with a sphere at its end; wound wire moves with the body. The steps
of a log follow one another after a pause. Between groups of steps thrusters spin the craft up by a smooth torque.

Straight radial wires keep the angular momentum of a group::

    H_g = W [J + sum_booms (m (R + l)^2 + rho ((R + l)^3 - R^3)/3 + rho (L - l) R^2)]

with the spin rate W, the spacecraft's moment of inertia J, the distance R of the roots from the spin axis, the length l
of a boom, the sphere's mass m, and the density rho and length L of a wire. It is eq. (18) of Tenenbaum (2014) with the
distance of the roots, which that equation leaves out. `spin_rate_straight` is this formula beside the run.

A log of spin rates gives H_g, m/J and rho/J alone: J is a number that must come from elsewhere. The built-in case holds
the log of Van Allen Probe A (comments of rbsp_efw_boom_deploy_history.pro in the repository spedas/bleeding_edge, MIT
licence, UC Regents). Its mass and moment of inertia are round numbers, not published ones.
"""

from __future__ import annotations

import pathlib
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from evolvent.analysis.definition import SystemDefinition
from evolvent.families.bodies.observer import observe_body
from evolvent.results.observe import View
from evolvent_papers.wire_booms import log, show
from evolvent_papers.wire_booms.case import Case
from evolvent_papers.wire_booms.structure import (
    build,
    deployed,
    inertia,
    lengths_at,
    pendulum_rates,
    straight_rate,
    timeline,
)

if TYPE_CHECKING:
    from evolvent.analysis.modal import ModalResults
    from evolvent.solvers.common.solution import Solution


class WireBooms(SystemDefinition):
    """The system `wire-booms`."""

    Case = Case
    keys: ClassVar = {
        "method": "solver.method", "step": "solver.step", "wire-*.": "wire.", "reel-*.drive": "groups",
        "RigidBody.": "body.",
    }  # fmt: skip
    data_files: ClassVar = {"rbsp-a.csv": str(pathlib.Path(__file__).with_name("rbsp-a.csv"))}
    reference_formulas: ClassVar = {"eq. (18), roots on the axis": {"body.root": 1e-6}}
    build = staticmethod(build)
    figures = staticmethod(show.figures)
    numbers = staticmethod(show.numbers)
    measurements = staticmethod(log.measurements)

    def settings(self, case: Any) -> dict[str, Any]:
        """How a case is run."""
        solver = case.solver
        found = {"until": timeline(case).end, "every": 0.5 * case.timing.pause, "method": solver.method}
        if solver.method != "dopri5" and solver.step is not None:
            return found | {"step": solver.step}
        return found if solver.method == "rk4" else found | {"tolerance": solver.tolerance}

    def derived(self, case: Any, solution: Solution) -> dict[str, tuple[tuple[str, ...], np.ndarray, str, str]]:
        """Spin rate of the run and of straight wires, and lengths of the booms."""
        rate = observe_body(View(solution), "spacecraft").variables["rate"].values[:, 2]
        found = closed_form(case, solution.t)
        in_plane, out_of_plane = pendulum_rates(case, found["boom_length"], rate)
        of_booms = "angular frequency of the booms of each pair as rigid pendulums from a hub at rest"
        return {
            "spin_rate": (("time",), rate, "rad s-1", "spin rate of the spacecraft"),
            "spin_rate_straight": (("time",), found["spin_rate"], "rad s-1", "spin rate with straight radial wires"),
            "boom_length": (("time", "pair"), found["boom_length"], "m", "length of the booms of each pair"),
            "pendulum_in_plane": (("time", "pair"), in_plane, "rad s-1", f"{of_booms}, in the plane of spin"),
            "pendulum_out_of_plane": (
                ("time", "pair"),
                out_of_plane,
                "rad s-1",
                f"{of_booms}, out of the plane of spin",
            ),
        }

    def modes(self, case: Any, *, count: int | None = None, mesh_error: bool = False) -> ModalResults:
        """The slowest modes of the spacecraft with the booms at their final lengths, about its steady spin."""
        system, spin = deployed(case)
        found: ModalResults = system.modes(count=count or 14, rotating=(0.0, 0.0, spin), mesh_error=mesh_error)
        return found

    def closed_form(self, case: Any, time: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        """Variables of a run by the formula of straight wires: name -> (values, units)."""
        found = closed_form(case, time)
        return {"spin_rate": (found["spin_rate"], "rad s-1"), "boom_length": (found["boom_length"], "m")}


def closed_form(case: Case, time: np.ndarray) -> dict[str, np.ndarray]:
    """Spin rate with straight wires (nt,), rad/s, and lengths of the booms of each pair (nt, 2), m."""
    return {"spin_rate": straight_rate(case, time), "boom_length": lengths_at(case, time)}


SYSTEM = WireBooms()
__all__ = ["SYSTEM", "Case", "WireBooms", "build", "closed_form", "deployed", "inertia", "pendulum_rates"]
