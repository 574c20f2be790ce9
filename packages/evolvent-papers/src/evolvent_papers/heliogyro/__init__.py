r"""Heliogyro: thin blades, taken as threads, pay out from spools on a spinning body.

A thread of length L is wound on a spool of radius r that turns by a given law phi(t), on a body that spins about Z at
the rate W. The spool's axis is Y, at the distance L0 from the spin axis; X points outwards, the nominal pay-out
direction; the thread leaves at Q = (0, 0, r). The thread is n equal segments of length l0 = L / n with lumped masses;
node 1 is the tip and leaves first. v = r phi', dphi = l0 / r, e_ab the unit vector from a to b, c and d a segment's
stiffness and damping.

Equations (Tenenbaum 2014, numbered as there; spool frame, which turns with the body)::

    (1)   node i is released when phi reaches dphi (i - 1)
    (2)   on the spool, phi_i = phi - dphi (i - 1):
          x'' = -r (phi'^2 sin phi_i - phi'' cos phi_i), y'' = 0, z'' = -r (phi'^2 cos phi_i + phi'' sin phi_i)
    (3)   spring force on a free node: c (|X_k - X_i| - l0) e_ik, k = i - 1 and i + 1
    (4)   damping force: d ((V_k - V_i) . e_ik) e_ik; node 1 has no node 0
    (5)   m_i X_i'' is the sum of the forces on node i
    (6)   m_i = rho l0; the tip m_1 = m_k + rho l0 / 2
    (7,8) boundary node (the last one released): as (3, 4) with Q in the place of node i + 1,
    (9)   V_Q = (r phi', 0, 0)
    (10)  and the rest length l00 = r (phi - dphi (i - 1))
    (11)  where |Q - X_i| is below 1e-10, e = (-1, 0, 0)
    (12)  at its release a node's velocity is turned along the thread: V_i = |V_i| e_(i,i-1)  (blade.rotate_velocity)
    (13)  equations of all nodes: (2) wound, (3, 4) free, (7, 8) boundary; loads f(x, v, t) per length act as F_i in (5)
    (14)  inertial forces of the rotating frame on every released node:
          F_x = m (W' y + W^2 (x + L0) + 2 W y'), F_y = m (-W' (x + L0) + W^2 y - 2 W x')
    (15)  torque of two blades on the body: M = -2 L0 F_y
    (16)  J W' = M
    (17)  at the start the nodes lie on the spool at x = r sin(-dphi (i - 1)), z = r cos(-dphi (i - 1))
    (18)  W = J W0 / (J + 2 rho l^3 / 3 + 2 m_k l^2), l the deployed length
    (19)  lag angle of node i: acos(x / sqrt(x^2 + y^2 + (z - r)^2))

Where the paper is in error, or silent:

- (15) as printed takes the whole boundary force (7, 8) for F_y; that destroys the balance of angular momentum (the body
  would end at 5 rad/s). Only the terms that pull at Q act on the body, and so it is done here.
- (8) with (9) counts the length paid out as much as the segment lies along x, so that its damper pulls a segment that
  lags by an angle a, but does not stretch, with d v (1 - cos a). Here it takes the rate of the elongation of (7).
- (18) leaves out L0. `body_rate_corrected` puts it right: W = I(start) W0 / I with
  I = J + N [rho ((L0 + l)^3 - L0^3) / 3 + m_k (L0 + l)^2], N the number of blades. Both take the blade as straight and
  radial.
- Wound thread does not act on the body (blade.wound_mass: ignored), so every node appears at its release with momentum
  that had not been counted: 0.15 % in all. `angular_momentum_jumps` books it. With `carried` the wound thread's mass
  turns (and, on a free body, moves) with the body, I has the term N rho (L - l) L0^2 more, and momentum is kept.
- (14) is used in inertial axes here, which is the same in exact arithmetic and needs no W' at the nodes.
- A stiffness of 1e7 N/m may be a slip of units: the film itself has about 2e3 N/m at n = 20. It hardly matters: the lag
  differs from that of links of fixed length by 0.0015 deg at 1e4 N/m, the default, and by 2e-6 deg at 1e7 N/m.

`segments: inextensible` is the limit of infinite stiffness: links of fixed length, whose tensions follow from one
tridiagonal solve at every stage; implicit methods have a constraint a link. In
steady pay-out the hub's lag is sin(delta) = 2 v / (L0 W), whatever the masses.

Source: Tenenbaum (2014), deployment of the heliogyro sail BMSTU-Sail.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evolvent.analysis.definition import SystemDefinition
from evolvent.assembly.assembled import Assembly
from evolvent.families.threads.family_lengths import all_deployed
from evolvent_base.errors import InputError
from evolvent_papers.heliogyro import derived as fields, feedback, show
from evolvent_papers.heliogyro.case import Case
from evolvent_papers.heliogyro.chart import study_figures
from evolvent_papers.heliogyro.structure import build

#: Options of generalized-alpha: step where none is given (s), tolerance and spectral radius.
IMPLICIT = {"step": 2.5e-3, "tolerance": 1e-4, "spectral_radius": 0.3}


class Heliogyro(SystemDefinition):
    """The system `heliogyro`.

    Notes
    -----
    Laws in Python, under ``@evolvent.law``: "drive" of every spool, in place of rate and table; "force", force per
    length on every blade, N/m, inertial axes; "event", which ends the run where it rises through zero.
    """

    Case = Case
    laws = ("event", "drive", "force")
    keys = {
        "until": "solver.duration", "every": "output.every", "tolerance": "solver.rtol",
        "absolute_tolerance": "solver.atol", "drive": "spool.rate", "angle": "spool.start_length",
        "stiffness": "blade.stiffness", "length": "blade.length", "separates": "blade.separates",
        **{f"reel-*.drive.{key}": f"spool.feedback.{key}" for key in ("law", "constants", "sensor", "limits", "rate")},
        "reel-*.drive.inertia": "spool.free.inertia", "reel-*.drive.steps": "spool.changes", "reel-*.drive": "spool",
        "reel-*.radius": "spool.radius", "blade-*.thickness": "spool.film_thickness", "blade-*.": "blade.",
        "spin-up.": "spin_up.", "RigidBody.": "body.",
    } | {name: f"solver.{name}" for name in ("method", "step", "rtol", "atol")}  # fmt: skip
    build = staticmethod(build)
    findings = staticmethod(fields.findings)
    numbers = staticmethod(show.numbers)
    figures = staticmethod(show.figures)
    motion = staticmethod(show.motion)
    study_figures = staticmethod(study_figures)

    def modes(self, case: Any, *, count: int | None = None, mesh_error: bool = False) -> Any:
        """As of all systems; of spools that react, modes of the closed loop at several lengths."""
        if case.spool.feedback is None:
            return super().modes(case, count=count, mesh_error=mesh_error)
        if mesh_error:
            raise InputError(
                "mesh errors are not found of modes of a closed loop; compare them with blade.nodes doubled"
            )
        return feedback.modes(case, count)

    def settings(self, case: Any) -> dict[str, Any]:
        """How a case is run."""
        return self.prepared_settings(case, build(case).assemble(), {})

    def prepared_settings(self, case: Any, assembly: Assembly, laws: Mapping[str, Any]) -> dict[str, Any]:
        """As `settings`, of parts that are assembled; the end of a run follows from the drives."""
        solver, end = case.solver, case.solver.duration
        if end == "auto":
            end = None if "drive" in laws or case.spool.feedback is not None else all_deployed(assembly.model)
        if end is None:
            which = "no blade is ever all out after the start"
            if "drive" in laws or case.spool.free is not None:
                which = "a law in Python drives the spools" if "drive" in laws else "the spools turn freely"
            elif case.spool.feedback is not None:
                which = "the spools react to what is measured"
            raise InputError(f"solver.duration is auto, but {which}; give it, such as '60 s'")
        found = {"until": end, "every": case.output.every, "fine": case.output.fine, "method": solver.method}
        step = {} if solver.step == "auto" else {"step": solver.step}
        if solver.method == "dopri5":
            return found | step | {"tolerance": solver.rtol, "absolute_tolerance": solver.atol}
        return found | (IMPLICIT if solver.method == "generalized-alpha" else {}) | step


SYSTEM = Heliogyro()
