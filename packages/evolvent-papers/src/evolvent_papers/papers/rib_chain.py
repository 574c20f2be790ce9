"""A second model of the winding rib: a chain of point masses by central differences, as explicit finite elements do.

It shares nothing with the elements, contacts and methods of the package: joints with lumped masses in a plane, links
that are springs, springs against the angle between links, and a penalty at joints that are inside the hub. It takes the
place of the explicit finite-element model of Yi, Yuan, Dong & Li (2017), which the paper does not describe.
"""

from __future__ import annotations

import dataclasses
import math
import time
from typing import Any

import numpy as np

Array = np.ndarray
#: Links of a chain; its joints alone touch the hub, so that a link lies up to l^2/8R inside it.
LINKS = 160
#: Time between the states whose energies are kept, s.
EVERY = 0.01
#: Speed of the tip from which on a run has diverged, of the speed of stretch waves.
DIVERGED = 100.0


@dataclasses.dataclass(frozen=True)
class Motion:
    """What a chain did.

    Attributes
    ----------
    t : (k,) float, s
    tip, speed : (k, 2) m, (k,) m/s, of its last joint
    sampled : (j,) float, s, times of the energies
    energy, work : (j,) float, J, of the motion, links, angles and contacts; that the torque has done
    step, cpu : float, s, a step, and the CPU time
    diverged : bool, whether the run ended before its time since speeds grew without limit
    """

    t: Array
    tip: Array
    speed: Array
    sampled: Array
    energy: Array
    work: Array
    step: float
    cpu: float
    diverged: bool


class Chain:
    """A rib as links between point masses, hinged to the hub.

    Parameters
    ----------
    case : of the system `wrapped-rib` with a torque as its drive; its sizes, stiffnesses and drag on the whole rib
    links : int
    dissipation : float, s/m, by which the rate of the depth raises the force of contacts, as of `hunt-crossley`
    """

    def __init__(self, case: Any, links: int = LINKS, dissipation: float = 0.0) -> None:
        strip = case.strip
        self.R, self.length, self.torque = strip.radius, strip.length / links, case.drive.torque
        self.ramp, self.drag, self.dissipation = case.drive.ramp, case.damping.alpha, dissipation
        self.axial, self.bending = strip.axial_stiffness / self.length, strip.bending_stiffness / self.length
        self.contact = case.contact_stiffness / case.contact_spacing * self.length
        self.mass = np.full(links + 1, strip.line_density * self.length)
        self.mass[[0, -1]] *= 0.5
        self.start = np.stack([self.R + self.length * np.arange(links + 1), np.zeros(links + 1)], axis=1)

    @property
    def limit(self) -> float:
        """Longest stable step, s, by Gershgorin's bound: 2/omega of a joint between two links that touches the hub."""
        return 2.0 * math.sqrt(self.mass[1] / (4.0 * self.axial + self.contact + 16.0 * self.bending / self.length**2))

    def force(self, t: float, x: Array) -> Array:
        """Forces on the joints (n + 1, 2), N, without drag and without what contacts dissipate."""
        f = self._field(t, x)
        link = x[1:] - x[:-1]
        now = np.hypot(link[:, 0], link[:, 1])
        pull = (self.axial * (1.0 - self.length / now))[:, None] * link
        # the angle of a link grows by n . (x2 - x1)/l with its normal n; the moment of a joint turns both links
        one, two = link[:-1], link[1:]
        cross, dot = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0], (one * two).sum(axis=1)
        moment = np.zeros(now.size + 1)
        moment[1:-1] = self.bending * np.arctan2(cross, dot)
        turn = ((moment[1:] - moment[:-1]) / now**2)[:, None] * np.stack([-link[:, 1], link[:, 0]], axis=1)
        f[:-1] += pull - turn
        f[1:] += turn - pull
        r = np.hypot(x[:, 0], x[:, 1])
        f += (self.contact * np.maximum(self.R - r, 0.0) / r)[:, None] * x
        return f

    def _dissipated(self, step: float, x: Array, v: Array, change: Array) -> Array:
        """What contacts dissipate of the change of rates over a step, by the mean rate, so that they gain no energy."""
        r = np.hypot(x[:, 0], x[:, 1])
        n = x / r[:, None]
        share = step * self.dissipation * self.contact * np.maximum(self.R - r, 0.0) / self.mass
        out = (n * (v + 0.5 * change)).sum(axis=1) / (1.0 + 0.5 * share)
        return (share * np.minimum(out, 1.0 / self.dissipation))[:, None] * n  # the force never pulls

    def energy(self, x: Array, v: Array) -> float:
        """Energy of motion, links, angles and contacts, J; without the mass at the hinge, which does not move."""
        link = x[1:] - x[:-1]
        angle, stretch = np.unwrap(np.arctan2(link[:, 1], link[:, 0])), np.hypot(*link.T) - self.length
        sunk = np.maximum(self.R - np.hypot(*x.T), 0.0)
        squares = self.axial * (stretch**2).sum() + self.bending * (np.diff(angle) ** 2).sum()
        squares += self.contact * (sunk**2).sum() + self.mass[1:] @ (v[1:] ** 2).sum(axis=1)
        return 0.5 * float(squares)

    def power(self, t: float, x: Array, v: Array) -> float:
        """Power of the torque, W."""
        return float((self._field(t, x) * v).sum())

    def _field(self, t: float, x: Array) -> Array:
        """The torque spread over the chain: forces per mass in proportion to z x r."""
        torque = self.torque * (min(t / self.ramp, 1.0) if self.ramp > 0.0 else 1.0)
        density = torque / float(self.mass @ (x * x).sum(axis=1))
        return density * self.mass[:, None] * np.stack([-x[:, 1], x[:, 0]], axis=1)

    def run(self, end: float, step: float) -> Motion:
        """Central differences from rest; it ends early where speeds grow without limit.

        Parameters
        ----------
        end, step : float, s
        """
        began, count = time.process_time(), max(round(end / step), 1)
        x, v = self.start.copy(), np.zeros_like(self.start)
        tips, speeds = np.empty((count + 1, 2)), np.zeros(count + 1)
        tips[0], bound, taken = x[-1], DIVERGED * math.sqrt(self.axial / self.mass[1]) * self.length, count
        keep, gain = 1.0 - 0.5 * self.drag * step, 1.0 / (1.0 + 0.5 * self.drag * step)
        per_mass = (step / self.mass)[:, None]
        per_mass[0] = 0.0  # the hinge
        kept: list[tuple[float, Array, Array]] = []
        for k in range(count):  # v holds rates in the middle of steps; the first one starts from rest
            a = per_mass * self.force(k * step, x)
            if self.dissipation > 0.0:
                a -= self._dissipated(step, x, v, a)
            new = 0.5 * a if k == 0 else gain * (keep * v + a)
            speeds[k] = math.hypot(*(0.5 * (v[-1] + new[-1]))) if k else 0.0
            if k * step >= EVERY * len(kept):
                kept.append((k * step, x, 0.5 * (v + new) if k else v))
            v = new
            x = x + step * v
            tips[k + 1] = x[-1]
            if not abs(v[-1, 0]) + abs(v[-1, 1]) < bound:
                taken = k + 1
                break
        speeds[taken] = math.hypot(*v[-1])
        cpu, some = time.process_time() - began, slice(0, taken + 1)
        sampled = np.array([t for t, _, _ in kept])
        power = np.array([self.power(*one) for one in kept])
        return Motion(
            t=step * np.arange(taken + 1), tip=tips[some], speed=speeds[some], sampled=sampled,
            energy=np.array([self.energy(x, v) for _, x, v in kept]),
            work=np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(sampled))]),
            step=step, cpu=cpu, diverged=taken < count or not np.isfinite(x).all(),
        )  # fmt: skip
