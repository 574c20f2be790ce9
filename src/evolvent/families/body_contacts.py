"""Body contacts."""

from __future__ import annotations

import numpy as np

from evolvent.families.contact_surfaces import is_conservative, slides_freely
from evolvent.kernels import body_gaps, contact_laws
from evolvent.kernels.ends import of_bodies
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts

Array = np.ndarray
_3, _33, _6 = (3,), (3, 3), (6,)


def _is_of_box(found: Array) -> Array:
    return np.asarray((found["surface"] == body_gaps.BOX) | (found["surface"] == body_gaps.EDGES))


# contact points between two bodies: a sphere or capsule (half length, radius_a) of body a, and on body b another
# one, a plane with the normal axis_b, or a box with the half lengths `sides` (`kernels.body_gaps`); radius: sum of
# both; first: the first of its part; extent: m, of which a share is the depth of the explicit step's bound;
# share: of the points of the part's kind that can touch at the same time. Of the step's start:
# position X and rotation Q of a in the axes of b, and what ends in 0; of its end: what ends in 1. rubbing: friction
# on a (N), c: point of contact (m), inertial axes; on_a, on_b: force (N) and moment (N m) at the bodies' origins;
# impulse: of the normal force, N s, NaN under explicit methods; slid0, slid1: as of contact points
BODY_CONTACTS = Family(
    "body_contacts",
    record(
        "a b first law surface account outside",
        "place_a axis_a place_b axis_b half_a half_b sides radius_a radius extent share "
        "stiffness exponent damping friction bristle_stiffness bristle_damping viscous",
        "X Q gap stick damper drag gap1 stick1 damper1 drag1 slide "
        "distance0 distance u0 v0 w0 s0 t0 u1 v1 w1 s1 t1 n n1 t "
        "rubbing c on_a on_b force impulse d_gap d_rate along across by_normal tilt energy power sank "
        "slid0 slid1",
        place_a=_3, axis_a=_3, place_b=_3, axis_b=_3, sides=_3,
        X=_3, Q=_33, stick=_3, drag=_3, stick1=_3, drag1=_3, slide=_3, n=_3, n1=_3, t=_3, rubbing=_3, c=_3,
        on_a=_6, on_b=_6, slid0=_3, slid1=_3,
    ),
    order=370,
    results={
        "impulse": ("impulse", "N s", "integral of the normal forces since the start; NaN if explicit"),
        "energy": ("energy_elastic", "J", "elastic energy of the contact and of what sticks by friction"),
        "force": ("point_force", "N", "normal force of each contact point"),
        "on_a": (
            "point_resultant",
            "N",
            "whole force of each contact point on its {on}, inertial axes: of the sample, or the mean over its step",
        ),
        "rubbing": (
            "point_friction",
            "N",
            "friction of each contact point on its {on}, inertial axes: of the sample, or the mean over its step",
        ),
        "c": ("point_position", "m", "position of each contact point, on the first body's surface, inertial axes"),
        "gap1": ("gap", "m", "distance of the surfaces, negative where they overlap"),
    },
    kinds=(
        Kind(
            "a contact between bodies without friction",
            which=lambda found: (
                (found["friction"] == 0.0) & (found["law"] == contact_laws.HUNT_CROSSLEY) & ~_is_of_box(found)
            ),
            symmetric=True,
        ),
        Kind(
            "a contact between bodies with friction",
            which=lambda found: (found["friction"] > 0.0) & ~_is_of_box(found),
        ),
        Kind(
            "a contact between bodies with the law conservative",
            which=lambda found: is_conservative(found) & ~_is_of_box(found),
            symmetric=slides_freely,
        ),
        Kind(
            "a contact of a box",
            which=_is_of_box,
            symmetric=slides_freely,
        ),
    ),
    ends=of_bodies("a", "b"),
    accounts=(Accounts(lambda found: np.where(found["friction"] > 0.0, 3, 0)),),
    rubs=lambda found: found["friction"] > 0.0,
)  # fmt: skip
