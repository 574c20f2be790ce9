"""What a swing of finite amplitude does to the frequencies of a body on springs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.identification import identify
from evolvent_massprops.inertia.mounted import turned, whole
from evolvent_massprops.inertia.problem import mac, matching
from evolvent_massprops.inertia.stand import Setup
from evolvent_massprops.inertia.statics import Z, cross, guides, rotation_matrix, spring_state
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
    """(2, count, c) displacements at the sensors: at full amplitude, and at a tiny one scaled up; RK4."""
    scale = np.array([1.0, TINY])
    q, v = scale[:, None] * state[0], scale[:, None] * state[1]
    load = np.array([0.0, -float(s.mass) * float(s.gravity), 0.0])
    c = 3 if s.guided else 0
    empty = np.zeros((2, 6 + c, 6 + c))
    empty[:, range(3), range(3)] = s.mass

    def rate(q: np.ndarray, v: np.ndarray, turn: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        R = (rotation_matrix(q[:, 3:]) if turn is None else turn) @ rotation
        r, _, _, f = spring_state(s, position + q[:, :3], R)
        w = v[:, 3:]
        inertia = R @ s.inertia @ np.swapaxes(R, -1, -2)
        F = np.concatenate([f.sum(axis=-2) + load, cross(r, f).sum(axis=-2)], axis=-1) - v @ D
        F[:, 3:] -= cross(w, np.einsum("nij,nj->ni", inertia, w))
        A, b = empty.copy(), np.zeros((2, 6 + c))
        A[:, 3:6, 3:6], b[:, :6] = inertia, F
        if s.added is not None:
            A[:, :6, :6] += turned(s.added, R)
        if c:
            C, e = guides(s, R), R[..., :, 0]
            A[:, :6, 6:], A[:, 6:, :6] = -np.swapaxes(C, -1, -2), C
            b[:, 8] = -np.sum(cross(cross(w, e), Z) * w, axis=-1)
        return np.concatenate([v[:, :3], _turn_rate(q[:, 3:], w)], axis=-1), np.linalg.solve(A, b[..., None])[:, :6, 0]

    held = np.empty((count, 2, len(sensors)))
    base = np.einsum("ij,cj->ci", rotation, sensors - s.centre)
    for k in range(count):
        turn = rotation_matrix(q[:, 3:])
        arms = np.einsum("nij,cj->nci", turn, base)
        held[k] = np.sum((q[:, None, :3] + arms - base) * directions, axis=-1)
        q1, v1 = rate(q, v, turn)
        q2, v2 = rate(q + 0.5 * step * q1, v + 0.5 * step * v1)
        q3, v3 = rate(q + 0.5 * step * q2, v + 0.5 * step * v2)
        q4, v4 = rate(q + step * q3, v + step * v3)
        q = q + step / 6.0 * (q1 + 2.0 * q2 + 2.0 * q3 + q4)
        v = v + step / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
        if not np.all(np.abs(q) < 1e3):
            return np.full((2, count, len(sensors)), np.nan)
    return np.swapaxes(held, 0, 1) / scale[:, None, None]


def _turn_rate(theta: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Rate of a rotation vector whose body turns with w, level axes, to the second order.

    Notes
    -----
    theta' = w - theta x w / 2 + theta x (theta x w) / 12 + ... (Bortz 1971, for a rate in level axes).
    """
    first = cross(theta, w)
    return w - 0.5 * first + cross(theta, first) / 12.0
