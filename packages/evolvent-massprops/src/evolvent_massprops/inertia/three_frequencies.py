"""Belyakov's relations between three frequencies and the moments of a level body on springs."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.problem import assign, mac
from evolvent_massprops.inertia.stand import Body, Stand, array, setup
from evolvent_massprops.inertia.uncertainty import Candidate
from evolvent_massprops.inertia.vibration import level


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
    unit = float(np.mean(frequency**-2.0))
    kappa = float(s.inertia[0, 2] / s.mass) / (reach[1] * reach[2])
    found = _roots(_relations(np.linalg.inv(K), kappa, frequency**-2.0 / unit))
    result = []
    for m, x, z in sorted(found, key=lambda v: v[0]):
        stiffness = float(s.mass) / (m * unit)
        Ixx, Izz = x * unit * stiffness * reach[1] ** 2, z * unit * stiffness * reach[2] ** 2
        agreement = float("nan")
        if shapes is not None:
            fit = assign(s, ("stiffness", "Ixx", "Izz"), np.array([stiffness, Ixx, Izz]))
            order = np.argsort(np.argsort(frequency))
            agreement = float(mac(array("shapes", shapes, (3, -1)), level(fit).modes().at(points)[order]).min())
        result.append(Candidate(float(stiffness), float(Ixx), float(Izz), agreement))
    return tuple(sorted(result, key=lambda c: -c.mac)) if shapes is not None else tuple(result)


class _Relations(NamedTuple):
    """The relations of `candidates` between m, x and z, in units in which all numbers are near 1.

    Attributes
    ----------
    C : (3, 3) float, inverse of the stiffness matrix
    P12, P13, P23, P, det : float, minors and determinant of C, as in `candidates`
    kappa : float, c/m
    S1, S2, S3 : float, left-hand sides: sum of the lambda, of their products in pairs, product of all
    """

    C: np.ndarray
    P12: float
    P13: float
    P23: float
    P: float
    det: float
    kappa: float
    S1: float
    S2: float
    S3: float


def _relations(C: np.ndarray, kappa: float, lam: np.ndarray) -> _Relations:
    return _Relations(
        C=C,
        P12=C[0, 0] * C[1, 1] - C[0, 1] ** 2,
        P13=C[0, 0] * C[2, 2] - C[0, 2] ** 2,
        P23=C[1, 1] * C[2, 2] - C[1, 2] ** 2,
        P=C[0, 0] * C[1, 2] - C[0, 1] * C[0, 2],
        det=np.linalg.det(C),
        kappa=kappa,
        S1=lam.sum(),
        S2=lam[0] * lam[1] + lam[0] * lam[2] + lam[1] * lam[2],
        S3=lam.prod(),
    )


def _polynomial_roots(r: _Relations) -> list[tuple[float, float, float]]:
    """Approximate (m, x, z), from the real parts of the roots of a polynomial in m."""
    C, kappa, al, be = r.C, r.kappa, r.C[1, 1], r.C[2, 2]
    g1, g2 = r.P12 / al, r.P13 / be
    # u = al x, w = be z: u + w = L(m), g1 u + g2 w = N(m); d = (u - w) / 2
    m = np.polynomial.Polynomial([0.0, 1.0])
    L = r.S1 - (C[0, 0] + 2.0 * C[1, 2] * kappa) * m
    N2 = r.S2 * m - r.P23 * r.S3 / r.det - 2.0 * r.P * kappa * m**3  # m^2 N
    W = N2 - m**2 * L * (0.5 * (g1 + g2))  # m^2 (g1 - g2) d
    d2 = m**4 * L**2 * 0.25 - al * be * (r.S3 / r.det * m**3 + kappa**2 * m**6)  # m^4 d^2
    found = []
    for root in [*((g1 - g2) ** 2 * d2 - W**2).roots(), *W.roots()]:
        at = float(np.real(root))
        if at > 0.0:
            half, d = 0.5 * L(at), np.sqrt(max(d2(at), 0.0)) / at**2
            found += [(at, (half + d) / al, (half - d) / be), (at, (half - d) / al, (half + d) / be)]
    return found


def _residual(r: _Relations, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What (m, x, z) leave of the three relations, and its derivative."""
    C, kappa = r.C, r.kappa
    m, x, z = v
    c = kappa * m
    area = x * z - c * c
    f = [
        C[0, 0] * m + C[1, 1] * x + C[2, 2] * z + 2.0 * C[1, 2] * c - r.S1,
        r.P12 * m * x + r.P13 * m * z + r.P23 * area + 2.0 * r.P * m * c - r.S2,
        r.det * m * area - r.S3,
    ]
    df = [
        [C[0, 0] + 2.0 * C[1, 2] * kappa, C[1, 1], C[2, 2]],
        [r.P12 * x + r.P13 * z - 2.0 * r.P23 * kappa * c + 4.0 * r.P * c, r.P12 * m + r.P23 * z, r.P13 * m + r.P23 * x],
        [r.det * (area - 2.0 * c * c), r.det * m * z, r.det * m * x],
    ]
    return np.array(f), np.array(df)


def _roots(r: _Relations) -> list[np.ndarray]:
    """All different (m, x, z) that a body can have, by Newton's method from the roots of the polynomial."""
    found: list[np.ndarray] = []
    for start in _polynomial_roots(r):
        v = np.array(start)
        for _ in range(50):
            f, df = _residual(r, v)
            if abs(np.linalg.det(df)) < 1e-14:
                break
            step = np.linalg.solve(df, f)
            v = v - step
            if np.max(np.abs(step)) < 1e-13:
                break
        good = np.max(np.abs(_residual(r, v)[0])) < 1e-11 and np.all(v > 0.0) and v[1] * v[2] > (r.kappa * v[0]) ** 2
        if good and not any(np.allclose(v, w, rtol=1e-7, atol=0.0) for w in found):
            found.append(v)
    return found
