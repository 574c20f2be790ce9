"""Rods."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.base.errors import InputError
from evolvent.model.family import ENERGY, EVERY, End, Family, Kind, Records, record

Array = np.ndarray
_3, _33, _6, _66 = (3,), (3, 3), (6,), (6, 6)


def _of_rod_element(row: Any, records: Records) -> Iterator[End]:
    yield from (("bodies", int(row[key])) for key in ("a", "b"))
    if row["tape"] > 0:
        first = int(row["tape_node"])
        yield from (("vectors", int(iv)) for iv in records("tape_nodes")["iv"][first : first + 2])


def _heat(builder: Any, name: str, load: Any) -> dict[str, int]:
    """Free strains of the elements at a temperature of 1 K: of the mean of the factor over each."""
    rod, index = builder.specs[name], builder.names[name][1]
    builder.parameters(rod.material.thermal_expansion * load.means(rod.arc / rod.length))
    first = builder.rows["rods"][index]["first_element"]
    for row in builder.rows["rod_elements"][first : first + rod.elements]:
        row["heated"] = 1
    return {"rod": index}


def _place(builder: Any, at: Any) -> Any:
    """A node of a rod, which is a body."""
    row = builder.rows["rods"][at.index]
    number = at.number(row["elements"], "rod")
    last = number == row["elements"]
    if row["payout"] and not last and number > 0:
        raise InputError(
            f"{at.key} is {at.where!r}, a node of a mesh through which material flows ({at.name}.payout); give "
            f"'{at.name}.root' or '{at.name}.tip'"
        )
    element = builder.rows["rod_elements"][row["first_element"] + number - last]
    return builder.on_body(row["first_body"] + number, element["arm_b" if last else "arm_a"])


# geometrically exact rods: their nodes are the bodies from first_body on; alpha: damping by mass;
# tape: 1 + tape of which the section flattens, or 0; payout: 1 where the length that is out follows a drive
# (`kernels.rod_payout`): density and gyration, mass and inertia per length; out, rate, acceleration: of the length;
# grown0, grown1: of a sample, ratios of its length to those at the ends of its step
RODS = Family(
    "rods",
    record(
        "first_element elements first_body first_node tape payout drive law first last",
        "length alpha density gyration",
        "kinetic linear angular out rate acceleration drive_force grown0 grown1",
        linear=_3, angular=_3, gyration=_33,
    ),
    order=180,
    results={
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about the inertial origin"),
        "out": ("deployed_length", "m", "length without stress that is out"),
        "rate": ("payout_rate", "m s-1", "rate of the length that is out"),
    },
    kinds=(
        Kind("a rod", which=lambda r: (r["tape"] == 0) & (r["payout"] == 0), symmetric=True),
        Kind(
            "a rod that pays out", EVERY - {ENERGY},
            "use generalized-alpha: a discrete gradient of a kinetic energy whose masses depend on the length is not "
            "implemented",
            which=lambda found: found["payout"] != 0,
            symmetric=True,
        ),
        Kind("a tape-spring rod", which=lambda found: found["tape"] > 0, symmetric=True),
    ),
    isolated=lambda found, _: not np.any(found["payout"] != 0) and not np.any(found["alpha"] != 0.0),
    place=_place,
    heat=_heat,
    by_causes=True,
)  # fmt: skip

# an element between bodies a and b, whose axes are those of its sections; arms: from the bodies' centres to its
# ends, body axes; stiffness: of strains of force and moment; rest: (Gamma_0, K_0), see `kernels.rod_strains`;
# section: compliance of the section in its middle; fibres: E A times the means of rho^2 and rho^4, N m2, N m4, see
# `kernels.strip`, or 0; heated: 1 with a thermal load, whose free strains are `free`.
# m0, m1: measures at the start and the end of an interval; before: change of the strains over the step before;
# stored, bent: J, elastic energy and that of moments; the others are in `RESULTS`. tape: as of rods, and tape_node
# its first node; flattening, flattening_slope: forces by `tape.evaluate_tape`, with derivatives; curvature_rate: of
# a state, before_product: changes of curvature times coordinates over the step before. flows: 1 of a rod that pays
# out, with the whole strains, their rates, stresses times length of the flow, and pull (`rod_payout.pull_of`)
ROD_ELEMENTS = Family(
    "rod_elements",
    record(
        "a b heated tape tape_node flows",
        "length beta arm_a arm_b stiffness rest section fibres",
        "free m0 m1 before stored bent energy_density strain shear_strain_y shear_strain_z twist curvature_y "
        "curvature_z axial_force shear_force_y shear_force_z torsional_moment bending_moment_y bending_moment_z "
        "flattening flattening_slope curvature_rate before_product whole rates flow pull",
        whole=_6, rates=_6, flow=_6,
        flattening=_3, flattening_slope=_33, before_product=(2,), fibres=(2,),
        arm_a=_3, arm_b=_3, stiffness=_66, rest=_6, section=_66, free=_6, m0=(15,), m1=(15,), before=_6,
    ),
    order=190,
    results={
        "strain": ("strain", "1", "strain of the axis"),
        "shear_strain_y": ("shear_strain_y", "1", "shear strain along y"),
        "shear_strain_z": ("shear_strain_z", "1", "shear strain along z"),
        "twist": ("twist", "m-1", "change of twist per length"),
        "curvature_y": ("curvature_y", "m-1", "change of curvature about y"),
        "curvature_z": ("curvature_z", "m-1", "change of curvature about z"),
        "axial_force": ("axial_force", "N", "force along x, positive in tension"),
        "shear_force_y": ("shear_force_y", "N", "shear force along y in the section's axes"),
        "shear_force_z": ("shear_force_z", "N", "shear force along z in the section's axes"),
        "torsional_moment": ("torsional_moment", "N m", "moment about x in the section's axes"),
        "bending_moment_y": ("bending_moment_y", "N m", "moment about y in the section's axes"),
        "bending_moment_z": ("bending_moment_z", "N m", "moment about z in the section's axes"),
        "energy_density": ("energy_density", "J m-1", "strain energy per length"),
        "free": ("free_strains", "1", "strains and curvatures without stress"),
        "stored": ("energy_elastic", "J", "strain energy"),
        "bent": ("energy_bending", "J", "strain energy of bending and torsion"),
    },
    of="rods",
    ends=_of_rod_element,
)  # fmt: skip
