"""A rigid body on springs: where it comes to rest, and how it vibrates about that rest."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from evolvent.errors import InputError, nearest

G0 = 9.80665  # m/s2, standard gravity
SUPPORTS = ("hanging", "standing", "guided")
X, Y, Z = np.eye(3)
LEVEL = np.eye(3) - np.outer(Y, Y)  # onto the horizontal plane
VERTICAL = np.eye(6)[:, [1, 3, 5]]  # heave, roll about x, pitch about z
MOTIONS = ("slides along x", "drops", "slides along z", "rolls over about x", "yaws about y", "pitches over about z")


def array(name: str, value: Any, shape: tuple[int, ...] = (), *, least: float = -np.inf) -> np.ndarray:
    """`value` as a read-only float array of the trailing `shape`; refused unless finite and at least `least`."""
    try:
        result = np.array(value, dtype=float)
    except (TypeError, ValueError):
        result = np.full(0, np.nan)
    trailing = result.shape[max(result.ndim - len(shape), 0) :] if shape else ()
    fits = len(trailing) == len(shape) and all(w in (-1, n) for n, w in zip(trailing, shape, strict=True))
    if not fits or result.size == 0 or not np.all(np.isfinite(result)):
        wanted = " x ".join("n" if n < 0 else str(n) for n in shape) + " finite numbers" if shape else "a finite number"
        raise InputError(f"{name} is {' '.join(str(value).split())[:200]}; it must be {wanted}")
    if np.any(result < least):
        limit = "above 0" if 0.0 < least < 1e-300 else f"{least:g} or above"
        raise InputError(f"{name} is {' '.join(str(value).split())[:200]}; it must be {limit}")
    result.flags.writeable = False
    return result


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Stand:
    """Springs, between points of a body and points of the ground, that hold the body up.

    Parameters
    ----------
    points : (n, 3) float, m
        Where the springs are attached, body axes (y up), from the stiffness centre of the attachment plane.
    stiffness : float or (n,) float, N/m, axial
    length : float or (n,) float, m, natural length
    damping : float or (n,) float, N s/m, axial
    lateral_stiffness, lateral_damping : float or (n,) float, N/m and N s/m
        Against horizontal displacement of the attachment from its place over (or under) the ground point.
    ground : (n, 3) float, m, optional
        Ground points in the frame of the level, unloaded stand, where the attachments stand at `points`. Left out,
        they lie vertically above (hanging, guided) or below (standing) the attachments at the natural length.
    support : {"hanging", "standing", "guided"}
        Hanging and standing bodies are free in six degrees of freedom. A guided one is held sideways: x and z of its
        centre of mass stay, and its x axis keeps no z component in the level frame, (R e_x) . Z = 0.
    gravity : float, m/s2, downwards

    Notes
    -----
    With d from ground point to attachment, ``l = |d|`` and w the horizontal part of d less its value on the level,
    unloaded stand, a spring has the energy k (l - l0)^2 / 2 + k_l w^2 / 2 and acts on the body with
    -(k (l - l0) + c l') d / l - (k_l w + c_l w'). Frames: y up, x and z horizontal.

    Every field may carry leading axes, broadcast against those of the body: a map or a sample is then one call.
    """

    points: Any
    stiffness: Any
    length: Any
    damping: Any = 0.0
    lateral_stiffness: Any = 0.0
    lateral_damping: Any = 0.0
    ground: Any = None
    support: str = "hanging"
    gravity: Any = G0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", array("stand.points", self.points, (-1, 3)))
        n = self.points.shape[-2]
        for field in ("stiffness", "length", "damping", "lateral_stiffness", "lateral_damping"):
            value = np.asarray(getattr(self, field))
            value = array(f"stand.{field}", getattr(self, field), (n,) if value.ndim else (), least=0.0)
            put(self, field, np.broadcast_to(value, np.broadcast_shapes(value.shape, (n,))))
        if np.any(self.stiffness <= 0.0) or np.any(self.length <= 0.0):
            field = "length" if np.all(self.stiffness > 0.0) else "stiffness"
            raise InputError(f"stand.{field} is {getattr(self, field)}; every spring's must be above 0")
        put(self, "gravity", array("stand.gravity", self.gravity, least=0.0))
        if self.support not in SUPPORTS:
            raise InputError(f"stand.support is {self.support!r}; {nearest(str(self.support), SUPPORTS)}")
        if self.ground is not None:
            put(self, "ground", array("stand.ground", self.ground, (n, 3)))
            if np.any(np.all(self.ground == self.points, axis=-1)):
                raise InputError("stand.ground meets an attachment point; a spring needs a direction")

    @classmethod
    def rectangle(cls, a: float, b: float, **fields: Any) -> Stand:
        """Four springs at (a, b), (a, -b), (-a, -b), (-a, b) in (x, z), in this order; `fields` as of `Stand`."""
        array("stand.a", a, least=0.0)
        array("stand.b", b, least=0.0)
        return cls(points=[[a, 0, b], [a, 0, -b], [-a, 0, -b], [-a, 0, b]], **fields)

    @property
    def ground_points(self) -> np.ndarray:
        """(n, 3) float, m, level frame."""
        if self.ground is not None:
            return self.ground
        side = -1.0 if self.support == "standing" else 1.0
        return self.points + side * self.length[..., None] * Y


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A rigid body.

    Parameters
    ----------
    mass : float, kg
    centre : (3,) float, m
        Centre of mass, body axes, from the stiffness centre of the attachment plane: (ex, -h, ez) with h the height of
        the attachment plane above it.
    inertia : (3, 3) or (3,) float, kg m2
        Tensor about the centre of mass in body axes (I_xz = -int x z dm), or its principal moments along them.

    Notes
    -----
    Every field may carry leading axes (the tensor then in full).
    """

    mass: Any
    centre: Any
    inertia: Any

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "mass", array("body.mass", self.mass, least=np.nextafter(0.0, 1.0)))
        put(self, "centre", array("body.centre", self.centre, (3,)))
        tensor = np.asarray(self.inertia)
        tensor = np.diag(array("body.inertia", tensor, (3,))) if tensor.shape == (3,) else tensor
        put(self, "inertia", array("body.inertia", tensor, (3, 3)))
        reason = broken(self.inertia)
        if reason:
            raise InputError(f"body.inertia is {' '.join(str(self.inertia).split())[:200]}; {reason}")


def broken(inertia: np.ndarray, rtol: float = 1e-9) -> str:
    """Why no body can have this inertia tensor; empty where one can.

    Parameters
    ----------
    inertia : (..., 3, 3) float, kg m2
    rtol : float, of the largest principal moment
    """
    if not np.allclose(inertia, np.swapaxes(inertia, -1, -2), rtol=rtol, atol=rtol * np.max(np.abs(inertia))):
        return "an inertia tensor is symmetric"
    moments = np.linalg.eigvalsh(inertia)
    if np.any(moments[..., 0] <= 0.0):
        return f"its least principal moment is {np.min(moments[..., 0]):.6g} kg m2 and must be above 0"
    excess = moments[..., 2] - moments[..., 0] - moments[..., 1]
    if np.any(excess > rtol * moments[..., 2]):
        return f"its largest principal moment exceeds the sum of the others by {np.max(excess):.6g} kg m2"
    return ""


class Setup(NamedTuple):
    """Numbers of a stand and a body, with any leading axes, unchecked."""

    points: np.ndarray
    ground: np.ndarray
    stiffness: np.ndarray
    length: np.ndarray
    damping: np.ndarray
    lateral_stiffness: np.ndarray
    lateral_damping: np.ndarray
    gravity: np.ndarray
    guided: bool
    mass: np.ndarray
    centre: np.ndarray
    inertia: np.ndarray

    @property
    def batch(self) -> tuple[int, ...]:
        """Leading axes of all fields together."""
        trailing = (2, 2, 1, 1, 1, 1, 1, 0, 0, 0, 1, 2)
        fields = [np.asarray(f) for f in self]
        return np.broadcast_shapes(*(f.shape[: f.ndim - n] for f, n in zip(fields, trailing, strict=True)))


def setup(stand: Stand, body: Body) -> Setup:
    """Numbers of a stand and a body."""
    return Setup(
        stand.points,
        stand.ground_points,
        stand.stiffness,
        stand.length,
        stand.damping,
        stand.lateral_stiffness,
        stand.lateral_damping,
        stand.gravity,
        stand.support == "guided",
        body.mass,
        body.centre,
        body.inertia,
    )


@dataclasses.dataclass(frozen=True)
class Pose:
    """Where a body is.

    Attributes
    ----------
    position : (..., 3) float, m
        Of the centre of mass in the frame of the level, unloaded stand (there it is at `body.centre`).
    origin : (..., 3) float, m
        Of the stiffness centre of the attachment plane, from where it is on the level, unloaded stand.
    rotation : (..., 3, 3) float, body to level frame
    reaction : (..., 3) float, N and N m
        Of the guides: force along x, force along z, and multiplier of (R e_x) . Z; zero where the body is free.
    """

    position: np.ndarray
    origin: np.ndarray
    rotation: np.ndarray
    reaction: np.ndarray

    @property
    def tilt(self) -> np.ndarray:
        """(...) float, rad, angle between the body's y axis and the vertical."""
        return np.arctan2(np.hypot(self.rotation[..., 0, 1], self.rotation[..., 2, 1]), self.rotation[..., 1, 1])


def skew(r: np.ndarray) -> np.ndarray:
    """(..., 3, 3) matrix S with S v = r x v."""
    S = np.zeros((*r.shape, 3))
    S[..., 0, 1], S[..., 0, 2] = -r[..., 2], r[..., 1]
    S[..., 1, 0], S[..., 1, 2] = r[..., 2], -r[..., 0]
    S[..., 2, 0], S[..., 2, 1] = -r[..., 1], r[..., 0]
    return S


def rotation_matrix(theta: np.ndarray) -> np.ndarray:
    """(..., 3, 3) rotation by the vector `theta`, rad: Rodrigues' formula."""
    angle = np.linalg.norm(theta, axis=-1)[..., None, None]
    S = skew(theta)
    return np.eye(3) + np.sinc(angle / np.pi) * S + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (S @ S)


def turning(f: np.ndarray, r: np.ndarray) -> np.ndarray:
    """(..., 3, 3) symmetric matrix H with theta.H theta / 2 = f . (theta x (theta x r)) / 2."""
    outer = f[..., :, None] * r[..., None, :]
    return 0.5 * (outer + np.swapaxes(outer, -1, -2)) - np.einsum("...i,...i", f, r)[..., None, None] * np.eye(3)


def spring_state(s: Setup, position: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, ...]:
    """Lever arms r (..., n, 3), directions e (..., n, 3), lengths l (..., n), forces on the body f (..., n, 3)."""
    r = (s.points - s.centre[..., None, :]) @ np.swapaxes(rotation, -1, -2)
    d = position[..., None, :] + r - s.ground
    length = np.linalg.norm(d, axis=-1)
    e = d / length[..., None]
    w = (d - s.points + s.ground) * (1.0, 0.0, 1.0)
    f = -(s.stiffness * (length - s.length))[..., None] * e - s.lateral_stiffness[..., None] * w
    return r, e, length, f


def jacobian(r: np.ndarray) -> np.ndarray:
    """(..., 3, 6) displacement of points at lever arms r from the centre of mass, of (translation, rotation)."""
    return np.concatenate([np.broadcast_to(np.eye(3), (*r.shape, 3)), -skew(r)], axis=-1)


def energy(stand: Stand, body: Body, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Potential energy of springs and gravity, J.

    Parameters
    ----------
    stand, body : Stand, Body
    position : (..., 3) float, m, of the centre of mass, level frame
    rotation : (..., 3, 3) float, body to level frame
    """
    s = setup(stand, body)
    r = (s.points - s.centre[..., None, :]) @ np.swapaxes(rotation, -1, -2)
    d = position[..., None, :] + r - s.ground
    w = (d - s.points + s.ground) * (1.0, 0.0, 1.0)
    stretch = np.linalg.norm(d, axis=-1) - s.length
    springs = 0.5 * s.stiffness * stretch**2 + 0.5 * s.lateral_stiffness * np.sum(w * w, axis=-1)
    return np.sum(springs, axis=-1) + s.mass * s.gravity * position[..., 1]


def wrench(stand: Stand, body: Body, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Force and moment about the centre of mass, of springs and gravity on a resting body.

    Returns
    -------
    (..., 6) float, N and N m, level axes
    """
    return -gradient(setup(stand, body), position, rotation)[0]


def gradient(s: Setup, position: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (..., 6) and Hessian (..., 6, 6) of the potential energy in (translation, rotation vector)."""
    r, e, length, f = spring_state(s, position, rotation)
    g = -np.concatenate([f.sum(axis=-2), np.cross(r, f).sum(axis=-2)], axis=-1)
    g[..., 1] += s.mass * s.gravity
    tension = s.stiffness * (length - s.length) / length
    ee = e[..., :, None] * e[..., None, :]
    A = (s.stiffness - tension)[..., None, None] * ee + tension[..., None, None] * np.eye(3)
    A = A + s.lateral_stiffness[..., None, None] * LEVEL
    J = jacobian(r)
    H = (np.swapaxes(J, -1, -2) @ A @ J).sum(axis=-3)
    H[..., 3:, 3:] -= turning(f, r).sum(axis=-3)
    return g, H


def guides(s: Setup, rotation: np.ndarray) -> np.ndarray:
    """Jacobian (..., c, 6) of the guides: x and z of the centre of mass, yaw; no rows where the body is free."""
    e = rotation[..., :, 0]
    if not s.guided:
        return np.zeros((*e.shape[:-1], 0, 6))
    C = np.zeros((*e.shape[:-1], 3, 6))
    C[..., 0, 0] = C[..., 1, 2] = 1.0
    C[..., 2, 3:] = np.cross(e, Z)
    return C


def equilibrium(stand: Stand, body: Body, *, force: Any = (0.0, 0.0, 0.0), point: Any = (0.0, 0.0, 0.0)) -> Pose:
    """The pose in which a body rests, in full geometry.

    Parameters
    ----------
    stand, body : Stand, Body
    force : (3,) float, N, level axes
        A constant force on the body besides gravity.
    point : (3,) float, m
        Where it acts: body axes, from the stiffness centre of the attachment plane.

    Raises
    ------
    InputError
        Where no equilibrium is found.

    Notes
    -----
    Newton's method on the gradient of the potential energy in translation and rotation vector, with multipliers for
    the guides; from level, at the height where gravity and springs balance.
    """
    return rest(setup(stand, body), array("force", force, (3,)), array("point", point, (3,)))


def rest(s: Setup, force: np.ndarray | None = None, point: np.ndarray | None = None, most: int = 100) -> Pose:
    """`equilibrium` of a Setup."""
    force = np.zeros(3) if force is None else force
    point = np.zeros(3) if point is None else point
    batch = np.broadcast_shapes(s.batch, force.shape[:-1], point.shape[:-1])
    position = np.broadcast_to(s.centre, (*batch, 3)).copy()
    position[..., 1] -= (s.mass * s.gravity - force[..., 1]) / s.stiffness.sum(axis=-1)
    rotation = np.broadcast_to(np.eye(3), (*batch, 3, 3))
    c = 3 if s.guided else 0
    reaction = np.zeros((*batch, c))
    size = np.max(np.linalg.norm(s.points - s.centre[..., None, :], axis=-1)) + np.max(s.length)
    scale = np.array([1.0] * 3 + [size] * 3)
    for _ in range(most):
        g, H = gradient(s, position, rotation)
        r = np.einsum("...ij,...j", rotation, point - s.centre)
        g = g - np.concatenate(np.broadcast_arrays(force, np.cross(r, force)), axis=-1)
        H[..., 3:, 3:] -= turning(np.broadcast_to(force, r.shape), r)
        A = np.zeros((*batch, 6 + c, 6 + c))
        b = np.zeros((*batch, 6 + c))
        if c:
            C, e = guides(s, rotation), rotation[..., :, 0]
            H[..., 3:, 3:] -= reaction[..., 2, None, None] * turning(np.broadcast_to(Z, e.shape), e)
            A[..., :6, 6:], A[..., 6:, :6] = -np.swapaxes(C, -1, -2), C
            b[..., 6:] = np.stack(
                [position[..., 0] - s.centre[..., 0], position[..., 2] - s.centre[..., 2], e[..., 2]], axis=-1
            )
            g = g - np.einsum("...ci,...c", C, reaction)
        A[..., :6, :6] = H
        b[..., :6] = g
        try:
            step = -np.linalg.solve(A, b[..., None])[..., 0]
        except np.linalg.LinAlgError:
            raise InputError("the springs leave the body a motion without any stiffness; it has no one rest") from None
        longest = np.max(np.abs(step[..., :6] * scale), axis=-1)
        if not np.all(np.isfinite(longest)):
            break
        short = np.minimum(1.0, 0.2 * size / np.maximum(longest, 1e-300))[..., None]
        position = position + short * step[..., :3]
        rotation = rotation_matrix(short * step[..., 3:6]) @ rotation
        reaction = reaction + short * step[..., 6:]
        if np.all(longest < 1e-9 * size):
            origin = position - np.einsum("...ij,...j", rotation, s.centre)
            return Pose(position, origin, rotation, reaction if c else np.zeros((*batch, 3)))
    raise InputError(
        "no equilibrium was found near the level position; springs, mass and centre of mass do not belong together"
    )


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
        return np.concatenate([u, np.cross(r, u)], axis=-1)

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
        shapes = self.basis @ np.swapaxes(W, -1, -2) @ V
        least = 1e-9 * square[..., -1:]
        bad = square <= least
        if refuse_unstable and np.any(bad):
            raise InputError(falls(self, square, shapes))
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


def falls(model: LinearModel, square: np.ndarray, shapes: np.ndarray) -> str:
    """The sentence that tells in which motion a body leaves its springs."""
    where = np.unravel_index(np.argmin(square[..., 0]), square.shape[:-1])
    M = np.broadcast_to(model.mass, (*square.shape[:-1], 6, 6))[where]
    phi = shapes[where][:, square[where] <= 1e-9 * square[where][-1]]
    motions = dict.fromkeys(MOTIONS[i] for i in np.argmax(phi * (M @ phi), axis=0))
    growth = np.sqrt(max(-square[(*where, 0)], 0.0))
    pace = f"growing e-fold in {1.0 / growth:.2g} s" if growth > 0.0 else "with nothing to bring it back"
    return (
        f"the springs cannot hold the body: it {', '.join(motions)}, {pace}; "
        "hang it, guide it, give the springs lateral stiffness, or bring the centre of mass nearer to the middle"
    )


def damped(
    M: np.ndarray, D: np.ndarray, K: np.ndarray, shapes: np.ndarray, natural: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequency, decay rate and natural frequency of each mode from the poles of M q'' + D q' + K q = 0."""
    import scipy.linalg
    import scipy.optimize

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
            raise InputError("stand.damping is too high: a mode does not oscillate any more; lower it")
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
        Undamped; translation of the centre of mass and rotation vector, level axes; of modal mass 1.
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

    def at(self, points: Any, directions: Any = (0.0, 1.0, 0.0)) -> np.ndarray:
        """(..., m, s): displacement of body points along directions in each mode of modal mass 1.

        Parameters
        ----------
        points : (s, 3) float, m, body axes, from the stiffness centre of the attachment plane
        directions : (3,) or (s, 3) float, level axes; vertical if left out
        """
        return np.swapaxes(self.model.displacement(points, directions) @ self.shapes, -1, -2)

    def release(self, force: Any, point: Any) -> np.ndarray:
        """Complex modal coordinates (..., m) after a steady force is let go at once; see `state`.

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
        Q = np.concatenate(np.broadcast_arrays(force + 0 * r, np.cross(r, force)), axis=-1)
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


def linear_model(stand: Stand, body: Body) -> LinearModel:
    """Vibrations about the true equilibrium, of all motions that the support leaves.

    Notes
    -----
    Tangent stiffness with the springs' tensions and the tilt; nothing is left out to first order.
    """
    return linearise(setup(stand, body))


def linearise(s: Setup) -> LinearModel:
    """`linear_model` of a Setup."""
    pose = rest(s)
    R = pose.rotation
    batch = R.shape[:-2]
    K = gradient(s, pose.position, R)[1]
    B = np.broadcast_to(np.eye(6), (*batch, 6, 6))
    if s.guided:
        e = R[..., :, 0]
        K[..., 3:, 3:] -= pose.reaction[..., 2, None, None] * turning(np.broadcast_to(Z, e.shape), e)
        B = np.zeros((*batch, 6, 3))
        B[..., 1, 0] = B[..., 5, 2] = 1.0
        B[..., 3:, 1] = e
    M = np.zeros((*batch, 6, 6))
    M[..., :3, :3] = np.asarray(s.mass)[..., None, None] * np.eye(3)
    M[..., 3:, 3:] = R @ s.inertia @ np.swapaxes(R, -1, -2)
    D = np.zeros((*batch, 6, 6))
    if np.any(s.damping) or np.any(s.lateral_damping):
        r, d, _, _ = spring_state(s, pose.position, R)
        C = s.damping[..., None, None] * d[..., :, None] * d[..., None, :]
        C = C + s.lateral_damping[..., None, None] * LEVEL
        J = jacobian(r)
        D = D + (np.swapaxes(J, -1, -2) @ C @ J).sum(axis=-3)
    return LinearModel(M, D, K, B, pose, s.centre)


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
    basis = np.broadcast_to(VERTICAL, (*batch, 6, 3))
    return LinearModel(M, D, K, basis, Pose(position, position - s.centre, R, np.zeros((*batch, 3))), s.centre)
