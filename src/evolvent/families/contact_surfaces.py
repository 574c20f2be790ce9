"""Contact surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import contact_laws
from evolvent.model.family import End, Family, Kind, Records, record, where
from evolvent.model.layout import Accounts

Array = np.ndarray
_3 = (3,)


def is_conservative(found: Array) -> Array:
    """Which contacts have the law conservative: (n,) bool."""
    return np.asarray(found["law"] == contact_laws.CONSERVATIVE)


def slides_freely(_: Any, found: Array) -> bool:
    """Whether none of the contacts has friction."""
    return not np.any(found["friction"] > 0.0)


def _of_surface(row: Any, records: Records) -> Iterator[End]:
    """Of a layer on other turns, whose points pass from element to element, its body alone."""
    yield "bodies", int(row["body"])
    if row["under"] < 0:
        for point in records("contact_points")[int(row["first"]) : int(row["last"])]:
            yield from (("vectors", int(iv)) for iv in point["iv"])


def _coupled(row: Any, records: Records) -> Iterator[list[End]]:
    """Point by point; turns on one another are coupled where they touch (`solvers.graph`)."""
    if row["under"] < 0:
        for point in records("contact_points")[int(row["first"]) : int(row["last"])]:
            yield [*(("vectors", int(iv)) for iv in point["iv"]), ("bodies", int(row["body"]))]


# rigid surfaces on bodies (`kernels.surfaces`), and the points of beams that are checked against them: first, last;
# under: -1, or the beam on whose turns these lie, wound in the sense +-1 and ahead of them by the angle `shift`;
# account: index in the state of the bristle of its first point under explicit methods, three numbers a point;
# impulse: N s, which implicit methods sum up
CONTACT_SURFACES = Family(
    "contact_surfaces",
    record(
        "body law first last under surface account outside",
        "sense shift centre axis radius half_length stiffness exponent damping friction bristle_stiffness "
        "bristle_damping",
        "force moment normal impulse energy power touching",
        centre=_3, axis=_3, force=_3, moment=_3,
    ),
    order=350,
    results={
        "force": ("force", "N", "resultant of the surface on the beams, inertial axes"),
        "moment": (
            "moment",
            "N m",
            "moment of the surface on the beams about the origin of the surface's body, inertial axes",
        ),
        "normal": ("normal_force", "N", "sum of the normal forces"),
        "impulse": ("impulse", "N s", "integral of the normal forces since the start"),
        "touching": ("points", "1", "contact points that touch"),
        "energy": ("energy_elastic", "J", "elastic energy of the contact and of what sticks by friction"),
    },
    kinds=(
        Kind(
            "a contact without friction",
            which=lambda found: (
                (found["friction"] == 0.0) & (found["under"] < 0) & (found["law"] == contact_laws.HUNT_CROSSLEY)
            ),
            symmetric=True,
        ),
        Kind(
            "a contact with friction",
            which=lambda found: (found["friction"] > 0.0) & (found["under"] < 0),
        ),
        Kind(
            "a contact with the law conservative", which=is_conservative,
            symmetric=slides_freely,
        ),
        Kind(
            "a contact with the paper's law",
            which=where("law", contact_laws.PAPER),
            symmetric=slides_freely,
        ),
        Kind(
            "a layer on other turns",
            which=lambda found: found["under"] >= 0,
            symmetric=slides_freely,
        ),
    ),
    ends=_of_surface,
    couples=_coupled,
    accounts=(
        Accounts(1, field="", order=0),  # impulse of the normal forces
        Accounts(lambda found: np.where(found["friction"] > 0.0, 3 * (found["last"] - found["first"]), 0)),
    ),
    rubs=lambda found: found["friction"] > 0.0,
)  # fmt: skip

# a contact point is S . (four vectors of its element). Of the step's start: gap (m), distance `offset` from the
# axis and place `xi` on it (m), point `anchor` in body axes (m), bristle `stick` (m) and friction `drag` (N) in the
# bristle's axes, part `damper` of the normal force (N); of its end: those with 1, `distance`, position x (m) and
# normal n1. Of the interval: normal force (N) with derivatives d_gap and d_rate, n: its direction, f: whole force
# (N), and t, along, across, by_normal of `contact_laws.friction`, tilt: part of the bristle's stretch along
# the normal, by which friction turns with it (m). Of turns: element and point below, carrier and
# xi, normals n0 and n1 at both ends, how far `offset` off along the axis the start was; `anchor` is what it moved
# by against what is below. rest: depth that a point keeps (`surfaces.measure_points`); sank: change of the gap over
# the step before, of the filter of `contact_laws.press`; viscous: of `contact_laws.sliding_damper`;
# rubbing: of f the friction; slid0, slid1: sliding velocity at both ends of a step, in the bristle's axes
CONTACT_POINTS = Family(
    "contact_points",
    record(
        "element iq iv carrier carrier1", "S reach viscous",
        "xi xi1 offset "
        "gap anchor stick damper gap1 stick1 n distance f force d_gap d_rate damper1 t along across by_normal tilt "
        "drag drag1 "
        "x n0 n1 rest rest1 sank apart rubbing slid0 slid1",
        x=_3, n0=_3, n1=_3, rubbing=_3, slid0=_3, slid1=_3,
        iq=(4,), iv=(4,), S=(4,), anchor=_3, stick=_3, stick1=_3, n=_3, f=_3, t=_3, drag=_3, drag1=_3,
    ),
    order=360,
    results={
        "force": ("point_force", "N", "normal force of each contact point, positive where it pushes"),
        "apart": (
            "gap",
            "m",
            "distance of each contact point, negative where it overlaps, NaN where it is too far away or past the edge",
        ),
        "x": ("point_position", "m", "position of each contact point, inertial axes"),
        "n1": ("point_normal", "1", "normal of the surface at each contact point, inertial axes"),
        "rubbing": ("point_friction", "N", "friction of each contact point on its beam, inertial axes"),
    },
    of="contact_surfaces",
)  # fmt: skip
