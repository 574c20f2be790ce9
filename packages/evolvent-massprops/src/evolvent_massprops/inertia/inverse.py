"""Mass, centre of mass and inertia of a body from how it vibrates on its springs: four methods."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent_base.errors import InputError, nearest
from evolvent_massprops.identification import IdentifiedModes
from evolvent_massprops.inertia.least_squares import finish, solve, starts
from evolvent_massprops.inertia.linear_equations import refuse_mass, six_mode_properties, vertical_properties
from evolvent_massprops.inertia.problem import BODY_NAMES, problem
from evolvent_massprops.inertia.stand import Body, Stand
from evolvent_massprops.inertia.statics import Pose
from evolvent_massprops.inertia.three_frequencies import candidates
from evolvent_massprops.inertia.uncertainty import Inertia

#: Methods of `from_modes`.
WAYS = ("fit", "three-frequencies", "shapes", "six-modes")


def from_modes(
    stand: Stand,
    body: Body,
    modes: IdentifiedModes,
    *,
    way: str = "fit",
    points: Any,
    directions: Any = (0.0, 1.0, 0.0),
) -> Inertia:
    """Mass properties from the identified modes of sensors on the body, with their covariance.

    Parameters
    ----------
    stand, body : Stand, Body
        What is known. "three-frequencies" and "fit" take mass, centre of mass, Iyy and the products as known, and of
        the stand the geometry and the ratios of the stiffnesses: the stiffness itself cancels. "shapes" and "six-modes"
        know the stiffness and find mass and centre of mass too. Moments that are to be found are not used.
    modes : evolvent_massprops.identification.IdentifiedModes, of displacements
    way : {"fit", "three-frequencies", "shapes", "six-modes"}
        `from_three_frequencies`, or the least squares that start from it ("fit": at the tilted equilibrium);
        `from_shapes`; `from_six_modes`.
    points, directions : (s, 3) float, m and level axes, of the sensors

    Returns
    -------
    Inertia

    Raises
    ------
    InputError
        If another number of modes is needed, or they do not determine the unknowns.
    """
    if way not in WAYS:
        raise InputError(f"way is {way!r}; {nearest(str(way), WAYS)}")
    points, wanted = np.asarray(points, dtype=float), 6 if way == "six-modes" else 3
    directions = np.broadcast_to(np.asarray(directions, dtype=float), points.shape)
    if modes.order != wanted and way != "shapes":
        raise InputError(
            f"{modes.order} modes were identified, but `way` {way!r} takes {wanted}; set `order`, or see why the "
            f"signals show another number"
        )
    found, own = modes.mode_shapes(), modes.natural_frequency_covariance
    covariance = own if np.all(np.isfinite(own)) else None
    frequency, shapes = modes.natural_frequency, found.real
    if way in ("shapes", "six-modes"):
        known = np.all(np.isfinite(found.shape_covariance))
        options: dict[str, Any] = {
            "shapes": shapes, "points": points, "frequency_covariance": covariance,
            "shape_covariance": found.shape_covariance if known else None,
        }  # fmt: skip
        if way == "shapes":
            return from_shapes(stand, body, frequency, model="full", **options)
        return from_six_modes(stand, body, frequency, directions=directions, **options)
    seen: dict[str, Any] = {}
    if not np.any(directions - (0.0, 1.0, 0.0)):  # only vertical amplitudes distinguish the candidates
        seen = {"shapes": shapes, "points": points}
    first = from_three_frequencies(stand, body, frequency, frequency_covariance=covariance, **seen)
    if way == "three-frequencies":
        return first
    near = dataclasses.replace(
        stand, stiffness=stand.stiffness * (first["stiffness"] / float(np.mean(stand.stiffness)))
    )
    begin = dataclasses.replace(body, inertia=first.tensor)
    p = problem(near, begin, ("stiffness", "Ixx", "Izz"), frequency, frequency_covariance=covariance)
    return solve(
        p, "least squares", [p.initial_estimate]
    )  # from this root alone: the others fit the frequencies as well


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
        Where no body has these frequencies, or several and no shapes show which.
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
        warnings.append(f"the shapes hardly distinguish the candidates: MAC {best.mac:.4f} and {found[1].mac:.4f}")
    values = np.array([best.stiffness, best.Ixx, best.Izz])
    return finish(p, values, "three frequencies", inputs=inputs, found=found, warnings=warnings)


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
    `fit`, which weights frequencies and shapes by their covariances.
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
    at_springs: Sequence[int] = (),
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
    frequency_covariance : (m, m) float, optional; 1e-5 of each frequency weights the data if left out
    shapes : (m, s) float, optional, amplitudes of each mode at the sensors, to any scale
    shape_covariance : (m, s, s) float, optional; 1 % of each shape's largest amplitude if left out
    points, directions : (s, 3) float, m and level axes, of the sensors; vertical if left out
    model : {"full", "vertical"}
        `linear_model`, about the true equilibrium, or Belyakov's `vertical_model`.
    release : ((3,), (3,)) float, optional
        Force, N, level axes, that was released, and where, m, body axes. The shapes are then true amplitudes in metres,
        and separate mass and stiffness. Without it their scale is free.
    prior : mapping of str to (value, standard deviation), optional
        Unknowns that were also measured otherwise, such as the mass.
    inputs : mapping of str to float, optional
        Standard deviations of what is taken as known; see `with_budget`.
    at_springs : (s,) sequence of int, optional
        Number of the spring, from 0, at whose end each sensor sits, wherever that is; -1 for a sensor at its point.

    Returns
    -------
    Inertia

    Raises
    ------
    InputError
        Where the data do not determine the unknowns (it names which), no body fits, or the body found is none.

    Notes
    -----
    Levenberg-Marquardt on the residual of `InertiaProblem`, whitened by the covariances. With shapes it starts from
    the best of: the given body, the candidates of three frequencies, the linear solutions from shapes of three or six
    modes. Without shapes it starts from the given body, and where other bodies have the same frequencies a warning
    reports it.
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
        at_springs=at_springs,
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
