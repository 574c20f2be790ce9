"""Thread: lumped masses on springs or on segments of fixed length, paid out by a reel."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from evolvent import units
from evolvent.builder import Builder
from evolvent.errors import InputError, nearest
from evolvent.kernels import rigid
from evolvent.kernels import thread as kernels
from evolvent.parts.base import Part, ReelName, unit
from evolvent.parts.drive import RampDrive
from evolvent.parts.reel import Reel

SEGMENTS = {"springs": kernels.SPRINGS, "inextensible": kernels.INEXTENSIBLE}


class Thread(Part):
    """A thread of n equal segments, its tip first off the reel.

    Parameters
    ----------
    reel : str
        Reel that holds it.
    length : float, m
        Of the whole thread.
    line_density : float, kg/m
        Mass per length.
    nodes : int
        Number n of lumped masses.
    tip_mass : float, kg
        Added to the first node.
    segments : {"springs", "inextensible"}
        Springs, or segments of fixed length.
    stiffness, damping : float, N/m and N s/m
        Of one segment (springs).
    direction : (3,) float, optional
        Of the thread already out at the start, body axes; that in which the reel lets it out if left out.
    velocity_turn : bool
        Whether a released node's velocity is turned along the thread (springs; eq. 12).
    wound_mass : {"ignored", "carried"}
        Whether wound thread acts on the body that carries it. Ignored, as in the paper, momentum appears with
        every released node; carried, momentum is kept.
    lets_go : bool
        Whether the thread leaves the spool when it is all out (separation).
    copies : int
        Number of identical threads, evenly spaced about the spin axis, that this one stands for.
    capture : float
        Fraction of a segment at which a node that is reeled in goes back onto the spool.
    width : float, m, optional
        Of a tape, along the axis of its spool: it is drawn as a strip.

    Notes
    -----
    Masses by Tenenbaum (2014), eq. 6: m_i = rho l0, the tip m_k + rho l0 / 2, l0 = length / n. The half segment at
    the root is not counted. On springs what is out at the start is not stretched yet and rings for a while. Carried
    thread is evenly wound: a thin ring of radius r about the spool's axis, that turns with the spool. What a node's
    momentum at Q differs from its share of the ring acts on the body as an impulse when the node leaves or comes back.
    """

    kind: Literal["thread"] = "thread"
    reel: ReelName
    length: units.Length
    line_density: units.LineDensity
    nodes: Annotated[int, units.Whole(least=1, most=1_000_000)] = 20
    tip_mass: units.MassOrZero = 0.0
    segments: Literal["springs", "inextensible"] = "springs"
    stiffness: units.StiffnessOrZero = 1e4
    damping: units.DampingOrZero = 0.0
    direction: units.Direction | None = None
    velocity_turn: bool = True
    wound_mass: Literal["ignored", "carried"] = "ignored"
    lets_go: bool = False
    copies: Annotated[int, units.Whole(least=1, most=1_000_000)] = 1
    capture: units.PositiveNumber = 1e-3
    width: units.Length | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the thread into the families `threads` and `nodes`."""
        reel = builder.specs.get(self.reel)
        if not isinstance(reel, Reel):
            known = [n for n, part in builder.specs.items() if isinstance(part, Reel)]
            raise InputError(f"{name}.reel is {self.reel!r}; {nearest(self.reel, known)}")
        kind, n, length, tip = SEGMENTS[self.segments], self.nodes, self.length, self.tip_mass
        if kind == kernels.SPRINGS and self.stiffness == 0.0:
            raise InputError(f"{name}.stiffness is {self.stiffness!r}; segments that are springs need one above 0 N/m")
        l0 = length / n
        body = builder.find(reel.body, "bodies")
        motion = builder.rows["bodies"][body]["motion"]
        if self.wound_mass == "carried" and builder.rows["bodies"][body].get("path"):
            raise InputError(f"{name}.wound_mass is 'carried', but {reel.body!r} is carried along a line by a drive; "
                             f"take 'ignored', or a free body")  # fmt: skip
        if self.copies > 1 and motion == rigid.FREE:
            raise InputError(f"{name}.copies is {self.copies!r}; only a spinning or driven body takes copies")
        X, Y, Z = reel.frame(self.reel)
        centre = np.array(reel.centre)
        drive = reel.drive.write(builder, f"{self.reel}.drive")
        jerks = isinstance(reel.drive, RampDrive) and any(duration == 0.0 for _, duration, _ in reel.drive.steps)
        if kind == kernels.INEXTENSIBLE and jerks:
            raise InputError(
                f"{self.reel}.drive.steps holds one of no duration, which jerks an inextensible thread; give it a "
                f"duration above 0"
            )
        angle, rate, _ = reel.drive.at(builder, drive, 0.0)
        if kind == kernels.INEXTENSIBLE and angle == 0.0 and rate == 0.0:
            raise InputError(
                f"{self.reel}.drive starts at rest with nothing out, where an inextensible thread has no direction; "
                "start with some length out (`angle` above 0), or at a rate above 0"
            )
        out = angle * reel.radius
        if out > length * (1.0 + 1e-12):
            raise InputError(
                f"{self.reel}.drive: {out:g} m are out at the start, more than {name}.length, {length:g} m"
            )
        released = min(int(np.ceil(round(out / l0, 9))), n)
        direction = X if self.direction is None else unit(self.direction)
        q, v = self._start(
            builder, body, centre + reel.radius * Z, direction, kind, n, released, out, rate * reel.radius
        )
        first = len(builder.rows["nodes"])
        for i in range(n):
            span = l0 if i > 0 else 0.5 * l0
            mass = self.line_density * span + (tip if i == 0 else 0.0)
            builder.add("nodes", mass=mass, compliance=1.0 / mass, span=span)
        index = builder.add(
            "threads",
            kind=kind,
            iq=q,
            iv=v,
            n=n,
            node=first,
            copies=self.copies,
            segment=l0,
            stiffness=self.stiffness,
            damping=self.damping,
            body=body,
            departure=centre + reel.radius * Z,
            payout_axis=X,
            chord=Y,
            normal=Z,
            radius=reel.radius,
            drive=drive.kind,
            first=drive.first,
            last=drive.last,
            law=drive.law,
            spool_q=drive.spool_q,
            spool_v=drive.spool_v,
            spool_inertia=drive.inertia,
            spool_torque=drive.torque,
            turned=int(self.velocity_turn),
            carried=int(self.wound_mass == "carried"),
            lets_go=int(self.lets_go),
            capture=self.capture,
        )
        builder.released.append(released)
        builder.names[name] = ("threads", index)

    def _start(
        self,
        builder: Builder,
        body: int,
        departure: np.ndarray,
        direction: np.ndarray,
        kind: int,
        n: int,
        released: int,
        out: float,
        speed: float,
    ) -> tuple[int, int]:
        """Coordinates of all nodes: what is out is straight and turns with the body."""
        pose, l0 = builder.poses[body], self.length / n
        e = pose.R @ direction
        d = pose.R @ departure
        q, v = np.zeros((n, 3)), np.zeros((n, 3))
        if kind == kernels.INEXTENSIBLE:
            q[:] = e
            v[:released] = np.cross(pose.w, e)
        else:
            for i in range(released):
                arm = d + (out - i * l0) * e
                q[i] = pose.x + arm
                v[i] = pose.v + np.cross(pose.w, arm) + speed * e
        return builder.coordinates(list(q.ravel()), list(v.ravel()))
