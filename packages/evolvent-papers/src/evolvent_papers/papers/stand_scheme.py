"""The ten steps of Belyakov (2002), written down in NumPy from the text, right and with its slips as printed.

It shares no code with `evolvent_massprops.batch`, whose modified Euler it checks.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import cases
from evolvent_massprops.identification import varpro
from evolvent_massprops.inertia_stand.structure import setup_of
from evolvent_papers.papers.stand import CASE, KEYS, simulated

Array = np.ndarray
#: Step and duration, s, steps between the samples from which frequencies are found, and offsets (x, z) of the centre of
#: mass, m, at which slips are compared.
STEP, DURATION, EVERY = 6e-3, 12.24, 4
OFFSETS = ((0.0, 0.0), (0.4, 0.1), (0.4, -0.174), (0.8, 0.1))
UP = np.array([0.0, 1.0, 0.0])
GRAVITY = -9.80665 * UP


@dataclasses.dataclass(frozen=True, kw_only=True)
class Steps:
    """How the steps are read; the defaults are right.

    Attributes
    ----------
    share : float, share of a dt^2 in step 1, of uniform acceleration over half a step 1/8
    small_turn : bool, S = 1 + [phi]x in steps 2 and 9, of small angles; False: a rotation
    whole_turn : bool, S of phi_n+1 - phi_n in step 9; False: of phi_n+1 - phi_n+1/2
    vertical : bool, step 4 with forces along Y by the height alone; False: along the line between a spring's ends
    weightless : bool, step 5 without g
    kept : bool, the accelerations of the middle are kept in step 10; False: steps 3 to 7 are done again
    position_added : bool, step 3 as printed: r_i = S r_i + y; False: r_i = S r_i
    turned_back : bool, step 6 as printed: S^T I S beside r_i = S r_i; False: S I S^T
    force_first : bool, step 7 as printed: the torque is the sum of F_i x r_i; False: of r_i x F_i
    gyroscopic : bool, whether step 7 has the term w x I w, which is not in print
    euler : bool, whether S of an angle turns about x, y and z one after the other, as Euler's angles do; False: about
        the vector of the angle
    """

    share: float = 0.125
    small_turn: bool = False
    whole_turn: bool = False
    vertical: bool = False
    weightless: bool = False
    kept: bool = False
    position_added: bool = False
    turned_back: bool = False
    force_first: bool = False
    gyroscopic: bool = True
    euler: bool = False

    def rotation(self, angle: Array) -> Array:
        """(n, 3, 3) matrix S of angles (n, 3) rad."""
        if self.small_turn:
            return np.asarray(np.eye(3) + _skew(angle))
        if self.euler:
            x, y, z = (_about(angle * np.eye(3)[k]) for k in range(3))
            return x @ y @ z
        return _about(angle)


def _about(angle: Array) -> Array:
    """(n, 3, 3) rotation by vectors (n, 3) rad, by Rodrigues' formula."""
    size = np.maximum(np.linalg.norm(angle, axis=1), 1e-300)[:, None, None]
    K = _skew(angle) / size
    return np.asarray(np.eye(3) + np.sin(size) * K + (1.0 - np.cos(size)) * (K @ K))


def _skew(angle: Array) -> Array:
    """(n, 3, 3) matrices of the vector product by (n, 3)."""
    x, y, z = angle.T
    zero = np.zeros_like(x)
    return np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)


def _cross(a: Array, b: Array) -> Array:
    """Vector products of (..., 3) arrays."""
    x, y, z = (a[..., k] for k in range(3))
    p, q, s = (b[..., k] for k in range(3))
    return np.stack([y * s - z * q, z * p - x * s, x * q - y * p], axis=-1)


class Bodies:
    """Bodies that hang from the stand's springs, each with its centre of mass at another offset.

    Attributes
    ----------
    y, v, w, a, e : (n, 3) position from where the body is at rest, velocity, angular velocity, accelerations
    r : (n, 4, 3) m, levers from the centre of mass to the springs
    tensor : (n, 3, 3) kg m2, all in the fixed frame
    load : (3,) N, on spring 1's attachment; none at first
    """

    def __init__(self, offsets: tuple[tuple[float, float], ...], steps: Steps) -> None:
        self.steps = steps
        setups = [setup_of(cases.load(CASE, dict(zip(KEYS, at, strict=True)))) for at in offsets]
        stand, body = setups[0].stand, setups[0].body
        self.mass, self.stiffness, self.length = float(body.mass), float(stand.stiffness[0]), float(stand.length[0])
        self.ground = stand.ground_points
        self.rest = np.array([s.equilibrium_pose.position for s in setups])
        self.y = np.array([s.start.position for s in setups]) - self.rest
        R = np.array([s.start.rotation for s in setups])
        self.r = np.array([(s.stand.points - s.body.centre) @ s.start.rotation.T for s in setups])
        self.tensor = R @ body.inertia @ R.transpose(0, 2, 1)
        self.v, self.w = np.zeros_like(self.y), np.zeros_like(self.y)
        self.load = np.zeros(3)
        self.a, self.e = self.accelerations(self.w)

    def accelerations(self, rate: Array) -> tuple[Array, Array]:
        """Steps 4, 5 and 7: forces, acceleration and angular acceleration."""
        apart = self.rest[:, None] + self.y[:, None] + self.r - self.ground
        length = np.linalg.norm(apart, axis=2, keepdims=True)
        force = -self.stiffness * (1.0 - self.length / length) * apart
        if self.steps.vertical:
            force = -self.stiffness * (apart + self.length * UP) * UP
        force[:, 0] += self.load
        torque = _cross(self.r, force).sum(axis=1) * (-1.0 if self.steps.force_first else 1.0)
        if self.steps.gyroscopic:
            torque = torque - _cross(rate, (self.tensor @ rate[..., None])[..., 0])
        gravity = 0.0 if self.steps.weightless else GRAVITY
        return force.sum(axis=1) / self.mass + gravity, np.linalg.solve(self.tensor, torque[..., None])[..., 0]

    def turn(self, angle: Array) -> None:
        """Steps 2, 3 and 6: turn levers and tensor."""
        S = self.steps.rotation(angle)
        back = S.transpose(0, 2, 1)
        self.r = self.r @ back + (self.y[:, None] if self.steps.position_added else 0.0)
        self.tensor = back @ self.tensor @ S if self.steps.turned_back else S @ self.tensor @ back

    def advance(self, h: float) -> None:
        """One step of `h` s, steps 1 to 10."""
        y, v, w = self.y, self.v, self.w
        share = self.steps.share * h**2
        self.y = y + 0.5 * h * v + share * self.a
        half = 0.5 * h * w + share * self.e
        self.turn(half)
        a, e = self.accelerations(w + 0.5 * h * self.e)
        self.y, self.v, self.w = y + h * v + 0.5 * h**2 * a, v + h * a, w + h * e
        whole = h * w + 0.5 * h**2 * e
        self.turn(whole if self.steps.whole_turn else whole - half)
        self.a, self.e = (a, e) if self.steps.kept else self.accelerations(self.w)

    def sensors(self) -> Array:
        """(n, 4) m, heights of the attachments from where the body is at rest."""
        return np.asarray(self.y[:, None, 1] + self.r[:, :, 1])


def motion(steps: Steps, duration: float = DURATION, offsets: tuple[tuple[float, float], ...] = OFFSETS) -> Array:
    """(nt, n, 4) m, heights of the attachments over time, a sample a step of `STEP`."""
    bodies = Bodies(offsets, steps)
    found = [bodies.sensors()]
    for _ in range(round(duration / STEP)):
        bodies.advance(STEP)
        found.append(bodies.sensors())
    return np.array(found)


@functools.cache
def frequencies(steps: Steps) -> Array:
    """(n, 3) rad/s, of the three modes at the offsets."""
    heights = motion(steps)[::EVERY]
    return np.array([varpro(heights[:, k], 3, rate=1.0 / (EVERY * STEP)).frequency for k in range(len(OFFSETS))])


def _shift(steps: Steps) -> Mapping[str, float]:
    """Least and largest shift over the offsets of the frequency that a slip shifts most, ppm."""
    shifts = 1e6 * np.abs(frequencies(steps) / frequencies(Steps()) - 1.0).max(axis=1)
    return {"least": float(shifts.min()), "largest": float(shifts.max())}


def step_6() -> Mapping[str, float]:
    """Shift of the frequencies where the tensor is turned the wrong way, ppm."""
    return _shift(Steps(turned_back=True))


def step_7() -> Mapping[str, float]:
    """Largest shift of a frequency without the gyroscopic term, ppm."""
    return {"largest": _shift(Steps(gyroscopic=False))["largest"]}


def euler_angles() -> Mapping[str, float]:
    """Largest shift of a frequency where the increments of the angles turn one after the other, ppm."""
    return {"largest": _shift(Steps(euler=True))["largest"]}


def step_3() -> Mapping[str, float]:
    """Largest change of a lever's length, mm, in 0.1 s, right and with the position added to it at every half step."""
    found = {}
    for name, steps in (("right", Steps()), ("printed", Steps(position_added=True))):
        bodies = Bodies(OFFSETS[:1], steps)
        before, grown = np.linalg.norm(bodies.r, axis=2), 0.0
        for _ in range(round(0.1 / STEP)):
            bodies.advance(STEP)
            grown = max(grown, 1e3 * float(np.abs(np.linalg.norm(bodies.r, axis=2) - before).max()))
        found[name] = max(grown, 1e-6)
    return found


def torque_sign() -> Mapping[str, float]:
    """Angular velocity, deg/s, after 0.2 s: right, and with the sum of F x r for the torque."""
    found = {}
    for name, steps in (("right", Steps()), ("printed", Steps(force_first=True))):
        bodies = Bodies(OFFSETS[:1], steps)
        for _ in range(round(0.2 / STEP)):
            bodies.advance(STEP)
        found[name] = float(np.degrees(np.linalg.norm(bodies.w)))
    return found


#: Duration, s, over which readings of a step are compared with the package's motion.
SHORT = 1.2
#: Readings of the steps other than the paper's, by the names of their values.
OTHERS = {
    "without": Steps(share=0.0),
    "double": Steps(share=0.25),
    "small": Steps(small_turn=True),
    "whole": Steps(whole_turn=True),
    "vertical": Steps(vertical=True),
    "weightless": Steps(weightless=True),
    "kept": Steps(kept=True),
}


@functools.cache
def _packages() -> Array:
    """(nt, n, 4) m, heights of the attachments by the package's modified Euler, from where they start."""
    offsets: Any = np.array(OFFSETS).T
    changes = {"solver__method": "modified-euler", "solver__step": STEP, "sensors__rate": 1.0 / STEP}
    runs = simulated(*offsets, **changes)
    theirs = np.array([run.sensor_true.values for run in runs]).transpose(1, 0, 2)
    return np.asarray(theirs - theirs[:1])


def _apart(steps: Steps, duration: float = SHORT) -> float:
    """Largest distance, mm, of the heights from those of the package's modified Euler, at least 1e-6."""
    ours = motion(steps, duration)
    return max(1e3 * float(np.abs(ours - ours[:1] - _packages()[: len(ours)]).max()), 1e-6)


def _readings(*names: str) -> Mapping[str, float]:
    """Such distances of the steps as the paper has them, `right`, and of other readings."""
    return {"right": _apart(Steps())} | {name: _apart(OTHERS[name]) for name in names}


def step_1() -> Mapping[str, float]:
    """Step 1: without the acceleration, and with twice its share; largest shift of a frequency by each, ppm."""
    shifts = {f"{name}_ppm": _shift(OTHERS[name])["largest"] for name in ("without", "double")}
    return {**_readings("without", "double"), **shifts}


def steps_2_and_9() -> Mapping[str, float]:
    """Steps 2 and 9: S of small angles, and S of the whole step in 9."""
    return _readings("small", "whole")


def step_4() -> Mapping[str, float]:
    """Step 4: forces along Y alone."""
    return _readings("vertical")


def step_10() -> Mapping[str, float]:
    """Step 10: the accelerations of the middle are kept; largest shift of a frequency by it, ppm."""
    return {**_readings("kept"), "kept_ppm": _shift(OTHERS["kept"])["largest"]}


def beside_the_package() -> Mapping[str, float]:
    """Largest distance, mm, of the heights from those of the package's modified Euler, at least 1e-6."""
    return {"apart": _apart(Steps(), DURATION), "steps": float(round(DURATION / STEP))}
