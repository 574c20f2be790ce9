"""What a user should know of a case before it is run: how stiff its mesh is, and what may go wrong."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.systems.wrapped_rib import reference
from evolvent.systems.wrapped_rib.case import Case, Rib

#: Strain above which a run warns.
STRAIN_WARNED = 0.05
#: Part by which the bending stiffness of the mesh may be off without a warning.
STIFFNESS_OFF = 0.05
#: Depth, of the hub's radius, to which a rib may sink into it without a warning.
SUNK_WARNED = 0.01
#: Share of RK4's stability limit that an explicit method takes of itself. Where the last bit of a rib whips onto the
#: hub, dissipation makes the contact stiffer: 0.42 loses the energy balance there, 0.2 keeps it within 0.6 % of the
#: energy, 0.1 within 0.1 %.
SHARE = 0.1
#: Depth of a contact, of the hub's radius, at which a law with an exponent above 1 counts under explicit methods.
DEEP = 1e-3
#: Spectral radius above which a run with contact warns.
SPECTRAL_RADIUS_WARNED = 0.8


def locking(case: Case) -> tuple[float, str]:
    """How much stiffer the mesh is than the rib when it lies on the hub, and what to say about it.

    Returns
    -------
    ratio : float
        Effective over true bending stiffness of one element (of a taper, the thinnest) bent to the hub's radius.
    warning : str, '' while the ratio is near 1

    Notes
    -----
    The nodes' directions are held at those of the arc; the chord and the lengths of slopes and directors, the same at
    both nodes, go where the energy is least. True is EI l / (2 R^2).
    """
    ratio = bending_stiffness_ratio(case)
    rib = case.rib
    angle = math.degrees(rib.element_length / case.hub.radius)
    if abs(ratio - 1.0) <= STIFFNESS_OFF:
        return ratio, ""
    off = f"{ratio:.3g}" if ratio < 100.0 else f"{ratio:.2e}"
    text = (
        f"bent to the hub's radius, the mesh is {off} times as stiff as the rib: each of {rib.elements} "
        f"{rib.formulation} elements "
        f"spans {angle:.3g} deg; take more elements"
    )
    if rib.formulation not in ("cable", "cable_stretch", "assumed_strain"):
        text += ", or rib.formulation: cable"
    return ratio, text


def bending_stiffness_ratio(case: Case) -> float:
    """Effective over true bending stiffness; see `locking`."""
    rib, R = case.rib, case.hub.radius
    thinnest = _thinnest(rib)
    section = rib.section(thinnest)
    ends = [section.at(xi).properties(rib.poisson).Iz for xi in (0.0, 0.5, 1.0)]
    EI = rib.young_modulus * (ends[0] + 4.0 * ends[1] + ends[2]) / 6.0
    energy, _ = bent_element(case, rib.element_length / R)
    return energy / float(0.5 * EI * rib.element_length / R**2)


def _thinnest(rib: Rib) -> int:
    return 0 if rib.tip_thickness is None or rib.tip_thickness > rib.thickness else rib.elements - 1


def bent_element(case: Case, angle: float) -> tuple[float, np.ndarray]:
    """Least energy (J) of the thinnest element whose ends' directions differ by `angle`, and its sizes there.

    Returns
    -------
    energy : float
    sizes : (2,) or (4,) float
        Chord (m), length of both slopes, and of a beam those of both y and of both z directors.
    """
    rib, half = case.rib, 0.5 * angle
    c, s = math.cos(half), math.sin(half)
    every = np.zeros((8, 3, 4))  # of nodal vectors, coordinates and sizes
    every[4, 0, 0] = 1.0
    every[1, :2, 1], every[5, :2, 1] = (c, -s), (c, s)
    every[2, :2, 2], every[6, :2, 2] = (s, c), (-s, c)
    every[3, 2, 3] = every[7, 2, 3] = 1.0
    B = (every[[0, 1, 4, 5], :, :2] if rib.vectors == 2 else every).reshape(3 * 2 * rib.vectors, -1)
    of = _energy(rib, _thinnest(rib))
    return _least(lambda p: of(B @ p), np.array([rib.element_length * s / half, *np.ones(B.shape[1] - 1)]))


def _least(energy: Callable[[np.ndarray], Any], p: np.ndarray) -> tuple[float, np.ndarray]:
    """Least value of an analytic function of p, and where it is: Newton's method, steps that always descend."""
    for _ in range(100):
        slope, K = _derivatives(energy, p, 1e-6 * np.abs(p))
        values, vectors = np.linalg.eigh(K * np.outer(p, p))  # of relative changes
        change = -p * (vectors @ ((vectors.T @ (p * slope)) / np.abs(values)))
        while np.abs(change / p).max() > 1e-6 and energy(p + change) > energy(p):  # smaller ones: below round-off
            change *= 0.5
        p = p + change
        if np.abs(change / p).max() < 1e-13:
            break
    return float(energy(p)), p


def _derivatives(energy: Callable[[np.ndarray], Any], p: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First derivatives of an analytic function by complex steps, without round-off, and second ones by differences."""
    unit = np.eye(p.size)

    def slope(p: np.ndarray) -> np.ndarray:
        return np.array([1e30 * energy(p + 1e-30j * e).imag for e in unit])

    K = np.array([(slope(p + h * e) - slope(p - h * e)) / (2.0 * h) for h, e in zip(step, unit, strict=True)])
    return slope(p), 0.5 * (K + K.T)


@functools.lru_cache(maxsize=8)
def _energy(rib: Rib, element: int) -> Callable[[np.ndarray], Any]:
    """Strain energy of an element as an analytic function of its coordinates."""
    from evolvent import elements
    from evolvent.elements.forms import nodal_vectors, products

    arguments = (rib.element_length, rib.section(element), rib.material)
    if rib.formulation == "cable_stretch":
        H, h, _ = dataclasses.astuple(elements.cable_stretch_form(*arguments))

        def stretched(e: np.ndarray) -> Any:
            v = nodal_vectors(e)
            a, q = H[:3, :3] @ v, H[:3, 3:] @ v
            square, turn = np.sum(a * a, axis=1), np.cross(a, q)
            bent = np.sum(turn * turn, axis=1) / square**2
            return 0.5 * np.sum(H[3, :3] * (np.sqrt(square) - h[:3]) ** 2 + H[3, 3:] * bent)

        return stretched
    make = elements.cable_form if rib.formulation == "cable" else functools.partial(elements.beam_form, rib.formulation)
    form = make(*arguments)

    def quadratic(e: np.ndarray) -> Any:
        g = products(e)
        return 0.5 * g @ form.H @ g - form.h @ g + form.U0

    return quadratic


def explicit_step(case: Case) -> float:
    """Step of an explicit method, s: the one given, or about what it will choose, known without compiled code.

    Notes
    -----
    The highest frequency of all elements together is at most that of one alone (Rayleigh), here the straight one with
    all its contact points in contact; the penalties are about as fast.
    """
    from evolvent.solvers.drive import METHODS, SAFETY
    from evolvent.solvers.stability import Mode, stability_limit

    solver = case.solver
    if solver.step != "auto":
        return float(solver.step)
    damping, rib, contact = case.damping, case.rib, case.contact
    stiffness = contact.exponent * case.contact_stiffness * (DEEP * case.hub.radius) ** (contact.exponent - 1.0)
    squared = rate = 0.0
    for element in sorted({0, _thinnest(rib)}):
        elastic, rate_of_check, rate_of_hinge = _fastest(rib, element, stiffness, contact.points)
        squared = max(squared, elastic, rib.root_stiffness * rate_of_hinge)
        rate = max(rate, damping.alpha + damping.beta * elastic, rib.root_damping * rate_of_hinge)
        if contact.law == "paper":
            rate = max(rate, contact.damping * rate_of_check)
    mode = Mode(math.sqrt(squared), damping.alpha, "rib-1", rate)
    own = SAFETY[solver.method] * stability_limit(METHODS[solver.method], mode, case.duration)
    return min(own, SHARE * stability_limit(METHODS["rk4"], mode, case.duration))


@functools.lru_cache(maxsize=8)
def _fastest(rib: Rib, element: int, contact: float, points: int) -> tuple[float, float, float]:
    """Fastest motion of one straight element, its contact points on springs `contact` (N/m).

    Returns
    -------
    (rad/s)^2, square of the highest frequency; 1/kg, of its contact points together; 1/(kg m2), of a turn of its end
    """
    from scipy.linalg import eigh

    from evolvent import elements

    cable, length = rib.vectors == 2, rib.element_length
    e = elements.straight_cable(length) if cable else elements.straight_beam(length)
    mass = (elements.cable_mass if cable else elements.beam_mass)(length, rib.section(element), rib.material)
    _, K = _derivatives(_energy(rib, element), e, np.full(e.size, 1e-6))
    axis = [0, 1, 2, 3] if cable else [0, 1, 4, 5]  # position and slope of both nodes
    checks = np.zeros_like(mass)
    for xi in np.arange(1, points + 1) / points:
        S = elements.axis_shape(length, xi)
        checks[np.ix_(axis, axis)] += np.outer(S, S)
    across = 3 * np.arange(len(mass)) + 1
    K[np.ix_(across, across)] += contact * checks
    M = np.kron(mass, np.eye(3))
    highest = float(eigh(K, M, eigvals_only=True)[-1])
    return highest, float(eigh(checks, mass, eigvals_only=True)[-1]), float(np.linalg.inv(mass)[1, 1])


def warnings(case: Case) -> list[str]:
    """What a user should know before a run, a sentence each."""
    rib, drive, solver, damping = case.rib, case.drive, case.solver, case.damping
    found = [locking(case)[1]]
    if rib.formulation == "full" and rib.poisson != 0.0:
        factor = (1.0 - rib.poisson) / ((1.0 + rib.poisson) * (1.0 - 2.0 * rib.poisson))
        found.append(
            f"however fine the mesh, rib.formulation 'full' bends {factor:.3g} times too stiff at rib.poisson "
            f"{rib.poisson:g}; take nu_split, assumed_strain or cable"
        )
    if drive is not None and drive.torque is not None:
        strain = reference.root_strain(case.strip, drive.torque)
        if strain > STRAIN_WARNED:
            found.append(
                f"drive.torque {drive.torque:g} N m stretches the wound rib's root by {100.0 * strain:.3g} %, beyond "
                f"what linear elasticity and most sections bear"
            )
    found += [_too_weak(case), _unseen(case)]
    if drive is not None and drive.kind == "tip" and drive.stretch > STRAIN_WARNED:
        found.append(f"drive.stretch {drive.stretch:g} is beyond what linear elasticity and most sections bear")
    found.append(_kink(case))
    if solver.method == "generalized-alpha":
        bounce = math.pi / case.contact_frequency
        if solver.step != "auto" and float(solver.step) > bounce:
            found.append(
                f"solver.step {solver.step:g} s is too large for the contact, on which a contact point bounces in "
                f"{bounce:.2g} s; longer steps can add energy: see energy_balance, or take step: auto"
            )
        if case.contact.law == "paper" and case.contact.damping > 0.0:
            found.append(
                "contact.law 'paper' jumps at the touch, where an implicit step may have no solution; "
                "hunt-crossley does not"
            )
        if solver.spectral_radius > SPECTRAL_RADIUS_WARNED:
            found.append(
                f"solver.spectral_radius {solver.spectral_radius:g} keeps the ringing of the contact; about 0.3 serves "
                f"better"
            )
    if damping.beta > 0.0 and damping.kind == "paper":
        found.append("damping.kind 'paper' acts on rotations: a spinning rib gains or loses energy by damping.beta")
    return [text for text in found if text]


def _too_weak(case: Case) -> str:
    """A torque whose work, T for each radian wound, does not pay for the bending, EI/(2 R) of the mesh as it is."""
    drive, strip = case.drive, case.strip
    if drive is None or drive.kind != "torque" or drive.torque is None or case.phase != "wind":
        return ""
    needed = bending_stiffness_ratio(case) * strip.bending_stiffness / (2.0 * strip.radius)
    if drive.torque > needed:
        return ""
    return (
        f"drive.torque {drive.torque:g} N m does not wind this rib all round: to bend it onto the hub takes EI/(2 R) = "
        f"{needed:.3g} N m, EI of the mesh"
    )


def _unseen(case: Case) -> str:
    """Contact points so far apart that a straight rib between two of them sinks in: R - sqrt(R^2 - s^2/4)."""
    R, half = case.hub.radius, 0.5 * case.contact_spacing
    depth = R - math.sqrt(R * R - half * half)
    if depth <= SUNK_WARNED * R:
        return ""
    return (
        f"contact points of the contact are {2.0 * half:.3g} m apart, between which the rib may sink {depth:.2g} m "
        f"into the hub unseen; take more contact.points"
    )


def _kink(case: Case) -> str:
    """A clamp that does not point along the tangent bends the rib within a length that elements do not see."""
    drive, rib = case.drive, case.rib
    if rib.root != "clamp" or case.begins != "straight" or drive is None or drive.torque is None:
        return ""
    turned = 0.5 * math.pi - rib.start_angle
    size = math.sqrt(case.strip.bending_stiffness * case.hub.radius / drive.torque)
    if turned < 0.1 or size > rib.element_length:
        return ""
    return (
        f"the clamp stands {math.degrees(turned):.3g} deg from the hub's tangent, to which the tension bends the rib "
        f"within {size:.2g} m, less than an element's {rib.element_length:.2g} m; take rib.root: hinge, or "
        f"rib.start_angle: 90 deg"
    )
