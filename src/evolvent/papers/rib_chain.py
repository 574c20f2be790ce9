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
#: Speed of the tip from which on a run has diverged, of the speed of stretch waves.
DIVERGED = 100.0


@dataclasses.dataclass(frozen=True)
class Motion:
    """What a chain did.

    Attributes
    ----------
    t : (k,) float, s
    tip, speed : (k, 2) m, (k,) m/s, of its last joint
    step, cpu : float, s, a step, and the CPU time
    diverged : bool, whether the run ended before its time since speeds grew without limit
    """

    t: Array
    tip: Array
    speed: Array
    step: float
    cpu: float
    diverged: bool


class Chain:
    """A rib as links between point masses, hinged to the hub.

    Parameters
    ----------
    case : of the system `wrapped-rib` with a torque as its drive; its sizes, stiffnesses and drag on the whole rib
    links : int
    """

    def __init__(self, case: Any, links: int = LINKS) -> None:
        strip = case.strip
        self.R, self.length, self.torque = strip.radius, strip.length / links, case.drive.torque
        self.ramp, self.drag = case.drive.ramp, case.damping.alpha
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
        """Forces on the joints (n + 1, 2), N, without drag."""
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
        for k in range(count):  # v holds rates in the middle of steps; the first one starts from rest
            a = per_mass * self.force(k * step, x)
            new = 0.5 * a if k == 0 else gain * (keep * v + a)
            speeds[k] = math.hypot(*(0.5 * (v[-1] + new[-1]))) if k else 0.0
            v = new
            x = x + step * v
            tips[k + 1] = x[-1]
            if not abs(v[-1, 0]) + abs(v[-1, 1]) < bound:
                taken = k + 1
                break
        speeds[taken] = math.hypot(*v[-1])
        kept = slice(0, taken + 1)
        return Motion(
            t=step * np.arange(taken + 1), tip=tips[kept], speed=speeds[kept], step=step,
            cpu=time.process_time() - began, diverged=taken < count or not np.isfinite(x).all(),
        )  # fmt: skip
