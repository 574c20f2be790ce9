"""Film blades whose edgewise bending buckles them while they are paid out; see `evolvent.closed_forms`.

A film of the width w and the thickness h is paid out at the rate v from a body that turns freely, as far as the length
l. It is straight but for small deflections, its sections keep their shape, and the motion is steady but for the slow
growth of l. Momentum H kept, W = H / J_t with J_t of `rotor_inertia`. In the frame of the body the forces per length

    q(s) = rho (2 W v - a (L0 + s)),   a = -W' = W v J_t'(l) / J_t,

of Coriolis (behind) and of the falling spin (ahead) act in the plane of the spin at the distance s from the root, and
m_k (2 W v - a (L0 + l)) on the tip mass, and the tension is

    N(s) = W^2 [rho ((L0 + l)^2 - (L0 + s)^2) / 2 + m_k (L0 + l)].

On a root that turns freely in the plane ("free") the blade lags as a thread does (`payout_lag`), and what is left of
the load bends it between its ends. A root that keeps its direction, as film on a roll does ("held"), takes a moment.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from evolvent.closed_forms.blades import Rotor, blade_moments, rotor_inertia

Array = np.ndarray
Root = Literal["free", "held"]
#: Points of the Gauss-Legendre quadrature, and places at which the largest moment is looked for.
_POINTS, _PLACES = 96, 2000


class Film(NamedTuple):
    """Section of a film.

    Attributes
    ----------
    width, thickness : float, m, w and h
    young_modulus : float, Pa, E
    poisson_ratio : float
    """

    width: float
    thickness: float
    young_modulus: float
    poisson_ratio: float

    @property
    def edgewise(self) -> float:
        """Bending stiffness in the plane of the film, E h w^3 / 12, N m2."""
        return self.young_modulus * self.thickness * self.width**3 / 12.0

    @property
    def flatwise(self) -> float:
        """Bending stiffness out of the plane of the film, E w h^3 / 12, N m2."""
        return self.young_modulus * self.width * self.thickness**3 / 12.0

    @property
    def torsion(self) -> float:
        """Torsional stiffness without tension, G w h^3 / 3, N m2."""
        return 2.0 * self.flatwise / (1.0 + self.poisson_ratio)

    @property
    def gyration(self) -> float:
        """Radius of gyration of the chord, w / sqrt(12), m."""
        return self.width / math.sqrt(12.0)


class _Blade(NamedTuple):
    """What a rate of 1 m/s does to a blade: W, a / v, and functions of the places s by the formulas above."""

    rotor: Rotor
    length: float
    spin: float
    slowing: float

    def tension(self, s: Array) -> Array:
        rho, tip, out, L0 = self.rotor.line_density, self.rotor.tip_mass, self.length, self.rotor.offset
        return np.asarray(self.spin**2 * (0.5 * rho * ((L0 + out) ** 2 - (L0 + s) ** 2) + tip * (L0 + out)))

    def load(self, s: Array) -> Array:
        """Acceleration of the load q / rho, m/s2 for 1 m/s."""
        return np.asarray(2.0 * self.spin - self.slowing * (self.rotor.offset + s))

    def rigid_moment(self, s: Array, root: Root) -> Array:
        """Moment at s of the load on a straight blade, N m for 1 m/s; on a free root without what turns it."""
        rho, tip, rest = self.rotor.line_density, self.rotor.tip_mass, self.length - s
        first = 0.5 * rho * rest**2 + tip * rest
        second = rho * rest**2 * (2.0 * self.length + s) / 6.0 + tip * self.length * rest
        uniform = float(self.load(np.zeros(())))
        if root == "free":
            _, S, I = blade_moments(self.rotor, self.length)  # noqa: E741
            uniform = self.slowing * I / S
        return np.asarray(uniform * first - self.slowing * second)


def _blade(rotor: Rotor, length: float, momentum: float) -> _Blade:
    inertia = float(rotor_inertia(rotor, length))
    spin = momentum / inertia
    growth = rotor.line_density * (length + rotor.offset) ** 2 + 2.0 * rotor.tip_mass * (length + rotor.offset)
    return _Blade(rotor, length, spin, spin * rotor.blades * growth / inertia)


def payout_buckling(film: Film, rotor: Rotor, length: float, momentum: float, *, root: Root = "free") -> float:
    r"""Largest rate at which a film blade is paid out without buckling by twist, m/s: an estimate.

    Parameters
    ----------
    film : Film, section of the blades
    rotor : Rotor, the body and its blades
    length : float, m, that is out
    momentum : float, kg m2/s, angular momentum of body and blades, H
    root : "free" or "held", whether the root turns in the plane of the spin; its pitch is kept

    Returns
    -------
    float, m/s

    Notes
    -----
    Derived here. M = v R m(s): m is the moment of the load on a straight blade, and R a share that bending leaves of
    it, by Galerkin's method with the deflection y that m causes,

        R = 1 / (1 + K_N / K_B),   K_B = int m^2 / EI ds,   K_N = int N y'^2 - rho W^2 y^2 ds - m_k W^2 y(l)^2 .

    A fibre at the distance z from the axis has the tension N / w + 12 M z / w^3 per width and, with the deflection f
    out of the plane and the twist u of the section, the slope f' + z u'. Without bending stiffness out of the plane
    the equation of f is N f' = (M u)', and with it the second variation of the energy is

        1/2 int (G J + N r^2) u'^2 + rho r^2 W^2 u^2 - (M u)'^2 / N - M^2 u^2 / EI ds,   r = w / sqrt(12):

    torsion and tension against twist, the centrifugal moment that turns the chord into the plane of the spin, the
    moment, and the effect of the deflection in the plane. It is not positive for every u from

    - M^2 = N (G J + N r^2) at some place on: short waves there. At a held root R = 1, since its moment is that
      of the load;
    - the rate at which it vanishes for u = sin(pi s / 2 l): a wave as long as the blade (Rayleigh's quotient).

    The estimate is the lower of both rates. On a free root it is above the result of Ritz's method, by which
    `payout_buckling_modes` solves the same problem, by up to 5 %, without a tip mass by 8 %; where R is below 0.6 it
    may be 3 % below. On a held root whose limit is that of short waves it is lower, by up to 10 %.

    A held root on a body whose spin does not change, L0 << l: M / N = 2 v / W at the root whatever the length, and v =
    r W / 2; on a light body the spin falls by J/J_t as M does, so that v = r W0 / 2 with the spin W0 = H / J of the
    start. A free root on a light body, no tip mass, a stiff strip: m / N = (v / W) s (l - s) / (l (l + s)), and v is a
    multiple of r W, by Ritz's method 4.97, whatever length, modulus and thickness.

    Limits: sections keep their shape. A film that nothing keeps flat wrinkles along an edge before
    (`payout_slack`). Waves must be longer than the width.
    """
    blade = _blade(rotor, length, momentum)
    s = np.linspace(0.0, length, _PLACES, endpoint=False)
    N, m = blade.tension(s), blade.rigid_moment(s, root)
    share = _share(film, blade, root)
    resistance = film.torsion + N * film.gyration**2
    short = 1.0 / float(np.sqrt(m**2 / (N * resistance)).max() * (share if root == "free" else 1.0))
    u, du = np.sin(0.5 * math.pi * s / length), 0.5 * math.pi / length * np.cos(0.5 * math.pi * s / length)
    kept = resistance * du**2 + rotor.line_density * (film.gyration * blade.spin * u) ** 2
    lost = np.gradient(m * u, s) ** 2 / N + (m * u) ** 2 / film.edgewise
    return min(short, math.sqrt(float(kept.sum() / lost.sum())) / share)


def payout_slack(film: Film, rotor: Rotor, length: float, momentum: float, *, root: Root = "free") -> float:
    """Rate of pay-out from which on an edge of the blade has no tension left at some place, m/s.

    Parameters
    ----------
    film : Film, section of the blades
    rotor : Rotor, the body and its blades
    length, momentum, root : as of `payout_buckling`

    Returns
    -------
    float, m/s

    Notes
    -----
    M = N w / 6, a factor of sqrt(3) below that of short waves of twist in `payout_buckling`. A film without stiffness
    out of its plane begins to wrinkle along that edge. M is that of `payout_buckling`.
    """
    blade = _blade(rotor, length, momentum)
    s = np.linspace(0.0, length, _PLACES, endpoint=False)
    ratio = float((np.abs(blade.rigid_moment(s, root)) / blade.tension(s)).max())
    return film.width / 6.0 / (ratio * (_share(film, blade, root) if root == "free" else 1.0))


def _share(film: Film, blade: _Blade, root: Root) -> float:
    """R of `payout_buckling`."""
    rotor, length = blade.rotor, blade.length
    s = np.linspace(0.0, length, _PLACES + 1)
    m, N = blade.rigid_moment(s, root), blade.tension(s)
    slope = _integral(m / film.edgewise, s)
    y = _integral(slope, s)
    if root == "free":
        turn = (rotor.line_density * _integral(s * y, s)[-1] + rotor.tip_mass * length * y[-1]) / blade_moments(
            rotor, length
        )[2]
        slope, y = slope - turn, y - turn * s
    pulled = _integral(N * slope**2 - rotor.line_density * blade.spin**2 * y**2, s)[-1]
    pulled -= rotor.tip_mass * blade.spin**2 * y[-1] ** 2
    return float(1.0 / (1.0 + pulled / _integral(m**2 / film.edgewise, s)[-1]))


def _integral(values: Array, s: Array) -> Array:
    """Integral from 0 to each place by trapezoids."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(s))])


def payout_buckling_modes(
    film: Film, rotor: Rotor, length: float, momentum: float, *, root: Root = "free", terms: int = 16
) -> float:
    """Rate of pay-out at which a film blade buckles by twist, m/s, by Ritz's method: `payout_buckling` is its estimate.

    Parameters
    ----------
    film : Film, section of the blades
    rotor : Rotor, the body and its blades
    length, momentum, root : as of `payout_buckling`
    terms : int, polynomials of each deflection; waves that are shorter are left out

    Returns
    -------
    float, m/s

    Notes
    -----
    Deflection in the plane under the load with bending stiffness and tension, then `lateral_buckling`, with the
    moment rho r^2 W^2 u against twist. The root is a hinge out of the plane and keeps its pitch. The result falls with
    the number of terms towards the limit of short waves.
    """
    blade = _blade(rotor, length, momentum)
    x, weight = _quadrature(length)
    N, rho, tip = blade.tension(x), rotor.line_density, rotor.tip_mass
    f, df, ddf = _basis(x, length, terms, 2 if root == "held" else 1)
    end = _basis(np.array([length]), length, terms, 2 if root == "held" else 1)[0][:, 0]
    K = (ddf * weight * film.edgewise) @ ddf.T + (df * weight * N) @ df.T
    K -= blade.spin**2 * ((f * weight * rho) @ f.T + tip * np.outer(end, end))
    load = (f * weight * rho) @ blade.load(x) + tip * float(blade.load(np.array(length))) * end
    M = film.edgewise * (np.linalg.solve(K, load) @ ddf)
    stiffening = rho * (film.gyration * blade.spin) ** 2
    return lateral_buckling(film, length, M, tension=N, stiffening=stiffening, terms=terms)


def lateral_buckling(
    film: Film, length: float, moment: Array, *, tension: Array | float = 0.0, stiffening: float = 0.0,
    clamped: bool = False, terms: int = 16,
) -> float:  # fmt: skip
    """Factor of an edgewise moment at which a strip under tension buckles by bending out of its plane and twist.

    Parameters
    ----------
    film : Film, section of the strip
    length : float, m, of the strip
    moment, tension : (96,) float, N m and N, at the places of `buckling_places`
    stiffening : float, N, moment against twist per angle and length
    clamped : bool, whether the root is clamped out of the plane; else it is a hinge. Its pitch is kept, the tip is free
    terms : int, polynomials of each deflection

    Returns
    -------
    float
        What the moment is multiplied by, above 0.

    Notes
    -----
    Loads act at the axis and keep their direction. With f out of the plane and the twist u of the section

        int EI_f f''^2 + N f'^2 + (G J + N r^2) u'^2 + c u^2 + 2 M f'' u - M^2 u^2 / EI ds

    is made stationary; the last term is the effect of the deflection in the plane. Without tension and with EI much
    above EI_f it has the factors of Michell (1899) and Prandtl (1899): q l^3 = 12.85 sqrt(EI_f G J) and F l^2 = 4.013
    sqrt(EI_f G J).
    """
    x, weight = _quadrature(length)
    N = np.broadcast_to(np.asarray(tension, dtype=float), x.shape)
    _, df, ddf = _basis(x, length, terms, 2 if clamped else 1)
    u, du, _ = _basis(x, length, terms, 1)
    bending = (ddf * weight * film.flatwise) @ ddf.T + (df * weight * N) @ df.T
    twist = (du * weight * (film.torsion + N * film.gyration**2)) @ du.T + (u * weight * stiffening) @ u.T
    mixed = (ddf * weight * moment) @ u.T
    loss = mixed.T @ np.linalg.solve(bending, mixed) + (u * weight * moment**2 / film.edgewise) @ u.T
    lower = np.linalg.cholesky(twist)
    scaled = np.linalg.solve(lower, np.linalg.solve(lower, loss).T)
    return float(1.0 / math.sqrt(np.linalg.eigvalsh(scaled)[-1]))


def buckling_places(length: float) -> Array:
    """Places along the strip at which `lateral_buckling` takes moment and tension, (96,) float, m.

    Parameters
    ----------
    length : float, m, of the strip

    Returns
    -------
    (96,) float, m, from the root

    Notes
    -----
    Points of the Gauss-Legendre quadrature over the length.
    """
    return _quadrature(length)[0]


def _quadrature(length: float) -> tuple[Array, Array]:
    x, weight = np.polynomial.legendre.leggauss(_POINTS)
    return 0.5 * length * (1.0 + x), 0.5 * length * weight


def _basis(x: Array, length: float, terms: int, power: int) -> tuple[Array, Array, Array]:
    """Functions (x/l)^power times Legendre polynomials, (terms, nx), and their first and second derivatives."""
    z = 2.0 * np.asarray(x) / length - 1.0
    front = np.polynomial.Polynomial([0.5, 0.5]) ** power
    found: tuple[list[Array], list[Array], list[Array]] = ([], [], [])
    for k in range(terms):
        P = np.polynomial.Legendre.basis(k)
        p = [P.deriv(d)(z) if d else P(z) for d in range(3)]
        g = [front.deriv(d)(z) if d else front(z) for d in range(3)]
        found[0].append(g[0] * p[0])
        found[1].append((g[1] * p[0] + g[0] * p[1]) * 2.0 / length)
        found[2].append((g[2] * p[0] + 2.0 * g[1] * p[1] + g[0] * p[2]) * 4.0 / length**2)
    return np.array(found[0]), np.array(found[1]), np.array(found[2])
