"""A free body with blades that differ: mass centre and nutation of a run, and closed forms of straight blades."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from evolvent import closed_forms
from evolvent_base.errors import InputError
from evolvent_papers.heliogyro.case import Case
from evolvent_papers.heliogyro.straight import rotor, straight_inertia

if TYPE_CHECKING:
    from evolvent.results.observe import View

Array = np.ndarray


class Rigid(NamedTuple):
    """Body and straight blades as one rigid body, body axes.

    Attributes
    ----------
    mass : float, kg, of all
    centre : (nt, 3) float, m, of mass, from that of the body
    inertia : (nt, 3, 3) float, kg m2, about the common centre of mass
    """

    mass: float
    centre: Array
    inertia: Array


def directions(case: Case) -> tuple[Array, Array]:
    """Axes X_k, outwards, and Y_k of all spools, body axes: (blades, 3) each."""
    turn = 2.0 * np.pi * np.arange(case.body.blades) / case.body.blades
    zero = np.zeros_like(turn)
    return np.stack([np.cos(turn), np.sin(turn), zero], axis=1), np.stack([-np.sin(turn), np.cos(turn), zero], axis=1)


def rigid(case: Case, lengths: Array, lags: Array | float = 0.0) -> Rigid:
    r"""Body and straight blades at right angles to the spin axis, as one rigid body.

    Parameters
    ----------
    lengths : (nt, blades) float, m, that are out
    lags : (nt, blades) float, rad, in the plane of the spin

    Notes
    -----
    A blade of mass m and of the first and second moments S and I along d, from its departure point p, has
    \int x x^T dm = m p p^T + S (p d^T + d p^T) + I d d^T. Wound thread is a ring at its spool.
    """
    X, Y = directions(case)
    own = case.body.inertia if isinstance(case.body.inertia, tuple) else (case.body.inertia,) * 3
    sense = 1.0 if case.body.rate >= 0.0 else -1.0
    lag = sense * np.broadcast_to(lags, lengths.shape)[..., None]
    d = np.cos(lag) * X - np.sin(lag) * Y
    r, reel = case.spool.radius, case.body.spool_offset * X
    p = reel + r * np.array([0.0, 0.0, 1.0])
    m, S, second = closed_forms.blade_moments(rotor(case), lengths)
    wound = case.blade.line_density * (case.blade.length - lengths)
    mass = float(case.body.mass or 0.0) + float((m + wound)[0].sum())
    centre = (np.einsum("tk,ka->ta", m, p) + np.einsum("tk,tka->ta", S, d) + np.einsum("tk,ka->ta", wound, reel)) / mass
    pd = np.einsum("tk,ka,tkb->tab", S, p, d)
    square = np.einsum("tk,ka,kb->tab", m, p, p) + pd + pd.swapaxes(1, 2) + np.einsum("tk,tka,tkb->tab", second, d, d)
    square += np.einsum("tk,ka,kb->tab", wound, reel, reel) - mass * np.einsum("ta,tb->tab", centre, centre)
    inertia = np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(3) - square + np.diag(own)
    ring = 0.5 * np.einsum("tk,kab->tab", wound * case.spool.square(lengths), np.eye(3) + np.einsum("ka,kb->kab", Y, Y))
    return Rigid(mass, centre, inertia + ring)


def principal_tilt(inertia: Array) -> Array:
    """Angle between Z and the principal axis nearest to it, rad: (nt,) of inertias (nt, 3, 3); NaN of one with NaN."""
    known = np.isfinite(inertia).all(axis=(1, 2))
    found = np.full(known.size, np.nan)
    _, axes = np.linalg.eigh(inertia[known])
    found[known] = np.arccos(np.minimum(np.abs(axes[:, 2, :]).max(axis=1), 1.0))
    return found


def steady_lags(case: Case, lengths: Array, speeds: Array) -> Array:
    r"""Lag of straight blades in quasi-steady pay-out, rad: (nt, blades) of lengths (m) and speeds (m/s).

    NaN where there is none: without spin, or with a sine that is not below 1.

    Notes
    -----
    Moments about the departure point, with S and I of what is out and W' of the straight blades' moment of inertia:
    L0 S W^2 sin(lag) = 2 v W S + (I + L0 S) W'. At constant W, sin(lag) = 2 v/(L0 W).
    """
    rho, tip, L0 = case.blade.line_density, case.blade.tip_mass, case.body.spool_offset
    inertia = straight_inertia(case, lengths, corrected=True)
    rate = abs(case.body.rate) * inertia[0] / inertia
    grows = speeds * (rho * ((L0 + lengths) ** 2 - L0**2) + 2.0 * tip * (L0 + lengths))
    slows = (-rate * grows.sum(axis=1) / inertia)[:, None]
    _, S, second = closed_forms.blade_moments(rotor(case), lengths)
    ratio = np.divide(second, S, out=np.zeros_like(S), where=S > 0.0)
    pull = L0 * rate[:, None] ** 2
    load = 2.0 * speeds * rate[:, None] + (ratio + L0) * slows
    sine = np.divide(load, pull, out=np.full_like(load, np.nan), where=np.abs(load) < pull)
    return np.asarray(np.arcsin(sine))


def thread_nutation(case: Case, lengths: Array, lags: Array | float = 0.0) -> Array:
    r"""Angle between Z and the axis about which body and straight threads turn steadily, rad: (nt,).

    Notes
    -----
    A thread does not keep its angle to the body: it lies across the axis of rotation n = Z + nu, so that
    d_z = -d . nu, and pulls with T = W^2 (m L0 cos(lag) + S) at Q = (Q_x, Q_y, r). Euler's equations of the body alone
    (A, B, C) are then, to first order in nu, with the sums over the blades and t = T/W^2::

        sum t Q_x (d_x nu_x + d_y nu_y) + (C - A) nu_x = -r sum t d_x
        sum t Q_y (d_x nu_x + d_y nu_y) + (C - B) nu_y = -r sum t d_y

    NaN where nothing holds the body about an axis: with C = B and two blades along X.
    """
    X, Y = directions(case)
    A, B, C = case.body.inertia if isinstance(case.body.inertia, tuple) else (case.body.inertia,) * 3
    lag = np.broadcast_to(lags, lengths.shape)[..., None] * (1.0 if case.body.rate >= 0.0 else -1.0)
    d, Q = (np.cos(lag) * X - np.sin(lag) * Y)[..., :2], case.body.spool_offset * X[:, :2]
    m, S, _ = closed_forms.blade_moments(rotor(case), lengths)
    pull = (m * case.body.spool_offset * np.cos(lag[..., 0]) + S)[..., None]
    K = np.einsum("tka,tkb->tab", pull * Q, d) + np.diag([C - A, C - B])
    load = -case.spool.radius * (pull * d).sum(axis=1)
    held = np.abs(np.linalg.det(K)) > 1e-12 * np.abs(K).max(axis=(1, 2)) ** 2
    nu = np.linalg.solve(np.where(held[:, None, None], K, np.eye(2)), load[..., None])[..., 0]
    return np.asarray(np.where(held, np.arctan(np.linalg.norm(nu, axis=1)), np.nan))


def rate_difference(case: Case) -> float:
    """Difference between the largest and the least `spool.rate`, over the largest size of one; NaN where all are 0."""
    rates = np.asarray(case.spool.rate, dtype=float)
    size = float(np.abs(rates).max())
    return float(np.ptp(rates)) / size if size > 0.0 else float("nan")


def largest_difference(case: Case, nutation: float) -> float:
    """Share by which the last blade may be paid out more slowly, by `thread_nutation` when the others are all out.

    Parameters
    ----------
    nutation : float, rad, above 0

    Raises
    ------
    InputError
        If the case has one blade, no constant rate, thread out at the start or a film's thickness, or if no difference
        leads to that nutation.
    """
    rates = np.broadcast_to(np.asarray(case.spool.rate if case.spool.rate is not None else 0.0), case.body.blades)
    fastest = float(rates.max())
    if case.body.blades < 2:
        raise InputError("body.blades is 1; a difference of rates needs at least 2 blades")
    if not fastest > 0.0 or case.spool.changes or case.body.motion != "free":
        raise InputError("the largest difference of rates needs body.motion 'free' and a spool.rate above 0 without "
                         "spool.changes")  # fmt: skip
    for key in ("start_length", "film_thickness"):
        if getattr(case.spool, key) > 0.0:
            value = getattr(case.spool, key)
            raise InputError(f"spool.{key} is {value:g} m; the largest difference of rates needs 0")

    def excess(share: float) -> float:
        part = np.append(np.ones(case.body.blades - 1), 1.0 - share)
        lengths = np.stack([np.zeros_like(part), case.blade.length * part])
        lags = steady_lags(case, lengths, case.spool.radius * fastest * part)
        return float(thread_nutation(case, lengths, lags)[-1]) - nutation

    shares = np.linspace(0.0, 1.0, 101)
    above = np.flatnonzero([excess(share) >= 0.0 for share in shares])
    if not above.size or above[0] == 0:
        raise InputError(f"nutation is {nutation!r} rad; it must be above 0, and one that a difference of rates causes")
    return float(scipy.optimize.brentq(excess, shares[above[0] - 1], shares[above[0]]))


def variables(case: Case, view: View, blades: list[dict]) -> dict[str, tuple[tuple[str, ...], Array, str, str]]:
    """Mass centre, nutation and direction of the angular momentum, of a run of a free body.

    Closed forms of straight blades are NaN where a blade has separated, and left out with `spin_up`: they take the spin
    from the angular momentum, which a torque changes.

    Parameters
    ----------
    blades : results of every blade by their names (`observe_thread`)
    """
    model, momentum, pose = view.model, view.solution.momentum, view.pose(view.index("body"))
    mass = float(case.body.mass or 0.0)
    moment, whole = mass * pose.x, mass
    for k, blade in enumerate(blades):
        row = model.threads[view.index(f"blade-{k + 1}")]
        m = np.array(model.nodes["mass"][row["node"] :][: row["n"]])
        out = blade["released"].values > 0.0
        moment = moment + np.einsum("ti,tia->ta", m * out, blade["position"].values)
        reel = np.array(row["departure"] - row["radius"] * row["normal"])
        moment = moment + (m * ~out).sum(axis=1)[:, None] * (pose.x + pose.R @ reel)
        whole += float(m.sum())
    centre = moment / whole
    H = momentum.angular - np.cross(centre, momentum.linear)
    own = np.einsum("tba,tb->ta", pose.R, H)
    size = np.maximum(np.linalg.norm(H, axis=1), 1e-300)[:, None]
    sense = 1.0 if case.body.rate >= 0.0 else -1.0
    offset = np.einsum("tba,tb->ta", pose.R, centre - pose.x)
    found = {
        "mass_centre": (("time", "axis"), offset, "m", "common centre of mass, from that of the body, body axes"),
        "nutation": (
            ("time",), _angle(own, np.array([0.0, 0.0, sense])), "rad",
            "angle between the spin axis of the body and the angular momentum of all about their centre of mass",
        ),
        "rate_nutation": (
            ("time",), _angle(H, pose.w), "rad",
            "angle between the angular velocity of the body and the angular momentum of all",
        ),
        "momentum_direction": (("time", "axis"), own / size, "1", "direction of that momentum, body axes"),
    }  # fmt: skip
    if case.spool.rate is not None and case.body.blades > 1:
        found["rate_difference"] = (
            (), np.array(rate_difference(case)), "1", "difference of the slowest spool from the fastest, of its rate",
        )  # fmt: skip
    return found if case.spin_up is not None else found | _straight(case, view, blades)


def _straight(case: Case, view: View, blades: list[dict]) -> dict[str, tuple[tuple[str, ...], Array, str, str]]:
    """Mass centre and nutation of straight blades with the lag of steady pay-out."""
    lengths = np.stack([blade["deployed_length"].values for blade in blades], axis=1)
    speeds = np.sqrt(case.spool.square(lengths)) * view.solution.observations.spool[:, :, 1]
    gone = np.any([blade["separated"].values > 0.0 for blade in blades], axis=0)
    lags = np.where(gone[:, None], np.nan, steady_lags(case, lengths, speeds))
    straight = rigid(case, lengths, lags)
    return {
        "mass_centre_straight": (("time", "axis"), straight.centre, "m", "centre of mass with straight blades"),
        "nutation_threads": (
            ("time",), thread_nutation(case, lengths, lags), "rad",
            "angle between the spin axis and the axis about which the body and straight threads turn steadily",
        ),
        "nutation_rigid": (
            ("time",), principal_tilt(straight.inertia), "rad",
            "angle between the spin axis and the principal axis of the body with rigid straight blades",
        ),
    }  # fmt: skip


def _angle(a: Array, b: Array) -> Array:
    """Angle between vectors (nt, 3), rad."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1)))
