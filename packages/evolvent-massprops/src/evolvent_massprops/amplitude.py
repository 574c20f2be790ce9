"""What a swing of finite amplitude does to the frequencies of a body on springs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops import rigid_swing as kernel
from evolvent_massprops.identification import identify
from evolvent_massprops.inertia.mounted import whole
from evolvent_massprops.inertia.problem import mac, matching
from evolvent_massprops.inertia.stand import Setup
from evolvent_massprops.inertia.vibration import linearise
from evolvent_massprops.modal import Modal, sensed

#: Steps in a period of the fastest mode, and at most in all.
STEPS, MOST_STEPS = 16, 1200
#: Logarithm of the ratio of frequencies within which a mode of the record may be one of the model.
ALIKE = 0.1
#: Amplitude over the natural length below which nothing is computed: the shift is of the order of its square.
SMALL = 1e-3
#: Motion over the natural length above which a failure may be due to it.
LARGE = 0.3
#: Share of the amplitude that stands for an infinitely small one.
TINY = 1e-4


class Shift(NamedTuple):
    """What the amplitude does.

    Attributes
    ----------
    largest : m, of a spring's end, all modes together
    frequency : (m,) rad/s, measured less those of small motion; nan where the motion cannot be followed
    """

    largest: float
    frequency: np.ndarray


def shift(s: Setup, modal: Modal, used: tuple[int, ...], sensors: np.ndarray, directions: np.ndarray) -> Shift | None:
    """Change of the frequencies by the amplitude that the sensors show; None where they show no length.

    Notes
    -----
    The identified body is simulated with full geometry and the measured decay, once from the measured amplitude and
    once from a tiny one, in all modes of the record that are the body's by their frequency and shape, over the record's
    length. The modes of both simulations are identified in the same way as those of the signals, as many as move.
    """
    read = sensed(modal.reading.unit)
    if np.isnan(read.length):
        return None
    s = whole(s)
    modes = linearise(s).modes(refuse_unstable=False)
    w = np.sqrt(np.maximum(modes.eigenvalue, 0.0))
    v = modes.at(sensors, directions)
    rows = [*used, *_others(modal, used, w, v)]
    frequency = modal.frequency[rows]
    cost = np.abs(np.log(np.maximum(w, 1e-9) / frequency[:, None]))
    cost = cost + 1.0 - np.nan_to_num(mac(modal.shapes[rows][:, None], v[None]))
    pick = matching(cost)
    v, phi = v[pick], modes.shapes[:, pick]
    pole = -modal.modes.decay_rate[rows] + 1j * modal.modes.frequency[rows]
    z = np.sum(v * modal.modes.complex_amplitude[rows], axis=1) / np.maximum(np.sum(v * v, axis=1), 1e-300)
    z = read.length * z / pole**read.derivative
    reach = np.abs(z) @ np.abs(modes.at(s.points)[pick])
    spring = int(np.argmax(reach / s.length))
    if reach[spring] < SMALL * s.length[spring]:
        return Shift(float(reach[spring]), np.zeros(len(used)))
    step = 2.0 * np.pi / (STEPS * float(frequency.max()))
    step = min(step, 2.0 / float(np.nanmax(w)))
    count = int(min(MOST_STEPS, modal.reading.time[-1] / step))
    state = (phi @ z).real, (phi @ (z * pole)).real
    D = modes.model.mass @ phi @ np.diag(2.0 * modal.modes.decay_rate[rows]) @ phi.T @ modes.model.mass
    x = _motion(s, D, modes.model.pose.position, modes.model.pose.rotation, state, step, count, sensors, directions)
    found = []
    for motion in x:
        try:
            if not np.all(np.isfinite(motion)):
                raise InputError("the motion grows without bound")
            got = identify(motion, rate=1.0 / step, order=len(rows)).natural_frequency
            found.append(got[matching(np.abs(np.log(got / frequency[:, None])))])
        except (InputError, np.linalg.LinAlgError):
            return Shift(float(reach[spring]), np.full(len(used), np.nan))
    return Shift(float(reach[spring]), (found[0] - found[1])[: len(used)])


def _others(modal: Modal, used: tuple[int, ...], w: np.ndarray, v: np.ndarray) -> list[int]:
    """Modes of the record beside those that are used in which the body moves: alike in frequency and shape."""
    left = [k for k in range(modal.modes.order) if k not in used and k not in modal.hum]
    free = [int(j) for j in range(len(w)) if w[j] > 0.0]
    taken = [free[int(np.argmin(np.abs(np.log(w[free] / modal.frequency[k]))))] for k in used]
    free = [j for j in free if j not in taken]
    found = []
    for k in left:
        near = [j for j in free if abs(np.log(w[j] / modal.frequency[k])) < ALIKE and _agreement(modal, k, v[j]) > 0.8]
        if near:
            found.append(k)
            free.remove(near[0])
    return found


def _agreement(modal: Modal, k: int, shape: np.ndarray) -> float:
    return float(np.nan_to_num(mac(modal.shapes[k], shape)))


def refuse(length: np.ndarray, modal: Modal) -> None:
    """Refuse signals that move as far as the springs are long."""
    name, far = _furthest(modal)
    if far >= length.min():
        raise InputError(
            f"{name} moves by {far:.3g} m, but the springs are {length.min():.3g} m long; check units, sensitivities "
            "and how far the body swings"
        )


def large(length: np.ndarray, modal: Modal) -> str:
    """What to say of a swing too large for a linear model; else nothing."""
    name, far = _furthest(modal)
    if far < LARGE * length.min():
        return ""
    return (
        f"{name} moves by {far:.3g} m on springs of {length.min():.3g} m, too far for modes that do not depend on each "
        "other: let it swing less"
    )


def _furthest(modal: Modal) -> tuple[str, float]:
    """The sensor that moves most, and how far, m; 0 where the signals are no lengths."""
    read = sensed(modal.reading.unit)
    if np.isnan(read.length):
        return "", 0.0
    each = (read.length * modal.modes.amplitude / modal.frequency[:, None] ** read.derivative).sum(axis=0)
    return modal.reading.names[int(np.argmax(each))], float(each.max())


def _motion(
    s: Setup,
    D: np.ndarray,
    position: np.ndarray,
    rotation: np.ndarray,
    state: tuple[np.ndarray, np.ndarray],
    step: float,
    count: int,
    sensors: np.ndarray,
    directions: np.ndarray,
) -> np.ndarray:
    """(2, count, c) displacements at the sensors: at full amplitude, and at a tiny one scaled up."""
    G, c = np.zeros((6, 6)), s.centre
    G[range(3), range(3)], G[3:, 3:] = s.mass, s.inertia
    if s.added is not None:
        G = G + s.added
    base = (sensors - c) @ rotation.T
    aside = (s.points - s.ground)[:, [0, 2]]
    springs = np.column_stack((s.points - c, s.ground, aside, s.stiffness, s.length, s.lateral_stiffness)).ravel()
    p = np.empty(kernel.SIZE)
    p[kernel.STEP], p[kernel.WEIGHT], p[kernel.GUIDED] = step, s.mass * s.gravity, s.guided
    p[kernel.PLACE : kernel.START] = np.concatenate(
        [np.ravel(given) for given in (position, rotation, s.inertia, np.linalg.inv(G), D)]
    )
    found = np.empty((2, count, len(sensors)))
    for held, scale in zip(found, (1.0, TINY), strict=True):
        p[kernel.START :] = scale * np.concatenate(state)
        kernel.motion(p, springs, np.column_stack((base, directions)).ravel(), np.zeros(kernel.WORK), held)
        held /= scale
    return found
