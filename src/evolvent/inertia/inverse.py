"""Mass, centre of mass and inertia of a body from how it vibrates on its springs: four ways."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.errors import InputError
from evolvent.inertia.problem import (
    BODY_NAMES,
    MOMENTS,
    Problem,
    assign,
    mac,
    problem,
    scale_of,
    undetermined,
    value_of,
)
from evolvent.inertia.stand import (
    Body,
    Pose,
    Setup,
    Stand,
    Y,
    array,
    broken,
    gradient,
    level,
    linearise,
    rest,
    setup,
    skew,
    spring_state,
    turning,
)
from evolvent.inertia.uncertainty import Candidate, Inertia, with_budget

CENTRE_SHARE, PRODUCT_SHARE = 1e-2, 1e-3  # nudges off a symmetric start, of the unknown's scale


# ------------------------------------------------------------------------------------------- (a) three frequencies


def candidates(
    stand: Stand, body: Body, frequency: Any, *, shapes: Any = None, points: Any = None
) -> tuple[Candidate, ...]:
    """All stiffnesses and moments Ixx, Izz that give three frequencies, of a body with known mass, centre and Ixz.

    Parameters
    ----------
    stand : Stand
        Only the ratios of the springs' stiffnesses matter.
    body : Body
        Its mass, ex, ez and Ixz; its other moments are not used.
    frequency : (3,) float, rad/s, undamped
    shapes : (3, s) float, optional
        Vertical amplitudes of each mode at the sensors, to any scale.
    points : (s, 3) float, m, of the sensors, body axes

    Returns
    -------
    tuple of Candidate
        Best shapes first; by falling stiffness where no shapes were given.

    Notes
    -----
    Of `vertical_model`. With C the inverse of K / k, m = M/k, x = Ixx/k, z = Izz/k, c = Ixz/k = (Ixz/M) m and
    lambda = 1/omega^2 the invariants of C diag(m, [[x, c], [c, z]]) are

        sum lambda   = C11 m + C22 x + C33 z + 2 C23 c
        sum of pairs = P12 m x + P13 m z + P23 (x z - c^2) + 2 P m c
        product      = det C m (x z - c^2)

    with P12, P13, P23 the principal minors of C and P = C11 C23 - C12 C13; for four equal springs these are Belyakov's
    (2002) relations between p = M/4k, q and r. Eliminating x and z leaves a polynomial of degree 6 in m. Its roots
    are corrected by Newton's method on the three invariants.
    """
    s = setup(stand, body)
    frequency = array("frequency", frequency, (3,), least=np.nextafter(0.0, 1.0))
    if np.any(frequency <= 0.0) or len(set(frequency.tolist())) < 3:
        raise InputError(f"frequency is {frequency}; the three must be above 0 and different")
    frequency = np.sort(frequency) if shapes is None else frequency
    k = float(s.stiffness.mean())
    reach = np.array([1.0, *np.abs(s.points - s.points.mean(axis=0)).max(axis=0)[[2, 0]]])
    if np.any(reach <= 0.0):
        raise InputError("stand.points lie on a line; roll and pitch need springs apart in x and in z")
    K = level(s).reduced()[2] / k / np.outer(reach, reach)
    C = np.linalg.inv(K)
    unit = float(np.mean(frequency**-2.0))
    lam = frequency**-2.0 / unit
    S1, S2, S3 = lam.sum(), lam[0] * lam[1] + lam[0] * lam[2] + lam[1] * lam[2], lam.prod()
    kappa = float(s.inertia[0, 2] / s.mass) / (reach[1] * reach[2])
    P12, P13 = C[0, 0] * C[1, 1] - C[0, 1] ** 2, C[0, 0] * C[2, 2] - C[0, 2] ** 2
    P23 = C[1, 1] * C[2, 2] - C[1, 2] ** 2
    P = C[0, 0] * C[1, 2] - C[0, 1] * C[0, 2]
    det = np.linalg.det(C)
    al, be = C[1, 1], C[2, 2]
    g1, g2 = P12 / al, P13 / be

    # u = al x, w = be z: u + w = L(m), g1 u + g2 w = N(m); d = (u - w) / 2
    m = np.polynomial.Polynomial([0.0, 1.0])
    L = S1 - (C[0, 0] + 2.0 * C[1, 2] * kappa) * m
    N2 = S2 * m - P23 * S3 / det - 2.0 * P * kappa * m**3  # m^2 N
    W = N2 - m**2 * L * (0.5 * (g1 + g2))  # m^2 (g1 - g2) d
    d2 = m**4 * L**2 * 0.25 - al * be * (S3 / det * m**3 + kappa**2 * m**6)  # m^4 d^2
    starts = []
    for root in [*((g1 - g2) ** 2 * d2 - W**2).roots(), *W.roots()]:
        at = float(np.real(root))
        if at > 0.0:
            half, d = 0.5 * L(at), np.sqrt(max(d2(at), 0.0)) / at**2
            starts += [(at, (half + d) / al, (half - d) / be), (at, (half - d) / al, (half + d) / be)]

    def invariants(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at, x, z = v
        c = kappa * at
        area = x * z - c * c
        f = [
            C[0, 0] * at + al * x + be * z + 2.0 * C[1, 2] * c - S1,
            P12 * at * x + P13 * at * z + P23 * area + 2.0 * P * at * c - S2,
            det * at * area - S3,
        ]
        df = [
            [C[0, 0] + 2.0 * C[1, 2] * kappa, al, be],
            [P12 * x + P13 * z - 2.0 * P23 * kappa * c + 4.0 * P * c, P12 * at + P23 * z, P13 * at + P23 * x],
            [det * (area - 2.0 * c * c), det * at * z, det * at * x],
        ]
        return np.array(f), np.array(df)

    found: list[np.ndarray] = []
    for start in starts:
        v = np.array(start)
        for _ in range(50):
            f, df = invariants(v)
            if abs(np.linalg.det(df)) < 1e-14:
                break
            step = np.linalg.solve(df, f)
            v = v - step
            if np.max(np.abs(step)) < 1e-13:
                break
        good = np.max(np.abs(invariants(v)[0])) < 1e-11 and np.all(v > 0.0) and v[1] * v[2] > (kappa * v[0]) ** 2
        if good and not any(np.allclose(v, w, rtol=1e-7, atol=0.0) for w in found):
            found.append(v)
    result = []
    for at, x, z in sorted(found, key=lambda v: v[0]):
        stiffness = float(s.mass) / (at * unit)
        Ixx, Izz = x * unit * stiffness * reach[1] ** 2, z * unit * stiffness * reach[2] ** 2
        agreement = float("nan")
        if shapes is not None:
            fit = assign(s, ("stiffness", "Ixx", "Izz"), np.array([stiffness, Ixx, Izz]))
            order = np.argsort(np.argsort(frequency))
            agreement = float(mac(array("shapes", shapes, (3, -1)), level(fit).modes().at(points)[order]).min())
        result.append(Candidate(float(stiffness), float(Ixx), float(Izz), agreement))
    return tuple(sorted(result, key=lambda c: -c.mac)) if shapes is not None else tuple(result)


def from_three_frequencies(
    stand: Stand,
    body: Body,
    frequency: Any,
    *,
    frequency_covariance: Any = None,
    shapes: Any = None,
    points: Any = None,
    inputs: Mapping[str, float] | None = None,
) -> Inertia:
    """Ixx, Izz and the stiffness from three frequencies, with mass, centre of mass and Ixz known (Belyakov's way).

    Parameters
    ----------
    stand, body, frequency, shapes, points
        As of `candidates`. Without shapes there must be only one candidate.
    frequency_covariance : (3, 3) float, optional
    inputs : mapping of str to float, optional
        Standard deviations of what is taken as known; see `with_budget`.

    Returns
    -------
    Inertia

    Raises
    ------
    InputError
        Where no body has these frequencies, or several and no shapes tell which.
    """
    found = candidates(stand, body, frequency, shapes=shapes, points=points)
    if not found:
        raise InputError(
            "no body with this mass and centre of mass has these three frequencies; check them and the stand's geometry"
        )
    if shapes is None and len(found) > 1:
        pairs = "; ".join(f"{c.Ixx:.6g} and {c.Izz:.6g}" for c in found)
        raise InputError(
            f"{len(found)} pairs of Ixx and Izz give these frequencies ({pairs}); give the mode shapes too"
        )
    unknown = ("stiffness", "Ixx", "Izz")
    p = problem(stand, body, unknown, frequency, frequency_covariance=frequency_covariance, model="vertical")
    best = found[0]
    warnings = []
    if shapes is not None and best.mac < 0.9:
        warnings.append(f"the shapes agree badly with any candidate: the best has a MAC of {best.mac:.2f}")
    if len(found) > 1 and best.mac - found[1].mac < 0.01:
        warnings.append(f"the shapes hardly tell the candidates apart: MAC {best.mac:.4f} and {found[1].mac:.4f}")
    values = np.array([best.stiffness, best.Ixx, best.Izz])
    return finish(p, values, "three frequencies", inputs=inputs, found=found, warnings=warnings)


# ---------------------------------------------------------------------------------------- (b) frequencies and shapes


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


def rigid_shapes(p: Problem, J: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """(m, 6) motion of the reference point in each measured mode, by weighted least squares over the sensors."""
    if p.shapes is None or p.shape_covariance is None:
        raise InputError("shapes are needed; give them with the points of their sensors")
    A = J @ basis
    size = np.max(np.abs(A), axis=0)
    if len(A) < A.shape[1] or np.linalg.matrix_rank(A / np.where(size > 0.0, size, 1.0), tol=1e-6) < A.shape[1]:
        raise InputError(
            f"{len(A)} sensors do not show the {A.shape[1]} motions of the body; set them apart, in more directions"
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


def vertical_properties(p: Problem) -> dict[str, float]:
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


def from_shapes(
    stand: Stand,
    body: Body,
    frequency: Any,
    *,
    shapes: Any,
    points: Any,
    frequency_covariance: Any = None,
    shape_covariance: Any = None,
    model: str = "vertical",
    inputs: Mapping[str, float] | None = None,
) -> Inertia:
    """Mass, ex, ez, Ixx, Izz and Ixz from three modes with their shapes, the stiffnesses known.

    Parameters
    ----------
    stand, body : Stand, Body
        The body's h, Iyy, Ixy, Iyz are taken as known, the rest is not used.
    frequency : (3,) float, rad/s, undamped
    shapes : (3, s) float, vertical amplitudes of each mode at the sensors, to any scale
    points : (s, 3) float, m, of the sensors, body axes, three or more and not in a line
    frequency_covariance : (3, 3) float, optional
    shape_covariance : (3, s, s) float, optional
    model : {"vertical", "full"}
    inputs : mapping of str to float, optional

    Notes
    -----
    M_S = K Phi Omega^-2 Phi^-1 about the stiffness centre, as least squares for a symmetric M_S of a rigid body; then
    `fit`, which weighs frequencies and shapes by their covariances.
    """
    unknown = ("mass", "ex", "ez", "Ixx", "Izz", "Ixz")
    p = problem(
        stand,
        body,
        unknown,
        frequency,
        frequency_covariance=frequency_covariance,
        shapes=shapes,
        shape_covariance=shape_covariance,
        points=points,
        model=model,
    )
    start = vertical_properties(p)
    refuse_mass(start["mass"])
    return solve(p, "shapes", [np.array([start[name] for name in unknown])], inputs=inputs)


def refuse_mass(mass: float) -> None:
    """Refuse a mass that is not above zero."""
    if not mass > 0.0:
        raise InputError(f"the data give a mass of {mass:.6g} kg; check frequencies, shapes and stiffness")


# ------------------------------------------------------------------------------------------------- (c) six modes


def spring_stiffness(s: Setup, pose: Pose) -> np.ndarray:
    """(6, 6) tangent stiffness of the springs alone, in translation of the stiffness centre and rotation vector."""
    return gradient(s._replace(centre=np.zeros(3), gravity=np.zeros(())), pose.origin, pose.rotation)[1]


def six_mode_properties(p: Problem, pose: Pose | None = None) -> dict[str, float]:
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
        at = pose or rest(s)
        R = at.rotation
        r = p.points @ R.T
        u = np.broadcast_to(p.directions, r.shape)
        phi = rigid_shapes(p, np.concatenate([u, np.cross(r, u)], axis=1), np.eye(6))
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
            load = np.concatenate([[force[:, 1].sum()], np.cross(arms, force).sum(axis=0)])
            unit = np.array([load[0], *(load[0] * np.abs(s.points).max(),) * 3])
            A.append(rows / unit[:, None])
            b.append(load / unit)
        found = properties(scaled_lstsq(np.concatenate(A), np.concatenate(b)))
        refuse_mass(found["mass"])
        change = max(abs(found[name] - body[name]) / scale for name, scale in zip(BODY_NAMES, scales(s), strict=True))
        body = found
        if change < 1e-10:
            break
    return body


def scales(s: Setup) -> list[float]:
    """Sizes of the ten mass properties."""
    return [scale_of(s, name) for name in BODY_NAMES]


def from_six_modes(
    stand: Stand,
    body: Body,
    frequency: Any,
    *,
    shapes: Any,
    points: Any,
    directions: Any,
    frequency_covariance: Any = None,
    shape_covariance: Any = None,
    pose: Pose | None = None,
    prior: Mapping[str, tuple[float, float]] | None = None,
    refine: bool = True,
    inputs: Mapping[str, float] | None = None,
) -> Inertia:
    """Mass, centre of mass and the whole tensor from six modes with their shapes, the stiffnesses known.

    Parameters
    ----------
    stand : Stand, free
    body : Body, where to start
    frequency : (6,) float, rad/s, undamped
    shapes : (6, s) float, amplitudes of each mode at the sensors, to any scale
    points, directions : (s, 3) float, of six sensors or more, that show all six motions
    frequency_covariance, shape_covariance : (6, 6), (6, s, s) float, optional
    pose : Pose, optional
        The measured pose at rest (its origin and rotation): adds the statics, sum F = M g and the moments, to the
        linear solution.
    prior : mapping of str to (value, standard deviation), optional
        As of `fit`.
    refine : bool
        Follow the linear solution by `fit`. Without it no uncertainty is given.
    inputs : mapping of str to float, optional

    Notes
    -----
    [omega_k^2 Y(phi_k) - G(phi_k)] p = K_s phi_k with p = (M, M c, I) about the stiffness centre, Y the rigid body's
    regressor, G what gravity adds to the stiffness through M c, K_s the springs' tangent stiffness in the equilibrium.
    """
    p = problem(
        stand,
        body,
        BODY_NAMES,
        frequency,
        frequency_covariance=frequency_covariance,
        shapes=shapes,
        shape_covariance=shape_covariance,
        points=points,
        directions=directions,
        prior=dict(prior or {}),
    )
    found = six_mode_properties(p, pose)
    values = np.array([found[name] for name in BODY_NAMES])
    if not refine:
        return finish(p, values, "six modes, linear")
    return solve(p, "six modes", [values], inputs=inputs)


# ------------------------------------------------------------------------------------------------- (d) least squares


def fit(
    stand: Stand,
    body: Body,
    unknown: Sequence[str],
    frequency: Any,
    *,
    frequency_covariance: Any = None,
    shapes: Any = None,
    shape_covariance: Any = None,
    points: Any = None,
    directions: Any = (0.0, 1.0, 0.0),
    model: str = "full",
    release: Any = None,
    prior: Mapping[str, tuple[float, float]] | None = None,
    inputs: Mapping[str, float] | None = None,
) -> Inertia:
    """Any unknowns of body and stand from frequencies, and shapes where given, by nonlinear least squares.

    Parameters
    ----------
    stand, body : Stand, Body
        What is known, and where the unknowns start.
    unknown : sequence of str
        Of mass; ex, h, ez; Ixx, Iyy, Izz, Ixy, Ixz, Iyz; stiffness (of all springs in proportion), k1, k2, ...; and
        the other names of `assign`.
    frequency : (m,) float, rad/s, undamped
    frequency_covariance : (m, m) float, optional; 1e-5 of each frequency weighs the data if left out
    shapes : (m, s) float, optional, amplitudes of each mode at the sensors, to any scale
    shape_covariance : (m, s, s) float, optional; 1 % of each shape's largest amplitude if left out
    points, directions : (s, 3) float, m and level axes, of the sensors; vertical if left out
    model : {"full", "vertical"}
        `linear_model`, about the true equilibrium, or Belyakov's `vertical_model`.
    release : ((3,), (3,)) float, optional
        Force, N, level axes, that was let go, and where, m, body axes. The shapes are then true amplitudes in metres,
        and tell mass and stiffness apart. Without it their scale is free.
    prior : mapping of str to (value, standard deviation), optional
        Unknowns that were also measured otherwise, such as the mass.
    inputs : mapping of str to float, optional
        Standard deviations of what is taken as known; see `with_budget`.

    Returns
    -------
    Inertia

    Raises
    ------
    InputError
        Where the data cannot tell the unknowns (it names which), no body fits, or the body found is none.

    Notes
    -----
    Levenberg-Marquardt on the residual of `Problem`, whitened by the covariances. With shapes it starts from the best
    of: the given body, the candidates of three frequencies, the linear solutions from shapes of three or six modes.
    Without shapes it starts from the given body, and where other bodies have the same frequencies a warning says so.
    """
    p = problem(
        stand,
        body,
        unknown,
        frequency,
        frequency_covariance=frequency_covariance,
        shapes=shapes,
        shape_covariance=shape_covariance,
        points=points,
        directions=directions,
        model=model,
        release=release,
        prior=dict(prior or {}),
    )
    result = solve(p, "least squares", starts(p, stand, body), inputs=inputs)
    if p.shapes is None and len(p.frequency) == 3 and {"Ixx", "Izz"} <= set(p.unknown):
        try:
            others = len(candidates(stand, body, p.frequency)) - 1
        except InputError:
            others = 0
        if others > 0:
            near = f"{others} other pairs of Ixx and Izz give about these frequencies; without shapes the start decides"
            result = dataclasses.replace(result, warnings=(*result.warnings, near))
    return result


def starts(p: Problem, stand: Stand, body: Body) -> list[np.ndarray]:
    """Where a search may begin: the given body, off its symmetries, and what the direct ways find."""
    base = p.start
    nudge = np.array(
        [CENTRE_SHARE if n in ("ex", "h", "ez") else PRODUCT_SHARE * (n in ("Ixy", "Ixz", "Iyz")) for n in p.unknown]
    )
    result = [base + nudge * p.scale]
    guesses: list[dict[str, float]] = []
    if p.shapes is None:
        return result
    if len(p.frequency) < 3:  # which motions these are is open
        places = [p.unknown.index(name) for name in ("Ixx", "Izz") if name in p.unknown]
        for factors in itertools.product((0.3, 1.0, 3.0), repeat=len(places)):
            result.append(result[0].copy())
            result[-1][places] *= factors
    try:
        if len(p.frequency) == 3 and {"Ixx", "Izz"} <= set(p.unknown):
            vertical = not np.any(p.directions - Y)
            for c in candidates(stand, body, p.frequency):
                guesses.append({"stiffness": c.stiffness, "Ixx": c.Ixx, "Izz": c.Izz, "mass": float(p.base.mass)})
            if vertical:
                guesses.append({"stiffness": float(p.base.stiffness.mean()), **vertical_properties(p)})
        elif len(p.frequency) == 6:
            guesses.append({"stiffness": float(p.base.stiffness.mean()), **six_mode_properties(p)})
    except InputError:
        pass
    for guess in guesses:
        # frequencies keep when mass, moments and stiffness change together
        ratio = 1.0
        if "stiffness" not in p.unknown:
            ratio = float(p.base.stiffness.mean()) / guess["stiffness"]
        elif "mass" not in p.unknown:
            ratio = float(p.base.mass) / guess["mass"]
        for name in ("stiffness", "mass", *MOMENTS):
            if name in guess:
                guess[name] *= ratio
        result.append(np.array([guess.get(n, v) for n, v in zip(p.unknown, result[0], strict=True)]))
    return result


def solve(
    p: Problem, method: str, begin: Sequence[np.ndarray], *, inputs: Mapping[str, float] | None = None
) -> Inertia:
    """Least squares of a problem from the best of several starts."""
    import scipy.optimize

    scale = p.scale

    def residual(x: np.ndarray) -> np.ndarray:
        try:
            r = p.residual(x * scale)
        except (InputError, np.linalg.LinAlgError):
            return np.full(rows, 1e9)
        return np.where(np.isfinite(r), r, 1e9)

    rows = len(p.frequency) + (0 if p.shapes is None else p.shapes.size) + len(p.prior)
    given = begin[0]
    begin = sorted(begin, key=lambda values: float(np.sum(residual(values / scale) ** 2)))
    first = begin[0]
    if np.all(residual(first / scale) >= 1e9):
        p.residual(given)  # says why
        raise InputError(
            "the search has no start at which the stand holds the body; give a body nearer to the true one"
        )
    told = undetermined(p.jacobian(first), p.unknown, scale)
    if rows < len(p.unknown):
        raise InputError(f"the data cannot tell the unknowns: {'; '.join(told)}")

    def search(start: np.ndarray) -> Any:
        return scipy.optimize.least_squares(
            residual,
            start / scale,
            jac=lambda x: p.jacobian(x * scale) * scale,
            method="lm",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=200,
        )

    found = search(first)
    if found.status == 0:
        raise InputError("the search for mass and inertia does not converge; give a body nearer to the true one")
    try:
        return finish(p, found.x * scale, method, inputs=inputs)
    except InputError as error:
        for start in begin[1:] if p.shapes is not None else []:  # another that fits as well, and that a body has
            other = search(start)
            if other.status > 0 and other.cost < 2.0 * found.cost + rows:
                with contextlib.suppress(InputError):
                    return finish(p, other.x * scale, method, inputs=inputs)
        raise error


def finish(
    p: Problem,
    values: np.ndarray,
    method: str,
    *,
    inputs: Mapping[str, float] | None = None,
    found: tuple[Candidate, ...] = (),
    warnings: Sequence[str] = (),
) -> Inertia:
    """The result, once it is sure that the data tell it and that a body can have it."""
    warnings = list(warnings)
    told = undetermined(p.jacobian(values), p.unknown, p.scale)
    if told:
        raise InputError(f"the data cannot tell the unknowns: {'; '.join(told)}")
    full = assign(p.base, p.unknown, values)
    named = {name: float(value_of(full, name)) for name in BODY_NAMES}
    named.update(zip(p.unknown, values.tolist(), strict=True))
    refuse_mass(named["mass"])
    for name in p.unknown:
        if name in ("Ixx", "Iyy", "Izz") and not named[name] > 0.0:
            raise InputError(f"the data give {name} = {named[name]:.6g} kg m2; no body has it, check the data")
        if (name == "stiffness" or name[0] == "k") and not named[name] > 0.0:
            raise InputError(f"the data give {name} = {named[name]:.6g} N/m; no spring has it, check the data")
    r = p.residual(values)
    scaled = 0 if p.shapes is None or p.release is not None else len(p.shapes)
    free = len(p.frequency) + (0 if p.shapes is None else p.shapes.size - scaled) + len(p.prior) - len(values)
    misfit = float(np.sqrt(r @ r / free)) if free > 0 else float("nan")
    if p.weighted and misfit > 3.0:
        warnings.append(f"the model misses the data by {misfit:.1f} of their standard deviations")
    result = Inertia(
        values=named,
        identified=p.unknown,
        covariance=np.full((len(values), len(values)), np.nan),
        method=method,
        problem=p,
        candidates=found,
        misfit=misfit,
    )
    if not method.endswith("linear"):
        result = with_budget(result, inputs or {})
    reason = broken(result.tensor)
    if reason:
        moments = np.linalg.eigvalsh(result.tensor)
        spread = 3.0 * np.sqrt(np.nansum([result.std.get(n, 0.0) ** 2 for n in ("Ixx", "Iyy", "Izz")]))
        held = [n for n in MOMENTS if n not in p.unknown]
        because = f" with {', '.join(held)} assumed" if held else ""
        if moments[0] <= 0.0 or moments[2] - moments[0] - moments[1] > spread:
            raise InputError(
                f"the data give an inertia tensor{because} that no body has: {reason}; check the data "
                "and the stand's description"
            )
        warnings.append(f"the inertia tensor{because} is at the edge of what a body can have: {reason}")
    return dataclasses.replace(result, warnings=tuple(warnings))
