"""Small vibrations of a body on springs about its equilibrium: linear models, normal modes, modal coordinates."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import scipy

from evolvent_base.dense import facing
from evolvent_base.errors import InputError
from evolvent_massprops.inertia.mounted import turned, whole
from evolvent_massprops.inertia.stand import Body, Setup, Stand, array, setup
from evolvent_massprops.inertia.statics import (
    LEVEL,
    Pose,
    Z,
    cross,
    equilibrium_pose,
    gradient,
    jacobian,
    spring_state,
    turning,
)

#: What a mode can mostly be, in the order of `NormalModes.shares`.
KINDS = ("sway along x", "heave", "sway along z", "roll", "yaw", "pitch")
VERTICAL = np.eye(6)[:, [1, 3, 5]]  # heave, roll about x, pitch about z
#: Share of a mode's kinetic energy in rotation below which the mode is a translation.
LEAST_ROTATION = 1e-12
MOTIONS = ("slides along x", "drops", "slides along z", "rolls over about x", "yaws about y", "pitches over about z")


@dataclasses.dataclass(frozen=True)
class LinearModel:
    """Small vibrations about a pose.

    Attributes
    ----------
    mass, damping, stiffness : (..., 6, 6) float, SI
        In the translation of the centre of mass and the rotation vector, level axes. Stiffness is the Hessian of the
        potential energy, of springs, tensions, gravity and the guides' reaction.
    basis : (..., 6, f) float
        The motions that the support leaves: all six; heave, roll about the body's x axis and pitch about the level z
        axis where guided.
    pose : Pose
    centre : (..., 3) float, m, centre of mass, body axes
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    basis: np.ndarray
    pose: Pose
    centre: np.ndarray

    def reduced(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, damping and stiffness (..., f, f) in the motions of `basis`."""
        B, Bt = self.basis, np.swapaxes(self.basis, -1, -2)
        return Bt @ self.mass @ B, Bt @ self.damping @ B, Bt @ self.stiffness @ B

    def displacement(self, points: Any, directions: Any = (0.0, 1.0, 0.0)) -> np.ndarray:
        """(..., s, 6): displacement of body points along directions, of (translation, rotation vector).

        Parameters
        ----------
        points : (s, 3) float, m, body axes, from the stiffness centre of the attachment plane
        directions : (3,) or (s, 3) float, level axes; vertical if left out
        """
        points = array("points", points, (-1, 3))
        u = array("directions", directions, (3,))
        r = (points - self.centre[..., None, :]) @ np.swapaxes(self.pose.rotation, -1, -2)
        u = np.broadcast_to(u, r.shape)
        return np.concatenate([u, cross(r, u)], axis=-1)

    def jump(self, impulse: Any, point: Any) -> np.ndarray:
        """Velocity of the centre of mass and angular velocity (6,), level axes, that an impulse gives the body at rest.

        Parameters
        ----------
        impulse : (3,) float, N s, level axes
        point : (3,) float, m, body axes, from the stiffness centre of the attachment plane

        Notes
        -----
        In the motions B that the support leaves: B (B^T M B)^-1 B^T (impulse, r x impulse).
        """
        impulse, point = array("impulse", impulse, (3,)), array("point", point, (3,))
        load = np.concatenate([impulse, cross(self.pose.rotation @ (point - self.centre), impulse)])
        found: np.ndarray = self.basis @ np.linalg.solve(self.reduced()[0], self.basis.T @ load)
        return found

    def modes(self, *, refuse_unstable: bool = True) -> NormalModes:
        """Normal modes, frequencies rising.

        Parameters
        ----------
        refuse_unstable : bool
            If not, a motion without or with negative stiffness is kept, its frequency nan.

        Raises
        ------
        InputError
            Where the springs cannot hold the body; it names the motion in which it leaves.
        """
        M, D, K = self.reduced()
        try:
            L = np.linalg.cholesky(M)
        except np.linalg.LinAlgError:
            raise InputError("the inertia tensor is not positive; no body has it") from None
        W = np.linalg.inv(L)
        square, V = np.linalg.eigh(W @ K @ np.swapaxes(W, -1, -2))
        V = V * facing(np.swapaxes(V, -1, -2))[..., None, :]
        shapes = self.basis @ np.swapaxes(W, -1, -2) @ V
        least = 1e-9 * square[..., -1:]
        bad = square <= least
        if refuse_unstable and np.any(bad):
            raise InputError(instability_message(self, square, shapes))
        natural = np.sqrt(np.where(bad, np.nan, square))
        decay = np.zeros_like(natural)
        frequency = natural
        if np.any(D):
            frequency, decay, natural = damped(M, D, K, np.swapaxes(W, -1, -2) @ V, natural)
        return NormalModes(
            eigenvalue=square,
            natural_frequency=natural,
            frequency=frequency,
            decay_rate=decay,
            shapes=shapes,
            model=self,
        )


def instability_message(model: LinearModel, square: np.ndarray, shapes: np.ndarray) -> str:
    """A message with the motion in which a body leaves its springs."""
    where = np.unravel_index(np.argmin(square[..., 0]), square.shape[:-1])
    M = np.broadcast_to(model.mass, (*square.shape[:-1], 6, 6))[where]
    phi = shapes[where][:, square[where] <= 1e-9 * square[where][-1]]
    motions = dict.fromkeys(MOTIONS[i] for i in np.argmax(phi * (M @ phi), axis=0))
    growth = np.sqrt(max(-square[(*where, 0)], 0.0))
    pace = f"growing e-fold in {1.0 / growth:.2g} s" if growth > 0.0 else "without a restoring force"
    return (
        f"the springs cannot hold the body: it {', '.join(motions)}, {pace}; "
        "hang it, guide it, give the springs lateral stiffness, or bring the centre of mass nearer to the middle"
    )


def damped(
    M: np.ndarray, D: np.ndarray, K: np.ndarray, shapes: np.ndarray, natural: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequency, decay rate and natural frequency of each mode from the poles of M q'' + D q' + K q = 0."""
    f = M.shape[-1]
    batch = np.broadcast_shapes(M.shape[:-2], D.shape[:-2], K.shape[:-2])
    out = np.full((3, *batch, f), np.nan)
    M, D, K = (np.broadcast_to(A, (*batch, f, f)) for A in (M, D, K))
    for i in np.ndindex(*batch):
        if np.any(np.isnan(natural[i])):
            continue
        phi = shapes[i]
        Dm = phi.T @ D[i] @ phi  # modal: q'' + Dm q' + diag(natural^2) q = 0
        A = np.block([[np.zeros((f, f)), np.eye(f)], [-np.diag(natural[i] ** 2), -Dm]])
        pole, vector = scipy.linalg.eig(A)
        upper = pole.imag > 1e-9 * np.abs(pole)
        if np.count_nonzero(upper) < f:
            raise InputError("stand.damping is too high: a mode no longer oscillates; lower it")
        pole, vector = pole[upper], np.abs(vector[:f, upper])
        order = scipy.optimize.linear_sum_assignment(-vector)[1]
        pole = pole[order]
        out[(slice(None), *i)] = pole.imag, -pole.real, np.abs(pole)
    return out[0], out[1], out[2]


@dataclasses.dataclass(frozen=True)
class NormalModes:
    """Normal modes of a linear model.

    Attributes
    ----------
    eigenvalue : (..., m) float, 1/s2, squares of the undamped frequencies, rising
    natural_frequency : (..., m) float, rad/s, modulus of the pole; nan where the mode is unstable
    frequency : (..., m) float, rad/s, with damping
    decay_rate : (..., m) float, 1/s
    shapes : (..., 6, m) float
        Undamped; translation of the centre of mass and rotation vector, level axes; of modal mass 1. The largest
        mass-weighted component is positive (`facing`).
    model : LinearModel
    """

    eigenvalue: np.ndarray
    natural_frequency: np.ndarray
    frequency: np.ndarray
    decay_rate: np.ndarray
    shapes: np.ndarray
    model: LinearModel

    @property
    def damping_ratio(self) -> np.ndarray:
        """(..., m) float."""
        return self.decay_rate / self.natural_frequency

    @property
    def shares(self) -> np.ndarray:
        """(..., 6, m) float, shares of each mode's kinetic energy in the motions: along x, y, z, about x, y, z."""
        return self.shapes * (self.model.mass @ self.shapes)

    @property
    def kinds(self) -> list[str]:
        """What each mode of one body mostly is, of `KINDS`."""
        return [KINDS[int(k)] for k in np.argmax(self.shares, axis=0)]

    @property
    def vertical(self) -> np.ndarray:
        """(3,) int, numbers of the modes with most kinetic energy in heave, roll and pitch, frequencies rising."""
        return np.sort(np.argsort(self.shares[[1, 3, 5]].sum(axis=0))[-3:])

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Axes about which the body turns in each mode, body axes.

        Returns
        -------
        points : (..., m, 3) float, m
            Point of the axis that is nearest to the centre of mass, from the stiffness centre of the attachment plane.
        directions : (..., m, 3) float
            Unit vector of the rotation; the component that is largest is positive. Both are nan for a translation.

        Notes
        -----
        With u the translation of the centre of mass and t the rotation vector the point is t x u / t^2 from the centre
        of mass. Where u has a component along t, the body moves along the axis as well (a screw).
        """
        shapes = np.swapaxes(self.shapes, -1, -2)
        u, turn = shapes[..., :3], shapes[..., 3:]
        share = np.swapaxes(self.shares, -1, -2)[..., 3:].sum(axis=-1, keepdims=True)
        square = np.where(share > LEAST_ROTATION, np.sum(turn**2, axis=-1, keepdims=True), np.nan)
        R = self.model.pose.rotation[..., None, :, :]
        arm, direction = cross(turn, u) / square, turn / np.sqrt(square)
        direction = direction * facing(np.nan_to_num(direction))[..., None]
        points = self.model.centre[..., None, :] + np.einsum("...ji,...j->...i", R, arm)
        return points, np.einsum("...ji,...j->...i", R, direction)

    def at(self, points: Any, directions: Any = (0.0, 1.0, 0.0)) -> np.ndarray:
        """(..., m, s): displacement of body points along directions in each mode of modal mass 1.

        Parameters
        ----------
        points : (s, 3) float, m, body axes, from the stiffness centre of the attachment plane
        directions : (3,) or (s, 3) float, level axes; vertical if left out
        """
        return np.swapaxes(self.model.displacement(points, directions) @ self.shapes, -1, -2)

    def release(self, force: Any, point: Any) -> np.ndarray:
        """Complex modal coordinates (..., m) after a steady force is removed at once; see `state`.

        Parameters
        ----------
        force : (..., 3) float, N, level axes
        point : (..., 3) float, m, body axes, from the stiffness centre of the attachment plane
        """
        return self._load(force, point) / self.eigenvalue + 0j

    def impulse(self, impulse: Any, point: Any) -> np.ndarray:
        """Complex modal coordinates (..., m) after an impulse (..., 3), N s, at a body point; see `release`."""
        return -1j * self._load(impulse, point) / np.sqrt(self.eigenvalue + 0j)

    def _load(self, force: Any, point: Any) -> np.ndarray:
        force, point = array("force", force, (3,)), array("point", point, (3,))
        r = np.einsum("...ij,...j", self.model.pose.rotation, point - self.model.centre)
        Q = np.concatenate(np.broadcast_arrays(force + 0 * r, cross(r, force)), axis=-1)
        return np.einsum("...im,...i", self.shapes, Q)

    def state(self, displacement: Any, velocity: Any = (0.0,) * 6) -> np.ndarray:
        """Complex modal coordinates z (..., m) of an initial state; the motion is Re z exp(i frequency t).

        Parameters
        ----------
        displacement, velocity : (..., 6) float
            Translation of the centre of mass and rotation vector from the rest, level axes, and their rates.
        """
        q, v = array("displacement", displacement, (6,)), array("velocity", velocity, (6,))
        P = np.swapaxes(self.shapes, -1, -2) @ self.model.mass
        rate = np.einsum("...mi,...i", P, v) / np.sqrt(self.eigenvalue + 0j)
        return np.einsum("...mi,...i", P, q) - 1j * rate

    def amplitude(self, z: np.ndarray, points: Any, directions: Any = (0.0, 1.0, 0.0)) -> np.ndarray:
        """Complex amplitudes (..., m, s), m, of each mode at body points along directions, from modal coordinates z."""
        return z[..., :, None] * self.at(points, directions)

    def energy(self, z: np.ndarray) -> np.ndarray:
        """Energy (..., m), J, of each mode, from modal coordinates z."""
        return 0.5 * self.eigenvalue * np.abs(z) ** 2

    def motion(self, t: np.ndarray, z: np.ndarray, points: Any, directions: Any = (0.0, 1.0, 0.0)) -> np.ndarray:
        """Displacement (..., s, k), m, of body points along directions at times t (k,), s, each mode with its decay."""
        wave = np.exp((-self.decay_rate + 1j * self.frequency)[..., None] * np.asarray(t, dtype=float))
        return np.einsum("...ms,...mk->...sk", self.amplitude(z, points, directions), wave).real


def spring_energies(stiffness: Any, amplitude: np.ndarray) -> np.ndarray:
    """Energy of each mode from its amplitudes at the springs, ``E_k = sum_i k_i |A_ki|^2 / 2``, J.

    Parameters
    ----------
    stiffness : float or (n,) float, N/m
    amplitude : (..., m, n) float or complex, m, vertical

    Notes
    -----
    Belyakov (2002). It leaves out what gravity and lateral stiffness add.
    """
    return 0.5 * np.sum(np.asarray(stiffness) * np.abs(amplitude) ** 2, axis=-1)


def partial_frequencies(stand: Stand, body: Body) -> np.ndarray:
    """Frequencies (..., 3), rad/s, of heave, roll and pitch without coupling: those of a body whose offset is zero.

    Notes
    -----
    Belyakov (2002): sqrt(4 k/M), sqrt(4 k b^2/Ixx) and sqrt(4 k a^2/Izz) of four equal springs; in general the sums of
    the stiffnesses and of their moments of second order about the springs' own centre.
    """
    s = setup(stand, body)
    k = s.stiffness
    total = k.sum(axis=-1)
    apart = s.points[..., [2, 0]]
    apart = apart - (np.sum(k[..., None] * apart, axis=-2) / total[..., None])[..., None, :]
    second = np.sum(k[..., None] * apart**2, axis=-2)
    squares = (total / s.mass, second[..., 0] / s.inertia[..., 0, 0], second[..., 1] / s.inertia[..., 2, 2])
    return np.sqrt(np.stack(np.broadcast_arrays(*squares), axis=-1))


def linear_model(stand: Stand, body: Body) -> LinearModel:
    """Vibrations about the true equilibrium, of all motions that the support leaves.

    Notes
    -----
    Tangent stiffness with the springs' tensions and the tilt; nothing is left out to first order.
    """
    return linearise(setup(stand, body))


def linearise(s: Setup) -> LinearModel:
    """`linear_model` of a Setup."""
    s = whole(s)
    pose = equilibrium_pose(s)
    R = pose.rotation
    batch = R.shape[:-2]
    K = gradient(s, pose.position, R)[1]
    if s.guided:
        e = R[..., :, 0]
        K[..., 3:, 3:] -= pose.reaction[..., 2, None, None] * turning(np.broadcast_to(Z, e.shape), e)
    M, B = moving(s, R)
    D = np.zeros((*batch, 6, 6))
    if np.any(s.damping) or np.any(s.lateral_damping):
        r, d, _, _ = spring_state(s, pose.position, R)
        C = s.damping[..., None, None] * d[..., :, None] * d[..., None, :]
        C = C + s.lateral_damping[..., None, None] * LEVEL
        J = jacobian(r)
        D = D + (np.swapaxes(J, -1, -2) @ C @ J).sum(axis=-3)
    return LinearModel(M, D, K, B, pose, s.centre)


def moving(s: Setup, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (..., 6, 6) and motions that the support leaves (..., 6, f), of a body in the attitude R."""
    batch = R.shape[:-2]
    M = np.zeros((*batch, 6, 6))
    M[..., :3, :3] = np.asarray(s.mass)[..., None, None] * np.eye(3)
    M[..., 3:, 3:] = R @ s.inertia @ np.swapaxes(R, -1, -2)
    if s.added is not None:
        M = M + turned(s.added, R)
    B = np.broadcast_to(np.eye(6), (*batch, 6, 6))
    if s.guided:
        B = np.zeros((*batch, 6, 3))
        B[..., 1, 0] = B[..., 5, 2] = 1.0
        B[..., 3:, 1] = R[..., :, 0]
    return M, B


def vertical_model(stand: Stand, body: Body) -> LinearModel:
    """Belyakov's linear model: heave, roll and pitch of a level body on vertical springs, without gravity.

    Notes
    -----
    In q = (y, alpha_x, gamma_z) a point moves by y + gamma r_x - alpha r_z. For four equal springs
    K = 4k [[1, ez, -ex], [ez, b^2 + ez^2, -ex ez], [-ex, -ex ez, a^2 + ex^2]]; the mass matrix is
    diag(M, [[Ixx, Ixz], [Ixz, Izz]]).
    """
    return level(setup(stand, body))


def level(s: Setup) -> LinearModel:
    """`vertical_model` of a Setup."""
    s = whole(s)
    batch = s.batch
    R = np.broadcast_to(np.eye(3), (*batch, 3, 3))
    position = np.broadcast_to(s.centre, (*batch, 3)).copy()
    position[..., 1] -= s.mass * s.gravity / s.stiffness.sum(axis=-1)
    r = s.points - s.centre[..., None, :]
    v = np.zeros((*np.broadcast_shapes(batch, r.shape[:-2]), r.shape[-2], 6))
    v[..., 1], v[..., 3], v[..., 5] = 1.0, -r[..., 2], r[..., 0]
    K = np.einsum("...n,...ni,...nj->...ij", s.stiffness, v, v)
    D = np.einsum("...n,...ni,...nj->...ij", s.damping, v, v)
    M = np.zeros((*batch, 6, 6))
    M[..., :3, :3] = np.asarray(s.mass)[..., None, None] * np.eye(3)
    M[..., 3:, 3:] = s.inertia
    if s.added is not None:
        M = M + s.added
    basis = np.broadcast_to(VERTICAL, (*batch, 6, 3))
    return LinearModel(M, D, K, basis, Pose(position, position - s.centre, R, np.zeros((*batch, 3))), s.centre)
