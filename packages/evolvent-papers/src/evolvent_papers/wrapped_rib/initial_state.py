"""States from which ribs start: straight, wound without stretch, or the end of a saved run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent import cases, parts, results
from evolvent.elements import coil, helix, nodal, resampled
from evolvent.results.rotations import rotation_matrices
from evolvent_base.dense import product
from evolvent_base.errors import InputError
from evolvent_papers.wrapped_rib.case import Case

if TYPE_CHECKING:
    from evolvent.parts import Beam

Array = np.ndarray


class Start(NamedTuple):
    """What a run starts from.

    Attributes
    ----------
    nodes : (ribs, n + 1, vectors, 3) float, m and 1, inertial axes
    rates : the same, m/s and 1/s
    hub : position, orientation, velocity (inertial) and angular_velocity (body axes), as `evolvent.parts.RigidBody`
        takes them
    rest : (ribs,) float, rad, of the springs in the roots' hinges, from outwards
    stiffness : float, N/m^n, of the contact
    warning : str, of a run that did not end well; else empty
    """

    nodes: Array
    rates: Array
    hub: dict[str, tuple[float, ...]]
    rest: Array
    stiffness: float
    warning: str = ""

    @property
    def rotation(self) -> Array:
        """Rotation matrix of the hub, from its axes to inertial ones."""
        return rotation_matrices(np.array(self.hub["orientation"]))


def initial_state(case: Case) -> Start:
    """The state from which a case starts.

    Raises
    ------
    InputError
        If a saved run cannot be read, or is not of such a rib.
    """
    if case.begins not in ("straight", "wound"):
        return _from_run(case)
    count, turned = case.rib.count, []
    one = _straight(case) if case.begins == "straight" else _wound(case)
    for k in range(count):
        c, s = math.cos(2.0 * np.pi * k / count), math.sin(2.0 * np.pi * k / count)
        turned.append(product(one, np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])))
    nodes = np.stack(turned)
    hub = {"position": (0.0, 0.0, 0.0), "orientation": (1.0, 0.0, 0.0, 0.0)}
    hub |= dict.fromkeys(("velocity", "angular_velocity"), (0.0, 0.0, 0.0))
    rest = case.first_direction if case.begins == "straight" else 0.5 * np.pi
    return Start(nodes, np.zeros_like(nodes), hub, _rest(case, np.full(count, rest)), case.contact_stiffness)


def _rest(case: Case, auto: Array) -> Array:
    """Directions without moment of the springs in the roots' hinges, from outwards, rad."""
    given = case.rib.root_rest
    return auto if given == "auto" else np.full(auto.size, float(given))


def _straight(case: Case) -> Array:
    """A straight rib at the hub, or one of its stress-free shape; one whose tip will be carried is taut already."""
    drive, rib = case.drive, case.rib
    taut = 1.0 + drive.stretch if drive is not None and drive.kind == "tip" else 1.0
    level = np.array([math.cos(case.first_direction), math.sin(case.first_direction), 0.0])
    up, c, s = np.array([0.0, 0.0, 1.0]), math.cos(case.helix_angle), math.sin(case.helix_angle)
    direction = c * level + s * up
    if rib.shape is not None:
        return _curved(case, level).start_nodes("rib")
    arc = np.linspace(0.0, taut * rib.length, rib.elements + 1)
    places = np.array([case.hub.radius, 0.0, case.root_height]) + arc[:, None] * direction
    return nodal(places, np.tile(taut * direction, (arc.size, 1)), c * up - s * level, vectors=rib.vectors)


def _curved(case: Case, level: Array) -> Beam:
    """A rib of its stress-free shape, whose tangent at the root has the direction `level` (3,)."""
    rib = case.rib
    return parts.Beam(
        length=rib.length,
        section=rib.profile,
        material=rib.material,
        elements=rib.elements,
        formulation=rib.formulation,
        position=(case.hub.radius, 0.0, case.root_height),
        direction=tuple(level),
        normal=(-float(level[1]), float(level[0]), 0.0),
        shape=rib.shape,
    )


def _wound(case: Case) -> Array:
    """A rib wound without stretch, its contact points on the hub or, where turns touch, on the turn below."""
    rib, contact = case.rib, case.contact
    mesh = (rib.formulation, rib.elements, rib.element_length, rib.section(rib.thinnest), rib.material)
    if rib.pitch > 0.0:
        nodes = helix(*mesh, radius=case.hub.radius, pitch=rib.pitch, points=contact.points)
    else:
        thickness = max(rib.thickness, rib.tip_thickness or 0.0) if contact.self else 0.0
        rest = None if rib.shape is None else _curved(case, np.array([1.0, 0.0, 0.0])).rest_nodes("rib")
        sizes: dict[str, Any] = {"radius": case.hub.radius, "points": contact.points, "thickness": thickness}
        nodes = coil(*mesh, beams=rib.count, rest=rest, **sizes)
    nodes[:, 0, 2] += case.root_height
    return nodes


def _from_run(case: Case) -> Start:
    """The last sample of a saved run, on the case's elements."""
    run = results.open(case.start)
    if run.attrs["system"] != case.system:
        raise InputError(f"start is {case.start!r}, a run of {run.attrs['system']}; it must be one of {case.system}")
    before = cases.of_run(run.attrs["case"])
    check_follows(before, case)
    shape = (before.rib.count, before.rib.elements + 1, before.rib.vectors, 3)
    shapes = {"end_coordinates": shape, "end_velocities": shape, "hinge_rest": shape[:1]}
    for name, wanted in shapes.items():
        if name not in run or run[name].shape != wanted or not np.all(np.isfinite(run[name].values)):
            raise InputError(f"start is {case.start!r}, a run without a whole {name!r}, from which none can start")
    of_run = {"position": "position", "orientation": "attitude", "velocity": "velocity", "angular_velocity": "rate"}
    hub = {key: tuple(run["hub"][name].values[-1].tolist()) for key, name in of_run.items()}
    off = np.abs([*hub["position"], *hub["orientation"][1:3]]).max()
    if case.hub.motion != "free" and off > 1e-9:
        raise InputError(
            f"hub.motion is {case.hub.motion!r}, but the hub of the run {case.start!r} has moved or tilted; use "
            f"hub.motion: free"
        )
    stiffness, warning = case.contact_stiffness, ""
    if case.contact.stiffness == "auto":  # not softer than the contact that pressed before
        stiffness = max(stiffness, before.contact_stiffness)
    if run.attrs["status"] != "success":
        ended = f"{run.attrs['status']} at {float(run['time'][-1]):.6g} s"
        warning = f"it starts from {case.start}, a run that ended as {ended}"
    rest = _rest(case, run["hinge_rest"].values)
    begin = Start(run["end_coordinates"].values, run["end_velocities"].values, hub, rest, stiffness, warning)
    mesh = (case.rib.length, case.rib.elements)
    one_by_one = zip(begin.nodes, begin.rates, strict=True)
    found = [resampled(*rib, *mesh, vectors=case.rib.vectors, z=begin.rotation[:, 2]) for rib in one_by_one]
    return begin._replace(nodes=np.stack([x for x, _ in found]), rates=np.stack([v for _, v in found]))


def check_follows(before: Case, after: Case) -> None:
    """Refuse a case that cannot start from the end of another.

    Raises
    ------
    InputError
        If their ribs or hubs differ in what cannot change.
    """
    for section, key in (("rib", "length"), ("rib", "count"), ("rib", "pitch"), ("hub", "radius")):
        mine, its = (getattr(getattr(case, section), key) for case in (after, before))
        if mine != its:
            run = f"the run {after.start!r}, from which this one starts"
            raise InputError(f"{section}.{key} is {mine:g}, but {run}, has {its:g}")
    if before.rib.shape != after.rib.shape:
        raise InputError(f"rib.shape is not that of the run {after.start!r}, from which this one starts; use the same")
