"""Thermal strain of elements: the constants by which a temperature shifts the strains without stress.

Notes
-----
Amplitudes of a load are (T, T^2, Gy, Gy T, Gz, Gz T), T the change of temperature (K), G its gradients (K/m). A fibre
at (y, z) that expands freely has the stretch 1 + alpha (T + y Gy + z Gz). Its Green strain is that of the axis,
alpha T + (alpha T)^2/2, plus y alpha Gy (1 + alpha T) and likewise z; squares of the gradients are left out. With
engineering strain (`cable_stretch`) it is alpha T.

With the free strains F a of amplitudes a, the energy 1/2 int (eps - F a)^T D (eps - F a) is that without them, less
a . C (g - g0), plus 1/2 a . Q a: C = int F^T D W, Q = int F^T D F.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evolvent.elements.forms import (
    ASSUMED,
    EXACT,
    gauss,
    line_rows,
    nodal_vectors,
    product_row,
    products,
    slope_factors,
    straight_beam,
    straight_cable,
)
from evolvent.elements.materials import Material
from evolvent.elements.sections import TapeSection
from evolvent.elements.shapes import CrossSection
from evolvent_base.dense import norm, product
from evolvent_base.errors import InputError

Array = NDArray[np.float64]
#: Amplitudes of a load.
AMPLITUDES = 6
#: Formulations of beams that a temperature strains.
HEATED = ("assumed_strain", "elastic_line", "cable", "cable_stretch")


@dataclasses.dataclass(frozen=True, eq=False)
class ThermalForm:
    """C : (6, m), Q : (6, 6), rest : (6,) = C g0, of an element; m = 28 (beam), 6 (cable) or 3 (cable_stretch)."""

    C: Array
    Q: Array
    rest: Array


def free_strains(expansion: float, *, green: bool = True) -> Array:
    """F : (3, 6), free strain of the axis and free curvatures across y and z (`bend_y`, `bend_z`) by amplitudes."""
    a = expansion
    found = np.zeros((3, AMPLITUDES))
    found[0, 0] = a
    if green:
        found[0, 1] = 0.5 * a * a
        found[1, 2:4] = found[2, 4:6] = a, a * a
    return found


def thermal_form(
    formulation: str, length: float, section: CrossSection, material: Material, along: Callable[[float], float], *,
    rest: ArrayLike | None = None,
) -> ThermalForm:  # fmt: skip
    """Constants of an element of one of the formulations elastic_line, assumed_strain, cable and cable_stretch.

    Parameters
    ----------
    along : function of xi (0 to 1 in the element) to the factor of temperature and gradients there
    rest : coordinates of the shape without stress at no change of temperature; straight if not given
    """
    expansion = float(material.thermal_expansion or 0.0)
    is_beam, green = formulation in ("elastic_line", "assumed_strain"), formulation != "cable_stretch"
    rules = EXACT if formulation == "elastic_line" else ASSUMED
    m = 28 if is_beam else 6 if green else 3
    C, Q = np.zeros((AMPLITUDES, m)), np.zeros((AMPLITUDES, AMPLITUDES))
    for p, (xi, weight) in enumerate(rules["membrane"] if is_beam else gauss(3)):
        F = free_strains(expansion * along(xi), green=green)[0]
        k = weight * length * material.E * section.at(xi).properties(material.nu).area
        if is_beam:
            row = line_rows(length, xi)["axial"]
        elif green:
            slope = np.array(slope_factors(length, xi))
            row = 0.5 * product_row(slope, slope)
        else:  # of the stretch at this point
            row = np.eye(3)[p]
        C += k * np.outer(F, row)
        Q += k * np.outer(F, F)
    for xi, weight in rules["bending"] if is_beam else []:
        F = free_strains(expansion * along(xi))[1:]
        s, rows = section.at(xi).properties(material.nu), line_rows(length, xi)
        S = weight * length * material.E * np.array([[s.Iz, s.Iyz], [s.Iyz, s.Iy]])
        C += product(F.T, S, np.array([rows["bend_y"], rows["bend_z"]]))
        Q += product(F.T, S, F)
    if green:
        start = straight_beam(length) if is_beam else straight_cable(length)
        g0 = products(start if rest is None else rest)
    else:
        v = nodal_vectors(straight_cable(length) if rest is None else rest)
        g0 = np.array([norm(product(v.T, np.array(slope_factors(length, xi)))) for xi, _ in gauss(3)])
    return ThermalForm(C, Q, product(C, g0))


def refuse_unheated(load: Any, part: Any, name: str, called: str) -> None:
    """Refuse a beam or a rod that a thermal load, of the name `called`, cannot heat by its section or material."""
    if load.balance is not None:
        raise InputError(f"{called}.balance is given, but {name!r} is no shell; the balance of heat is that of shells")
    if isinstance(part.section, TapeSection):
        raise InputError(
            f"{called}.part is {name!r}, whose section is a tape; a thermal load needs a section that does not "
            f"flatten, such as an arc"
        )
    if part.material is None:
        raise InputError(
            f"{called}.part is {name!r}, whose section is given by its stiffness matrix; a thermal load needs a "
            f"rod with a material"
        )
    if part.material.thermal_expansion is None:
        raise InputError(
            f"{called}.part is {name!r}, whose material has no thermal_expansion; give {name}.material one, such as "
            f"24e-6 1/K"
        )
    if part.material.viscoelastic is not None:
        refuse_relaxing(name)


def refuse_relaxing(name: str) -> NoReturn:
    """Refuse a part that relaxes, on which a thermal load acts."""
    raise InputError(
        f"a thermal load acts on {name!r}, which is viscoelastic; the free strains of heat and relaxation together "
        f"are not implemented; leave one of them out"
    )
