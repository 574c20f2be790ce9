"""Thread: lumped masses on springs or on segments of fixed length, paid out by a reel."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError, nearest
from evolvent.kernels import rigid
from evolvent.kernels import thread as kernels
from evolvent.parts.checks import choice, not_negative, number, positive, unit_vector, vector
from evolvent.parts.drive import RampDrive
from evolvent.parts.reel import Reel

SEGMENTS = {"springs": kernels.SPRINGS, "inextensible": kernels.INEXTENSIBLE}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Thread:
    """A thread of n equal segments, its tip first off the reel.

    Parameters
    ----------
    reel : str, name of the reel that holds it
    length : float, m
    line_density : float, kg/m
    nodes : int, number n of lumped masses
    tip_mass : float, kg, added to the first node
    segments : {"springs", "inextensible"}
    stiffness, damping : float, N/m and N s/m of one segment (springs)
    direction : (3,) float, of the thread already out at the start, body axes; the feed's direction if left out
    velocity_turn : bool, whether a released node's velocity is turned along the thread (springs; eq. 12)
    wound_mass : {"ignored", "carried"}
        Whether wound thread acts on the body that carries it. Ignored, as in the paper, momentum appears with
        every released node; carried, momentum is kept.
    lets_go : bool, whether the thread leaves the spool when it is all out (separation)
    copies : int, number of identical threads, evenly spaced about the spin axis, that this one stands for
    capture : float, fraction of a segment at which a node that is reeled in goes back onto the spool

    Notes
    -----
    Masses by Tenenbaum (2014), eq. 6: m_i = rho l0, the tip m_k + rho l0 / 2, l0 = length / n. The half segment at
    the root is not counted. On springs what is out at the start is not stretched yet and rings for a while. Carried
    thread is evenly wound: a thin ring of radius r about the spool's axis, that turns with the spool. What a node's
    momentum at Q differs from its share of the ring acts on the body as an impulse when the node leaves or comes back.
    """

    reel: str
    length: float
    line_density: float
    nodes: int = 20
    tip_mass: float = 0.0
    segments: str = "springs"
    stiffness: float = 1e4
    damping: float = 0.0
    direction: Sequence[float] | None = None
    velocity_turn: bool = True
    wound_mass: str = "ignored"
    lets_go: bool = False
    copies: int = 1
    capture: float = 1e-3

    def write(self, builder: Builder, name: str) -> None:
        """Write the thread into the families `threads` and `nodes`."""
        reel = builder.specs.get(self.reel)
        if not isinstance(reel, Reel):
            known = [n for n, part in builder.specs.items() if isinstance(part, Reel)]
            raise InputError(f"{name}.reel is {self.reel!r}; {nearest(self.reel, known)}")
        kind = choice(f"{name}.segments", self.segments, SEGMENTS)
        carried = choice(f"{name}.wound_mass", self.wound_mass, {"ignored": 0, "carried": 1})
        allowed = "a whole number, 1 or above"
        n = int(number(f"{name}.nodes", self.nodes, least=1.0, allowed=allowed))
        if isinstance(self.nodes, bool) or n != self.nodes:
            raise InputError(f"{name}.nodes is {self.nodes!r}; it must be {allowed}")
        length = positive(f"{name}.length", self.length)
        density = positive(f"{name}.line_density", self.line_density)
        tip = not_negative(f"{name}.tip_mass", self.tip_mass)
        stiffness = not_negative(f"{name}.stiffness", self.stiffness)
        if kind == kernels.SPRINGS:
            positive(f"{name}.stiffness", self.stiffness)
        l0 = length / n
        body = builder.find(reel.body, "bodies")
        motion = builder.rows["bodies"][body]["motion"]
        if self.copies < 1 or (self.copies > 1 and motion == rigid.FREE):
            raise InputError(f"{name}.copies is {self.copies!r}; only a spinning or driven body takes copies")
        X, Y, Z = reel.frame(self.reel)
        centre = vector(f"{self.reel}.centre", reel.centre)
        feed = reel.feed.write(builder, self.reel)
        jerks = isinstance(reel.feed, RampDrive) and any(duration == 0.0 for _, duration, _ in reel.feed.steps)
        if kind == kernels.INEXTENSIBLE and jerks:
            raise InputError(
                f"{self.reel}.feed: a step of no duration jerks an inextensible thread; give it a duration above 0"
            )
        angle, rate, _ = reel.feed.at(builder, feed, 0.0)
        if kind == kernels.INEXTENSIBLE and angle == 0.0 and rate == 0.0:
            raise InputError(
                f"{self.reel}.feed starts at rest with nothing out, where an inextensible thread has no direction; "
                "start with some length out (an angle above 0), or at a rate above 0"
            )
        out = angle * reel.radius
        if out > length * (1.0 + 1e-12):
            raise InputError(f"{name}: {out:g} m are out at the start, more than its length {length:g} m")
        released = min(int(np.ceil(round(out / l0, 9))), n)
        direction = X if self.direction is None else unit_vector(f"{name}.direction", self.direction)
        q, v = self._start(
            builder, body, centre + reel.radius * Z, direction, kind, n, released, out, rate * reel.radius
        )
        first = len(builder.rows["nodes"])
        for i in range(n):
            span = l0 if i > 0 else 0.5 * l0
            mass = density * span + (tip if i == 0 else 0.0)
            builder.add("nodes", mass=mass, compliance=1.0 / mass, span=span)
        index = builder.add(
            "threads",
            kind=kind,
            iq=q,
            iv=v,
            n=n,
            node=first,
            copies=int(self.copies),
            segment=l0,
            stiffness=stiffness,
            damping=not_negative(f"{name}.damping", self.damping),
            body=body,
            departure=centre + reel.radius * Z,
            feed_axis=X,
            chord=Y,
            normal=Z,
            radius=positive(f"{self.reel}.radius", reel.radius),
            feed=feed.kind,
            first=feed.first,
            last=feed.last,
            law=feed.law,
            spool_q=feed.spool_q,
            spool_v=feed.spool_v,
            spool_inertia=feed.inertia,
            spool_torque=feed.torque,
            turned=int(self.velocity_turn),
            carried=carried,
            lets_go=int(self.lets_go),
            capture=positive(f"{name}.capture", self.capture),
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
