"""Thread models beside the one that the package solves: the paper's own scheme, what it rejects, and Sazonov's model.

The blades of the heliogyro as Tenenbaum (2014) writes them: nodes in the frame that turns with the body, forces of
inertia by eq. (14), RK4 with a fixed step, a spool that turns at a constant rate. Nothing of the package's solvers is
used. Without spin (``rate=0``) no forces but those of the segments act: figures III.3 and III.4. How the thread begins
at the spool is one of four models:

- ``departure``: the paper's. The node that was released last is pulled towards the departure point Q, eqs. (7) to (10).
- ``spool node``: rejected by the paper. Eqs. (3, 4) hold for that node too: its inner neighbour is the next node, which
  lies on the spool and moves by eq. (2).
- ``scaled``: the paper's, but the segment at Q has the stiffness and damping of its length l00: c l0/l00 and d l0/l00,
  with l00 of at least 0.2 l0. The paper keeps c and d, and leaves open what that does along the thread.
- ``growing``: after what the paper says of Sazonov's (a new node is added when some length is out, and velocities of
  nodes are corrected), in the form that is usual for cables of changing length. The element at Q grows with the
  pay-out, its stiffness is c l0/s at the length s. At 1.5 l0 it is split: a new node appears on it 0.5 l0 from Q, with
  the interpolated velocity. A node has half the mass of each adjacent element. What it gains as the last element grows
  has the node's own velocity (m a = F), or that of the thread at Q, which brings in less momentum (``influx``). As in
  the paper, the half at Q does not act on the body.
"""

from __future__ import annotations

import dataclasses
import math
import time
from typing import Literal

import numpy as np
from numba import njit

Array = np.ndarray
Start = Literal["departure", "spool node", "scaled", "growing"]
_DEPARTURE, _SPOOL_NODE, _SCALED, _GROWING = range(4)
_KINDS: dict[Start, int] = {
    "departure": _DEPARTURE, "spool node": _SPOOL_NODE, "scaled": _SCALED, "growing": _GROWING,
}  # fmt: skip
#: Share of the stability limit that a step takes where it is not given.
SHARE = 0.8
#: Largest product of a step of RK4 and a decay rate that is stable.
_REAL = 2.785
#: Distance below which the direction of the thread at Q is that of the pay-out, eq. (11), m.
TINY = 1e-10
#: Least length of an element at Q, of l0, that its stiffness is computed of.
_LEAST = 0.2


@dataclasses.dataclass(frozen=True, kw_only=True)
class Data:
    """The paper's data.

    Attributes
    ----------
    inertia : float, J, kg m2; rate : float, W0, rad/s; offset : float, L0, m; radius : float, r, m
    spool_rate : float, rad/s; line_density : float, kg/m; length : float, m; tip_mass : float, kg
    nodes : int, n; stiffness, damping : float, of one segment, N/m and N s/m
    """

    inertia: float = 0.004
    rate: float = 6.0
    offset: float = 0.05
    radius: float = 0.01
    spool_rate: float = 3.5
    line_density: float = 0.000735
    length: float = 5.0
    tip_mass: float = 0.0005
    nodes: int = 20
    stiffness: float = 1e4
    damping: float = 1e-3

    @property
    def segment(self) -> float:
        """Length of a segment, l0, m."""
        return self.length / self.nodes

    @property
    def speed(self) -> float:
        """Speed of the pay-out, m/s."""
        return self.radius * self.spool_rate

    @property
    def nodes_a_turn(self) -> float:
        """Nodes on one turn of the spool."""
        return 2.0 * math.pi * self.radius / self.segment

    def stable_step(self, start: Start) -> float:
        """Largest stable step of RK4, s, by the largest stiffness and damping of a node over its mass (Gershgorin)."""
        share = (8.0 if start in ("growing", "scaled") else 4.0) / (self.line_density * self.segment)
        square, half = share * self.stiffness, 0.5 * share * self.damping
        decay = half + math.sqrt(max(half * half - square, 0.0))
        return min(math.sqrt(8.0 / square), _REAL / decay if half * half > square else math.inf)


@dataclasses.dataclass(frozen=True)
class Deployment:
    """A run.

    Attributes
    ----------
    t : (nt,) float, s
    rate : (nt,) float, of the body, rad/s
    lag : (nt,) float, of the tip by eq. (19), with the sign of -y, degrees
    momentum : (nt,) float, angular momentum of body and released nodes about Z, kg m2/s
    off_plane : float, largest distance of a released node from the plane z = r in which the thread leaves, m
    positions : (nt, k, 3) float, of the nodes in the frame of the spool, m; NaN of those on the spool
    pull : (nt, 2) float, least and largest tension at the spool since the last sample, N
    steps : int
    cpu : float, s
    """

    t: Array
    rate: Array
    lag: Array
    momentum: Array
    off_plane: float
    positions: Array
    pull: Array
    steps: int
    cpu: float

    def mean_lag(self, begin: float, end: float) -> float:
        """Mean lag of the tip between two times, degrees."""
        inside = (self.t >= begin) & (self.t <= end)
        return float(self.lag[inside].mean())


@njit(cache=True, error_model="numpy")
def _pull(x, v, a, b, rest, c, d, tiny, force):  # type: ignore[no-untyped-def]
    """Force on node a from node b through a spring and a damper, eqs. (3, 4); returns its size, tension above zero."""
    ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    distance = math.sqrt(ex * ex + ey * ey + ez * ez)
    if distance < tiny:
        ex, ey, ez = -1.0, 0.0, 0.0
    else:
        ex, ey, ez = ex / distance, ey / distance, ez / distance
    closing = (v[b, 0] - v[a, 0]) * ex + (v[b, 1] - v[a, 1]) * ey + (v[b, 2] - v[a, 2]) * ez
    f = c * (distance - rest) + d * closing
    force[0], force[1], force[2] = f * ex, f * ey, f * ez
    return f


@njit(cache=True, error_model="numpy")
def _slopes(phi, x, v, W, k, data, kind, printed, a, force):  # type: ignore[no-untyped-def]
    """Accelerations of k released nodes into a; W' and the tension at the spool.

    Row k of x and v becomes the last node's inner neighbour.
    """
    J, L0, r, spool, rho, tip, l0, c, d, brought, tiny = data
    speed, last = r * spool, k - 1
    a[:k] = 0.0
    for i in range(last):
        _pull(x, v, i, i + 1, l0, c, d, tiny, force)
        for q in range(3):
            a[i, q] += force[q]
            a[i + 1, q] -= force[q]
    rest, stiffness, damping = r * phi - l0 * last, c, d
    x[k, 0], x[k, 1], x[k, 2], v[k, 0], v[k, 1], v[k, 2] = 0.0, 0.0, r, speed, 0.0, 0.0
    if kind == _SPOOL_NODE:
        at, rest = phi - l0 / r * k, l0
        x[k, 0], x[k, 2] = r * math.sin(at), r * math.cos(at)
        v[k, 0], v[k, 2] = speed * math.cos(at), -speed * math.sin(at)
    elif kind != _DEPARTURE:
        share = l0 / max(rest, _LEAST * l0)
        stiffness, damping = c * share, d * share
    tension = _pull(x, v, last, k, rest, stiffness, damping, tiny, force)
    for q in range(3):
        a[last, q] += force[q]
    rate = -2.0 * L0 * (a[last, 1] if printed else force[1]) / J
    for i in range(k):
        m = rho * l0 if i > 0 else tip + 0.5 * rho * l0
        if kind == _GROWING and i == last:
            m = rho * 0.5 * (l0 + rest) if i > 0 else tip + 0.5 * rho * rest
            a[i, 0] += brought * (v[k, 0] - v[i, 0] - W * (x[k, 1] - x[i, 1]))
            a[i, 1] += brought * (v[k, 1] - v[i, 1] + W * (x[k, 0] - x[i, 0]))
            a[i, 2] += brought * (v[k, 2] - v[i, 2])
        arm = x[i, 0] + L0
        a[i, 0] = a[i, 0] / m + rate * x[i, 1] + W * W * arm + 2.0 * W * v[i, 1]
        a[i, 1] = a[i, 1] / m - rate * arm + W * W * x[i, 1] - 2.0 * W * v[i, 0]
        a[i, 2] /= m
    return rate, tension


@njit(cache=True, error_model="numpy")
def _steps(phi, x, v, W, k, data, kind, printed, dt, count):  # type: ignore[no-untyped-def]
    """So many steps of RK4; returns W, the largest distance from the plane z = r, least and largest tension at Q."""
    size, r, spool, far, least, most = x.shape[0], data[2], data[3], 0.0, np.inf, -np.inf
    x0, v0, xs, vs = np.empty((size, 3)), np.empty((size, 3)), np.empty((size, 3)), np.empty((size, 3))
    a, force = np.empty((size, 3)), np.empty(3)
    weights, shares = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0), (0.0, 0.5, 0.5, 1.0)
    for step in range(count):
        x0[:k], v0[:k] = x[:k], v[:k]
        xs[:k], vs[:k] = x[:k], v[:k]
        W0, Ws, begin = W, W, phi + spool * dt * step
        for stage in range(4):
            at = begin + spool * dt * shares[stage]
            rate, tension = _slopes(at, xs, vs, Ws, k, data, kind, printed, a, force)
            if stage == 0:
                least, most = min(least, tension), max(most, tension)
            weight, ahead = dt * weights[stage], dt * (shares[stage + 1] if stage < 3 else 0.0)
            W += weight * rate
            Ws = W0 + ahead * rate
            for i in range(k):
                for q in range(3):
                    x[i, q] += weight * vs[i, q]
                    v[i, q] += weight * a[i, q]
                    xs[i, q] = x0[i, q] + ahead * vs[i, q]
                    vs[i, q] = v0[i, q] + ahead * a[i, q]
        for i in range(k):
            far = max(far, abs(x[i, 2] - r))
    return W, far, least, most


def _release(x: Array, v: Array, k: int, data: Data, start: Start, turn: bool) -> None:
    """Give node k - 1 the position and velocity with which it is released."""
    Q, leaving = np.array([0.0, 0.0, data.radius]), np.array([data.speed, 0.0, 0.0])
    if start == "growing" and k > 1:
        x[k - 1], v[k - 1] = (2.0 * Q + x[k - 2]) / 3.0, (2.0 * leaving + v[k - 2]) / 3.0
        return
    x[k - 1], v[k - 1] = Q, leaving
    if turn and k > 1:  # eq. (12)
        along = x[k - 2] - Q
        v[k - 1] = data.speed * along / np.linalg.norm(along)


def deploy(
    data: Data,
    start: Start = "departure",
    *,
    printed: bool = False,
    turn: bool = True,
    influx: bool = False,
    held: bool = False,
    until: float | None = None,
    step: float | None = None,
    samples: int = 20,
    kick: tuple[float, float, float] = (0.0, 0.0, 0.0),
    tiny: float = TINY,
) -> Deployment:
    """Pay a blade out.

    Parameters
    ----------
    data : Data
    start : how the thread begins at the spool, see the module
    printed : bool, the torque of eq. (15) as printed: of all forces on the boundary node
    turn : bool, whether eq. (12) turns the velocity of a released node along the thread
    influx : bool, whether mass joins the last node of the growing model with the velocity of the thread at Q
    held : bool, whether node n stays on the spool
    until : float, s; None for the whole blade. Rounded up to a whole segment.
    step : float, s; None for a share of the stability limit. Made smaller so that a release ends a step.
    samples : int, even, of every segment that is paid out
    kick : (3,) float, m/s, that is added to the velocity of node 1 at the start
    tiny : float, m, distance below which eq. (11) holds

    Notes
    -----
    A run that becomes unstable ends with its last finite sample.
    """
    interval = data.segment / data.speed
    count = data.nodes if until is None else min(data.nodes, math.ceil(until / interval - 1e-9))
    longest = SHARE * data.stable_step(start) if step is None else step
    per_sample = max(math.ceil(interval / longest / samples), 1)
    dt = interval / (per_sample * samples)
    packed = (
        data.inertia, data.offset, data.radius, data.spool_rate, data.line_density, data.tip_mass, data.segment,
        data.stiffness, data.damping, 0.5 * data.line_density * data.speed if influx else 0.0, tiny,
    )  # fmt: skip
    x, v, W, off_plane = np.zeros((count + 1, 3)), np.zeros((count + 1, 3)), data.rate, 0.0
    found, began, done, k = [], time.process_time(), 0, 0
    positions, pull = [], []
    for half in range(2 * count):  # halves of segments: a growing element is split at 1.5 l0
        if half == 0 or (half > 1 and half % 2 == (start == "growing") and not (held and k == data.nodes - 1)):
            k += 1
            _release(x, v, k, data, start, turn)
            if k == 1:
                v[0] += kick
        for _ in range(samples // 2):
            found.append(_sample(done * dt, x, v, W, k, data, start))
            phi = data.spool_rate * dt * done
            positions.append(_shape(x, k))
            W, far, *tensions = _steps(phi, x, v, W, k, packed, _KINDS[start], printed, dt, per_sample)
            pull.append(tensions)
            done, off_plane = done + per_sample, max(off_plane, far)
        if not math.isfinite(W):
            break
    found.append(_sample(done * dt, x, v, W, k, data, start))
    positions.append(_shape(x, k))
    rows = np.array(found)
    kept = np.isfinite(rows).all(axis=1)
    t, rate, lag, momentum = rows[kept].T
    tension = np.array([[math.nan, math.nan], *pull])[kept]
    shapes = np.array(positions)[kept]
    return Deployment(t, rate, lag, momentum, off_plane, shapes, tension, done, time.process_time() - began)


def hold(data: Data, step: float, count: int) -> float:
    """How much a disturbance along a straight thread that is all out and at rest grows over steps of RK4.

    Every other node starts 1e-6 of a segment off its place; the result is the largest distance at the end over that.
    """
    k, l0 = data.nodes, data.segment
    x, v = np.zeros((k + 1, 3)), np.zeros((k + 1, 3))
    x[:k, 0] = l0 * np.arange(k, 0, -1)
    x[:, 2] = data.radius
    still, first = x.copy(), 1e-6 * l0
    x[:k:2, 0] += first
    packed = (
        data.inertia, data.offset, data.radius, 0.0, data.line_density, data.tip_mass, l0, data.stiffness,
        data.damping, 0.0, TINY,
    )  # fmt: skip
    _steps(data.length / data.radius, x, v, 0.0, k, packed, _DEPARTURE, False, step, count)
    off = float(np.abs(x[:k] - still[:k]).max()) / first
    return off if math.isfinite(off) else math.inf


def _shape(x: Array, k: int) -> Array:
    """Positions of the nodes, NaN of those on the spool."""
    shape = x[:-1].copy()
    shape[k:] = math.nan
    return shape


def _sample(
    t: float, x: Array, v: Array, W: float, k: int, data: Data, start: Start
) -> tuple[float, float, float, float]:
    """Time, rate of the body, lag of the tip in degrees, angular momentum with k released nodes."""
    m = np.full(k, data.line_density * data.segment)
    m[0] = data.tip_mass + 0.5 * data.line_density * data.segment
    if start == "growing":
        m[-1] += 0.5 * data.line_density * (data.speed * t - k * data.segment)
    arm, y = x[:k, 0] + data.offset, x[:k, 1]
    momentum = data.inertia * W + 2.0 * np.sum(m * (arm * (v[:k, 1] + W * arm) - y * (v[:k, 0] - W * y)))
    return t, W, math.degrees(math.atan2(-x[0, 1], x[0, 0])), float(momentum)
