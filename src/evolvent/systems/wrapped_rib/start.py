"""Where ribs start: straight, wound without stretch, or as a saved run left them; all seen from the hub's axes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from evolvent.errors import InputError
from evolvent.motion import rotation_matrices
from evolvent.systems.wrapped_rib.advice import bent_element
from evolvent.systems.wrapped_rib.case import Case


@dataclasses.dataclass(frozen=True, kw_only=True)
class HubState:
    """Where the hub is: position, quaternion, velocity (inertial), angular velocity (body axes), angle about z."""

    position: np.ndarray
    quaternion: np.ndarray
    velocity: np.ndarray
    rate: np.ndarray
    angle: float


class Start(NamedTuple):
    """What a run starts from.

    Attributes
    ----------
    nodes : (ribs, n + 1, vectors, 3) float, m and 1, inertial axes
    rates : the same, m/s and 1/s
    hub : HubState
    directions : (ribs,) float, rad, of the roots' hinges at rest, from outwards
    stiffness : float, N/m^n, of the contact
    warning : str, of a run that did not end well; else empty
    """

    nodes: np.ndarray
    rates: np.ndarray
    hub: HubState
    directions: np.ndarray
    stiffness: float
    warning: str = ""


def at_rest(angle: float = 0.0) -> HubState:
    """A hub at the origin."""
    half = 0.5 * angle
    quaternion = np.array([math.cos(half), 0.0, 0.0, math.sin(half)])
    return HubState(position=np.zeros(3), quaternion=quaternion, velocity=np.zeros(3), rate=np.zeros(3), angle=angle)


def start(case: Case) -> Start:
    """The state from which a case starts.

    Raises
    ------
    InputError
        If a saved run cannot be read, or is not of such a rib.
    """
    if case.begins not in ("straight", "wound"):
        return _from_run(case)
    count, n = case.rib.count, case.rib.elements
    turns = 2.0 * np.pi * np.arange(count) / count
    one = _straight(case) if case.begins == "straight" else _wound(case)
    direction = case.first_direction if case.begins == "straight" else 0.5 * np.pi
    nodes = np.stack([_turned(one, angle) for angle in turns])
    assert nodes.shape[:2] == (count, n + 1)
    return Start(nodes, np.zeros_like(nodes), at_rest(), np.full(count, direction), case.contact_stiffness)


def _turned(vectors: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return vectors @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _vectors(case: Case, places: np.ndarray, slopes: np.ndarray, across: float = 1.0, along: float = 1.0) -> np.ndarray:
    """Nodes from places and slopes in the plane; directors of lengths `across` the rib and `along` the hub's axis."""
    if case.rib.vectors == 2:
        return np.stack([places, slopes], axis=1)
    e1 = slopes / np.linalg.norm(slopes, axis=1)[:, None]
    e2 = np.stack([-e1[:, 1], e1[:, 0], np.zeros(len(e1))], axis=1)
    e3 = np.broadcast_to([0.0, 0.0, 1.0], e1.shape)
    return np.stack([places, slopes, across * e2, along * e3], axis=1)


def _straight(case: Case) -> np.ndarray:
    """A straight rib at the hub; one whose tip will be carried is taut already."""
    drive = case.drive
    taut = 1.0 + drive.stretch if drive is not None and drive.kind == "tip" else 1.0
    direction = np.array([math.cos(case.first_direction), math.sin(case.first_direction), 0.0])
    arc = np.linspace(0.0, taut * case.rib.length, case.rib.elements + 1)
    places = np.array([case.hub.radius, 0.0, 0.0]) + arc[:, None] * direction
    return _vectors(case, places, np.tile(taut * direction, (arc.size, 1)))


def _wound(case: Case) -> np.ndarray:
    """A rib bent into a circle without stretch, its contact points on the hub.

    Notes
    -----
    Chord and slopes of an element are those of least energy when bent by its angle; the angle is such that the check
    point nearest to the axis lies on the hub. Where turns touch, each lies on the one below (`_coil`).
    """
    from scipy.optimize import brentq

    rib, R = case.rib, case.hub.radius

    def bent(angle: float, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances of points of an element from the axis, and the element's sizes."""
        _, sizes = bent_element(case, angle)
        chord, slope = sizes[0], sizes[1]
        half = 0.5 * angle
        # Hermite's cubic from (-chord/2, 0) to (chord/2, 0), the axis at (0, -chord / (2 tan(half)))
        x = chord * (3.0 * xi**2 - 2.0 * xi**3 - 0.5)
        x += rib.element_length * slope * math.cos(half) * (xi - 3.0 * xi**2 + 2.0 * xi**3)
        y = rib.element_length * slope * math.sin(half) * (xi - xi**2)
        return np.hypot(x, y + 0.5 * chord / math.tan(half)), sizes

    checks = np.arange(1, case.contact.points + 1) / case.contact.points
    flat = rib.element_length / R
    angle = brentq(lambda a: bent(a, checks)[0].min() - R, 0.5 * flat, 1.5 * flat, xtol=1e-15)
    distance, sizes = bent(angle, np.linspace(0.0, 1.0, 41))
    chord, slope = sizes[0], sizes[1]
    d_chord, pitch = 0.0, 0.0
    if case.contact.self:
        d_chord = (chord - bent_element(case, 0.99 * angle)[1][0]) / (0.01 * angle)
        pitch = max(rib.thickness, rib.tip_thickness or 0.0) + float(np.ptp(distance))
    radius = 0.5 * chord / math.sin(0.5 * angle)
    places, slopes = _coil(case, radius, pitch, angle, lambda turned: chord + d_chord * (turned - angle))
    return _vectors(case, places, slope * slopes, *sizes[2:])


def _coil(
    case: Case, radius: float, pitch: float, angle: float, chord: Callable[[float], float]
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a coil, and their directions.

    Parameters
    ----------
    radius : float, m, of the nodes on the hub
    pitch : float, m, from turn to turn; 0 for a circle
    angle : float, rad, of an element on the hub; chord : its chord (m) as a function of the angle that it turns by

    Notes
    -----
    With a pitch a spiral: the first turn leaves the hub until it meets the root below, its own or the next rib's.
    """
    from scipy.optimize import brentq

    growth = pitch * case.rib.count / (2.0 * math.pi)

    def coil(phi: Any) -> tuple[np.ndarray, Any]:
        """Position at the angle phi, and the direction there."""
        r = radius + growth * phi
        return np.stack([r * np.cos(phi), r * np.sin(phi), 0.0 * phi]), phi + 0.5 * math.pi - np.arctan2(growth, r)

    def excess(phi: float, before: float) -> float:
        (at, facing), (place, direction) = coil(phi), coil(before)
        return float(np.linalg.norm(at - place)) - chord(facing - direction)

    angles = [0.0]
    for _ in range(case.rib.elements):
        low, high = angles[-1] + 0.5 * angle, angles[-1] + 1.5 * angle
        angles.append(brentq(excess, low, high, args=(angles[-1],), xtol=1e-15) if growth else angles[-1] + angle)
    places, faced = coil(np.array(angles))
    return places.T, np.stack([np.cos(faced), np.sin(faced), 0.0 * faced], axis=1)


# ------------------------------------------------------------------------------------------------ saved runs


def _from_run(case: Case) -> Start:
    from evolvent import cases, results

    found = results.open(case.start)
    if found.attrs["system"] != case.system:
        raise InputError(f"start is {case.start!r}, a run of {found.attrs['system']}; it must be one of {case.system}")
    run = found.to_dataset()
    for name in ("end_coordinates", "end_velocities", "end_hub", "hinge_rest"):
        if name not in run or not np.all(np.isfinite(run[name].values)):
            raise InputError(f"start is {case.start!r}, a run without {name!r}, from which none can start")
    before = cases.of_run(run.attrs["case"])
    check_follows(before, case)
    shape = (before.rib.count, before.rib.elements + 1, before.rib.vectors, 3)
    shapes = {"end_coordinates": shape, "end_velocities": shape, "end_hub": (14,), "hinge_rest": shape[:1]}
    if any(run[name].shape != wanted for name, wanted in shapes.items()):
        raise InputError(f"start is {case.start!r}, whose last state has another shape than its case")
    h = run.end_hub.values
    hub = HubState(position=h[:3], quaternion=h[3:7], velocity=h[7:10], rate=h[10:13], angle=float(h[13]))
    if case.hub.motion != "free":
        _check_upright(case, hub)
    R = rotation_matrices(hub.quaternion)
    refined = [
        _refined(case, run.end_coordinates.values[b], run.end_velocities.values[b], R) for b in range(case.rib.count)
    ]
    if case.hub.motion == "fixed":
        hub = dataclasses.replace(hub, velocity=np.zeros(3), rate=np.zeros(3))
    nodes, rates = np.stack([r[0] for r in refined]), np.stack([r[1] for r in refined])
    stiffness = case.contact_stiffness
    if case.contact.stiffness == "auto":  # what pressed on the hub before still does
        stiffness = max(stiffness, before.contact_stiffness)
    warning = ""
    if run.attrs["status"] != "success":
        warning = (
            f"it starts from {case.start}, a run that ended as {run.attrs['status']} at {float(run.time[-1]):.6g} s"
        )
    return Start(nodes, rates, hub, run.hinge_rest.values, stiffness, warning)


def check_follows(before: Case, after: Case) -> None:
    """Refuse a case that cannot start from the end of another.

    Raises
    ------
    InputError
        If their ribs or hubs differ in what cannot change.
    """
    for key, mine, its in (
        ("rib.length", after.rib.length, before.rib.length),
        ("rib.count", after.rib.count, before.rib.count),
        ("hub.radius", after.hub.radius, before.hub.radius),
    ):
        if mine != its:
            raise InputError(f"{key} is {mine:g}, but the run {after.start!r}, from which this one starts, has {its:g}")


def _check_upright(case: Case, hub: HubState) -> None:
    tilted = float(np.hypot(hub.quaternion[1], hub.quaternion[2]))
    moved = float(np.linalg.norm(hub.position))
    if tilted > 1e-9 or moved > 1e-9:
        raise InputError(
            f"hub.motion is {case.hub.motion!r}, but the hub of the run {case.start!r} has moved or tilted; take "
            f"hub.motion: free"
        )


def _refined(case: Case, nodes: np.ndarray, rates: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and rates of one rib on the case's elements; vectors that its formulation needs and the run lacks."""
    from evolvent.elements import axis_shape

    wanted = case.rib.vectors
    old, new = nodes.shape[0] - 1, case.rib.elements
    length = case.rib.length / old
    at = np.linspace(0.0, old, new + 1)
    cell = np.minimum(at.astype(int), old - 1)
    xi = at - cell
    found = []
    for e in (nodes, rates):
        ends = np.stack([e[cell, 0], e[cell, 1], e[cell + 1, 0], e[cell + 1, 1]])
        vectors = [np.einsum("jk,jki->ki", axis_shape(length, xi, order=order), ends) for order in (0, 1)]
        if nodes.shape[1] == wanted == 4:
            vectors += [(1.0 - xi)[:, None] * e[cell, i] + xi[:, None] * e[cell + 1, i] for i in (2, 3)]
        found.append(vectors)
    (_, slope, *directors), (_, turning, *_) = found
    if wanted == 4 and not directors:
        e1 = slope / np.linalg.norm(slope, axis=1)[:, None]
        z = R[:, 2] - (e1 @ R[:, 2])[:, None] * e1
        e3 = z / np.linalg.norm(z, axis=1)[:, None]
        e2 = np.cross(e3, e1)
        w = np.cross(e1, turning) / np.linalg.norm(slope, axis=1)[:, None]
        found[0] += [e2, e3]
        found[1] += [np.cross(w, e2), np.cross(w, e3)]
    return np.stack(found[0], axis=1), np.stack(found[1], axis=1)


def along(nodes: np.ndarray, length: float, xi: np.ndarray, order: int = 0) -> np.ndarray:
    """Points on elements' axes, or their derivatives by arc length, at xi : (k,).

    Parameters
    ----------
    nodes : (..., n + 1, vectors, 3) float

    Returns
    -------
    (..., n, k, 3) float
    """
    from evolvent.elements import axis_shape

    ends = np.concatenate([nodes[..., :-1, :2, :], nodes[..., 1:, :2, :]], axis=-2)
    found: np.ndarray = np.einsum("jk,...ji->...ki", axis_shape(length, xi, order=order), ends)
    return found
