"""Mass properties from modes with their shapes, by linear equations."""

from __future__ import annotations

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.problem import BODY_NAMES, InertiaProblem, assign, scale_of, value_of
from evolvent_massprops.inertia.stand import MOMENTS, Setup
from evolvent_massprops.inertia.statics import Pose, Y, cross, equilibrium_pose, gradient, skew, spring_state, turning
from evolvent_massprops.inertia.vibration import level, linearise


def regressor(phi: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Y (..., 6, 10) with Y p = M phi, p = (mass, mass c (3), Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the reference point).

    Parameters
    ----------
    phi : (..., 6) float, translation of the reference point and rotation vector, level axes
    R : (3, 3) float, body to level axes; p is in body axes
    """
    u, theta = phi[..., :3], phi[..., 3:]
    Y = np.zeros((*phi.shape, 10))
    Y[..., :3, 0] = u
    Y[..., :3, 1:4] = skew(theta) @ R
    Y[..., 3:, 1:4] = -skew(u) @ R
    w = theta @ R  # body axes
    for column, (i, j) in enumerate(MOMENTS.values(), start=4):
        part = np.zeros_like(w)
        part[..., i] = w[..., j]
        part[..., j] = w[..., i]
        Y[..., 3:, column] = part @ R.T
    return Y


def properties(p: np.ndarray) -> dict[str, float]:
    """Mass, centre of mass and central moments from the ten numbers of `regressor`."""
    mass = p[0]
    c = p[1:4] / mass
    tensor = np.zeros((3, 3))
    for value, (i, j) in zip(p[4:], MOMENTS.values(), strict=True):
        tensor[i, j] = tensor[j, i] = value
    tensor -= mass * (c @ c * np.eye(3) - np.outer(c, c))
    moments = {name: float(tensor[ij]) for name, ij in MOMENTS.items()}
    return {"mass": float(mass), "ex": float(c[0]), "h": float(-c[1]), "ez": float(c[2]), **moments}


def rigid_shapes(p: InertiaProblem, J: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """(m, 6) motion of the reference point in each measured mode, by weighted least squares over the sensors."""
    if p.shapes is None or p.shape_covariance is None:
        raise InputError("shapes are needed; give them with the points of their sensors")
    A = J @ basis
    size = np.max(np.abs(A), axis=0)
    if len(A) < A.shape[1] or np.linalg.matrix_rank(A / np.where(size > 0.0, size, 1.0), tol=1e-6) < A.shape[1]:
        raise InputError(
            f"{len(A)} sensors do not show the {A.shape[1]} motions of the body; place them further apart, in "
            f"more directions"
        )
    phi = []
    for a, C in zip(p.shapes, p.shape_covariance, strict=True):
        W = np.linalg.inv(np.linalg.cholesky(C))
        phi.append(np.linalg.lstsq(W @ A / size, W @ a, rcond=None)[0] / size)
    return np.array(phi) @ basis.T


def scaled_lstsq(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Least squares with columns scaled to unit length."""
    size = np.linalg.norm(A, axis=0)
    return np.linalg.lstsq(A / size, b, rcond=None)[0] / size


def refuse_mass(mass: float) -> None:
    """Refuse a mass that is not above zero."""
    if not mass > 0.0:
        raise InputError(f"the data give a mass of {mass:.6g} kg; check frequencies, shapes and stiffness")


def vertical_properties(p: InertiaProblem) -> dict[str, float]:
    """mass, ex, ez, Ixx, Izz, Ixz from three modes of the vertical model by M_S phi omega^2 = K phi."""
    if p.points is None or len(p.frequency) < 3:
        raise InputError("this way takes three frequencies with their shapes")
    free = assign(p.base, ("ex", "h", "ez"), np.zeros(3))
    model = level(free)
    J = model.displacement(p.points, p.directions)
    phi = rigid_shapes(p, J, model.basis)
    K = model.stiffness
    columns = [0, 1, 3, 4, 6, 8]  # mass, M ex, M ez, Ixx, Izz, Ixz of the regressor
    rows = [1, 3, 5]
    W = np.linalg.inv(np.linalg.cholesky(model.reduced()[2]))
    A = np.concatenate(
        [w**2 * W @ regressor(f, np.eye(3))[rows][:, columns] for w, f in zip(p.frequency, phi, strict=True)]
    )
    size = [np.linalg.norm(W @ (K @ f)[rows]) for f in phi]
    A /= np.repeat(size, 3)[:, None]
    b = np.concatenate([W @ (K @ f)[rows] / n for f, n in zip(phi, size, strict=True)])
    ten = np.zeros(10)
    ten[columns] = scaled_lstsq(A, b)
    found = properties(ten)
    return {name: found[name] for name in ("mass", "ex", "ez", "Ixx", "Izz", "Ixz")}


def spring_stiffness(s: Setup, pose: Pose) -> np.ndarray:
    """(6, 6) tangent stiffness of the springs alone, in translation of the stiffness centre and rotation vector."""
    return gradient(s._replace(centre=np.zeros(3), gravity=np.zeros(())), pose.origin, pose.rotation)[1]


def six_mode_properties(p: InertiaProblem, pose: Pose | None = None) -> dict[str, float]:
    """All ten mass properties from six modes by [omega^2 Y(phi) - G(phi)] p = K_s phi.

    Notes
    -----
    K_s and G hold in the equilibrium, which itself depends on the body: unless `pose` is given it is taken from the
    body found last, until that stays.
    """
    if p.base.guided:
        raise InputError("six modes need a body free in six degrees of freedom; stand.support is 'guided'")
    if p.points is None or len(p.frequency) < 6:
        raise InputError("this way takes six frequencies with their shapes")
    g = float(p.base.gravity)
    body = {name: float(value_of(p.base, name)) for name in BODY_NAMES}
    for _ in range(30):
        s = assign(p.base, BODY_NAMES, np.array([body[name] for name in BODY_NAMES]))
        at = pose or equilibrium_pose(s)
        R = at.rotation
        r = p.points @ R.T
        u = np.broadcast_to(p.directions, r.shape)
        phi = rigid_shapes(p, np.concatenate([u, cross(r, u)], axis=1), np.eye(6))
        K = spring_stiffness(s, at)
        size = np.sqrt(np.abs(np.diag(linearise(s).mass)))
        A, b = [], []
        for w, f in zip(p.frequency, phi, strict=True):
            G = np.zeros((6, 10))
            for j in range(3):
                G[3:, 1 + j] = turning(g * Y, R[:, j]) @ f[3:]
            norm = w**2 * np.linalg.norm(size * f)
            A.append((w**2 * regressor(f, R) - G) / size[:, None] / norm)
            b.append(K @ f / size / norm)
        if pose is not None:  # statics: sum F = M g, moments about the stiffness centre
            arms, _, _, force = spring_state(s._replace(centre=np.zeros(3)), pose.origin, R)
            rows = np.zeros((4, 10))
            rows[0, 0] = g
            rows[1:, 1:4] = g * -skew(Y) @ R
            load = np.concatenate([[force[:, 1].sum()], cross(arms, force).sum(axis=0)])
            unit = np.array([load[0], *(load[0] * np.abs(s.points).max(),) * 3])
            A.append(rows / unit[:, None])
            b.append(load / unit)
        found = properties(scaled_lstsq(np.concatenate(A), np.concatenate(b)))
        refuse_mass(found["mass"])
        change = max(abs(found[name] - body[name]) / scale_of(s, name) for name in BODY_NAMES)
        body = found
        if change < 1e-10:
            break
    return body
