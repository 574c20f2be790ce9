"""The constant quadratic forms of ANCF elements: one for each formulation.

Notes
-----
The strains used here are linear in the products g of the nodal vectors (`kernels.ancf`): eps = W (g - g0) with g0 the
products of the shape without stress. So U = 1/2 int eps^T D eps = 1/2 (g - g0)^T H (g - g0), H = int W^T D W; h = H g0
and U0 = 1/2 g0^T H g0 hold the rest shape. It must be given by arc length, with unit directors, and its curvature times
the thickness must be small (the metric of a thick curved bar is left out).
"""

from __future__ import annotations

import dataclasses
import functools
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evolvent.elements.materials import Material
from evolvent.elements.shapes import CrossSection, Properties, Rectangle
from evolvent_base.dense import dot, legendre, norm, product
from evolvent_base.errors import InputError

Array = NDArray[np.float64]
Rule = list[tuple[float, float]]

#: Formulations of the beam with 24 coordinates.
FORMULATIONS = ("full", "nu_split", "elastic_line", "assumed_strain")
#: What the energy is made of: `section` is shear, thickness and, in a continuum, all that couples the others.
PARTS = ("membrane", "bending", "torsion", "section")
#: Below about this angle that a cable's element spans, rad, the damping of its bending fades out.
STRAIGHT = 1e-4


@dataclasses.dataclass(frozen=True, eq=False)
class Form:
    """U = 1/2 g^T H g - h^T g + U0, J. H : (m, m), h : (m,), m = 28 (beam) or 6 (cable)."""

    H: Array
    h: Array
    U0: float

    def energy(self, e: ArrayLike) -> Any:
        """U of an element with the coordinates e, an analytic function of them (complex steps differentiate it)."""
        g = products(e)
        return np.einsum("i,i", 0.5 * product(self.H, g) - self.h, g) + self.U0

    def __add__(self, other: Form) -> Form:
        return Form(self.H + other.H, self.h + other.h, self.U0 + other.U0)

    def __sub__(self, other: Form) -> Form:
        return Form(self.H - other.H, self.h - other.h, self.U0 - other.U0)


@functools.cache
def gauss(n: int) -> Rule:
    """Points and weights of Gauss's rule on [0, 1]."""
    points, weights = legendre(n)
    return [(float(0.5 + 0.5 * x), float(0.5 * w)) for x, w in zip(points, weights, strict=True)]


NODES: Rule = [(0.0, 0.5), (1.0, 0.5)]
SIMPSON: Rule = [(0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6)]

#: Where each kind of strain is taken. Of a constant section, Gauss's 5 points integrate any of them exactly; a taper
#: adds powers of xi, and its J is not even a polynomial.
EXACT = {kind: gauss(7) for kind in ("membrane", "bending", "torsion", "shear", "thickness")}
ASSUMED = {"membrane": gauss(3), "bending": gauss(2), "torsion": gauss(2), "shear": SIMPSON, "thickness": NODES}


# ---------------------------------------------------------------------------------------------- products


@functools.cache
def _pairs(n: int) -> tuple[Any, Any, Array]:
    """Indices i <= j of the products of n vectors, and the factors of a_i b_j + a_j b_i in a.b."""
    i, j = np.triu_indices(n)
    return i, j, np.where(i == j, 0.5, 1.0)


def product_row(a: Array, b: Array) -> Array:
    """The row W with a.b = W g, for vectors a = sum a_i v_i and b = sum b_i v_i."""
    i, j, factor = _pairs(len(a))
    found: Array = factor * (a[i] * b[j] + a[j] * b[i])
    return found


def nodal_vectors(e: ArrayLike) -> Array:
    """The vectors of an element with coordinates e : (24,) or (12,); (7, 3) or (3, 3)."""
    x = np.asarray(e, dtype=np.result_type(e, float)).reshape(-1, 3)
    v = x[1:].copy()
    v[len(v) // 2] -= x[0]
    return v


def products(e: ArrayLike) -> Array:
    """Inner products g of the nodal vectors; (28,) or (6,)."""
    v = nodal_vectors(e)
    i, j = np.triu_indices(len(v))
    return np.einsum("kc,kc->k", v[i], v[j])


def straight_beam(length: float) -> Array:
    """Coordinates of a straight beam element along x; (24,)."""
    return np.array([[0, 0, 0], *np.eye(3), [length, 0, 0], *np.eye(3)], dtype=float).ravel()


def straight_cable(length: float) -> Array:
    """Coordinates of a straight cable element along x; (12,)."""
    return np.array([[0, 0, 0], [1, 0, 0], [length, 0, 0], [1, 0, 0]], dtype=float).ravel()


def slope_factors(length: float, xi: float) -> tuple[float, float, float]:
    """r,x on the axis, as factors of r_p,x, d and r_q,x."""
    return 1.0 - 4.0 * xi + 3.0 * xi**2, 6.0 * xi * (1.0 - xi) / length, 3.0 * xi**2 - 2.0 * xi


def _line(length: float, xi: float) -> dict[str, Array]:
    """Gradients r,x; r,y; r,z and the last two's derivatives, as factors of the seven vectors."""
    p, d, q = slope_factors(length, xi)
    s, t, u = 1.0 - xi, xi, 1.0 / length
    return {
        "x": np.array([p, 0, 0, d, q, 0, 0]),
        "y": np.array([0, s, 0, 0, 0, t, 0]),
        "z": np.array([0, 0, s, 0, 0, 0, t]),
        "y'": np.array([0, -u, 0, 0, 0, u, 0]),
        "z'": np.array([0, 0, -u, 0, 0, 0, u]),
    }


def line_rows(length: float, xi: float) -> dict[str, Array]:
    """Rows W of the strains of a beam's axis, named as in `kernels.ancf.STRAINS`."""
    r = _line(length, xi)
    return {
        "axial": 0.5 * product_row(r["x"], r["x"]),
        "shear_y": product_row(r["x"], r["y"]),
        "shear_z": product_row(r["x"], r["z"]),
        "twist": 0.5 * (product_row(r["y'"], r["z"]) - product_row(r["z'"], r["y"])),
        "bend_y": product_row(r["x"], r["y'"]),
        "bend_z": product_row(r["x"], r["z'"]),
        "thick_y": 0.5 * product_row(r["y"], r["y"]),
        "thick_z": 0.5 * product_row(r["z"], r["z"]),
        "shear_yz": product_row(r["y"], r["z"]),
    }


def _integrate(rule: Rule, length: float, integrand: Callable[[float], Array]) -> Array:
    return functools.reduce(operator.add, (weight * length * integrand(xi) for xi, weight in rule))


def _stiff(k: float, *rows: Array) -> Array:
    """Sum of k W^T W over the rows W."""
    return k * functools.reduce(operator.add, (np.outer(row, row) for row in rows))


# ---------------------------------------------------------------------------------------------- the beam


def elasticity(material: Material) -> Array:
    """D : (6, 6) of the strains (E_xx, E_yy, E_zz, 2 E_yz, 2 E_xz, 2 E_xy), Pa: lam tr(E) I + 2 mu E."""
    nu = material.nu
    D = np.diag([2.0 * material.shear_modulus] * 3 + [material.shear_modulus] * 3)
    D[:3, :3] += material.E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return D


def uncoupled_elasticity(material: Material, properties: Properties) -> Array:
    """D0 : (6, 6) without Poisson's coupling, with the section's shear factors; D - D0 = D_nu acts on the axis."""
    E, G = material.E, material.shear_modulus
    return np.diag([E, E, E, G, properties.shear_z * G, properties.shear_y * G])


def volume_rows(length: float, xi: float, y: float, z: float) -> Array:
    """W : (6, 28) of Green's strains (E_xx, E_yy, E_zz, 2 E_yz, 2 E_xz, 2 E_xy) at a point of the volume."""
    r = _line(length, xi)
    a, b, c = r["x"] + y * r["y'"] + z * r["z'"], r["y"], r["z"]
    pairs = ((0.5, a, a), (0.5, b, b), (0.5, c, c), (1.0, b, c), (1.0, a, c), (1.0, a, b))
    return np.array([k * product_row(u, w) for k, u, w in pairs])


def _volume(length: float, section: CrossSection, D: Callable[[Properties], Array], nu: float) -> Array:
    """Integral of W^T D W over the volume."""

    def integrand(xi: float) -> Array:
        here = section.at(xi)
        if not isinstance(here, Rectangle):
            raise InputError(f"formulations full and nu_split need a Rectangle; the section is a {type(here).__name__}")
        H = np.zeros((28, 28))
        for y, weight_y in gauss(3):
            for z, weight_z in gauss(3):
                W = volume_rows(length, xi, (y - 0.5) * here.thickness, (z - 0.5) * here.width)
                H += weight_y * weight_z * here.thickness * here.width * product(W.T, D(here.properties(nu)), W)
        return H

    # 5 points are exact for a constant section; a tapered one adds four powers of xi (the moments of y^4)
    return _integrate(gauss(7), length, integrand)


def _line_parts(
    length: float, section: CrossSection, material: Material, rules: dict[str, Rule], *, warping: bool
) -> dict[str, Array]:
    E, G, nu = material.E, material.shear_modulus, material.nu

    def part(kind: str, term: Callable[[dict[str, Array], Properties], Array]) -> Array:
        return _integrate(rules[kind], length, lambda xi: term(line_rows(length, xi), section.at(xi).properties(nu)))

    def shear_of(w: dict[str, Array], s: Properties) -> Array:
        """Of the shear strains at the shear centre, which a twist about the axis moves sideways."""
        y, z = w["shear_y"] - s.centre_z * w["twist"], w["shear_z"] + s.centre_y * w["twist"]
        return _stiff(G * s.area * s.shear_y, y) + _stiff(G * s.area * s.shear_z, z)

    def bending_of(w: dict[str, Array], s: Properties) -> Array:
        y, z = w["bend_y"], w["bend_z"]
        return _stiff(E * s.Iz, y) + _stiff(E * s.Iy, z) + E * s.Iyz * (np.outer(y, z) + np.outer(z, y))

    shear = part("shear", shear_of)
    thickness = part(
        "thickness",
        lambda w, s: _stiff(E * s.area, w["thick_y"], w["thick_z"]) + _stiff(G * s.area, w["shear_yz"]),
    )
    return {
        "membrane": part("membrane", lambda w, s: _stiff(E * s.area, w["axial"])),
        "bending": part("bending", bending_of),
        "torsion": part("torsion", lambda w, s: _stiff(G * (s.J if warping else s.Iy + s.Iz), w["twist"])),
        "section": shear + thickness,
    }


def beam_parts(
    formulation: str, length: float, section: CrossSection, material: Material, *, rest: ArrayLike | None = None
) -> dict[str, Form]:
    """The form of a beam element, split into what its energy is made of.

    Parameters
    ----------
    formulation : {"full", "nu_split", "elastic_line", "assumed_strain"}
        ``full``: the continuum, St. Venant-Kirchhoff (Yi et al. 2017; Garcia-Vallejo et al. 2004). It does not tend to
        beam theory unless nu = 0, and locks where an element spans more than some hundredths of a radian.
        ``nu_split``: D0 over the volume, D_nu = D - D0 on the axis (Gerstmayr, Matikainen & Mikkola 2008); locks too.
        ``elastic_line``: strains of the axis and the section's moments, integrated exactly; locks too.
        ``assumed_strain``: the same strains, thickness from the nodes, shear at 0, 1/2, 1, membrane at 3 points,
        bending and torsion at 2. Of these two the torsion is that of the section's own J (St Venant): sections turn and
        shear as a whole, and nothing resists their warping. Products Iyz couple both bendings, and the position of the
        shear centre couples shear and torsion.
    length : float, m, without stress
    section : CrossSection; ``full`` and ``nu_split`` need rectangles, which twist without warping (J = Iy + Iz)
    material : Material
    rest : (24,) float, optional, coordinates of the shape without stress; straight if not given

    Returns
    -------
    dict of Form
        Of each of `PARTS`.

    Raises
    ------
    InputError
        If the formulation is not known, the length not above 0, or the section not of a kind that it can take.
    """
    _check_length(length)
    nu = material.nu
    if formulation not in FORMULATIONS:
        raise InputError(f"formulation of a beam is {formulation!r}; it must be one of {', '.join(FORMULATIONS)}")
    if formulation in ("full", "nu_split"):
        if material.shear is not None:
            raise InputError(
                f"formulation of a beam is {formulation!r}, which needs a material without the key `shear`"
            )
        if nu == 0.5:
            raise InputError(
                f"poisson_ratio is 0.5; formulation {formulation!r} of a beam, a continuum, needs one below 0.5; use "
                f"assumed_strain"
            )
        D = elasticity(material)
        if formulation == "full":
            H = _volume(length, section, lambda s: D, nu)
        else:

            def axis(xi: float) -> Array:
                s = section.at(xi).properties(nu)
                D_nu = (D - uncoupled_elasticity(material, s))[:3, :3]
                rows = line_rows(length, xi)
                W = np.array([rows["axial"], rows["thick_y"], rows["thick_z"]])
                return s.area * product(W.T, D_nu, W)

            H = _volume(length, section, lambda s: uncoupled_elasticity(material, s), nu)
            H += _integrate(gauss(6), length, axis)
        parts = _line_parts(length, section, material, EXACT, warping=False)
        parts["section"] = H - parts["membrane"] - parts["bending"] - parts["torsion"]
    else:
        rules = EXACT if formulation == "elastic_line" else ASSUMED
        parts = _line_parts(length, section, material, rules, warping=True)
    g0 = products(straight_beam(length) if rest is None else rest)
    return {name: _at_rest(H, g0) for name, H in parts.items()}


def beam_form(
    formulation: str, length: float, section: CrossSection, material: Material, *, rest: ArrayLike | None = None
) -> Form:
    """The whole form of a beam element; arguments as of `beam_parts`."""
    parts = beam_parts(formulation, length, section, material, rest=rest)
    return functools.reduce(operator.add, parts.values())


def line_strains(formulation: str, length: float, xi: float, e: ArrayLike) -> Array:
    """Strains of an element's axis: `kernels.ancf.STRAINS`, (9,); of a cable the strain alone, (1,)."""
    if formulation in ("cable", "cable_stretch"):
        size = norm(product(nodal_vectors(e).T, np.array(slope_factors(length, xi))))
        return np.array([size - 1.0 if formulation == "cable_stretch" else 0.5 * (size * size - 1.0)])
    unit = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0])
    return product(np.array(list(line_rows(length, xi).values())), products(e)) - 0.5 * unit


def line_stiffness(xi: float, section: CrossSection, material: Material) -> Array:
    """Stiffness of the section against each of `kernels.ancf.STRAINS`, without coupling; (9,), N and N m2.

    Its forces are the axial force, shear forces, torque, the two bending moments (int y S_xx dA, int z S_xx dA), and
    three that hold the section in shape.
    """
    s, E, G = section.at(xi).properties(material.nu), material.E, material.shear_modulus
    A = s.area
    return np.array([E * A, G * A * s.shear_y, G * A * s.shear_z, G * s.J, E * s.Iz, E * s.Iy, E * A, E * A, G * A])


def section_stiffness(xi: float, section: CrossSection, material: Material) -> Array:
    """Stiffness of the section between `kernels.ancf.STRAINS` and their forces; (9, 9), N, N m and N m2."""
    s = section.at(xi).properties(material.nu)
    S = np.diag(line_stiffness(xi, section, material))
    S[4, 5] = S[5, 4] = material.E * s.Iyz
    at_centre = np.eye(9)  # strains at the shear centre from those of the axis
    at_centre[1, 3], at_centre[2, 3] = -s.centre_z, s.centre_y
    return product(at_centre.T, S, at_centre)


# ---------------------------------------------------------------------------------------------- the cable


def _curvature(length: float, xi: float) -> Array:
    """r,xx as factors of r_p,x, d and r_q,x."""
    return np.array([(6.0 * xi - 4.0) / length, (6.0 - 12.0 * xi) / length**2, (6.0 * xi - 2.0) / length])


def cable_parts(
    length: float, section: CrossSection, material: Material, *, rest: ArrayLike | None = None
) -> dict[str, Form]:
    """The form of a thin cable, split into membrane and bending; arguments as of `cable_form`."""
    _check_length(length)

    def properties(xi: float) -> Properties:
        return section.at(xi).properties(material.nu)

    def membrane(xi: float) -> Array:
        slope = np.array(slope_factors(length, xi))
        return _stiff(material.E * properties(xi).area, 0.5 * product_row(slope, slope))

    def bending(xi: float) -> Array:
        a = _curvature(length, xi)
        return material.E * properties(xi).Iz * product_row(a, a)

    g0 = products(straight_cable(length) if rest is None else rest)
    # U = 1/2 int EI r,xx . r,xx dx is linear in g: it stands in h alone
    h = -0.5 * _integrate(gauss(4), length, bending)
    return {
        "membrane": _at_rest(_integrate(gauss(3), length, membrane), g0),
        "bending": Form(np.zeros((6, 6)), h, 0.0),
    }


def cable_form(length: float, section: CrossSection, material: Material, *, rest: ArrayLike | None = None) -> Form:
    """The form of a thin cable element, E A against stretch and E Iz against bending in whatever plane.

    Parameters
    ----------
    length : float, m, without stress
    section : CrossSection
    material : Material
    rest : (12,) float, optional
        Coordinates of a shape whose stretch is without stress. Its curvature is not: a cable is straight at rest.

    Raises
    ------
    InputError
        If the length is not above 0.
    """
    parts = cable_parts(length, section, material, rest=rest)
    return parts["membrane"] + parts["bending"]


def cable_bending(length: float, section: CrossSection, material: Material) -> Array:
    """B : (2, 4): the root of weight and EI times r,xx at two points, and eps, as `families.beams.cable` takes it.

    Notes
    -----
    The square of what the first three columns make of the element's vectors is int EI r,xx . r,xx dx (exactly, unless
    the section is tapered).
    """
    _check_length(length)
    B = np.empty((2, 4))
    for row, (xi, weight) in zip(B, gauss(2), strict=True):
        root = np.sqrt(weight * length * material.E * section.at(xi).properties(material.nu).Iz)
        row[:3] = root * _curvature(length, xi)
        row[3] = (root * STRAIGHT / length) ** 2
    return B


def cable_stretch_parts(
    length: float, section: CrossSection, material: Material, *, rest: ArrayLike | None = None
) -> dict[str, Form]:
    """The constants of `cable_stretch_form`, with membrane and bending one at a time; their energies add up."""
    _check_length(length)
    v = nodal_vectors(straight_cable(length) if rest is None else rest)
    rows, stretches = np.zeros((6, 6)), np.zeros(6)
    weights = {"membrane": rows.copy(), "bending": rows.copy()}
    for p, (xi, weight) in enumerate(gauss(3)):
        s = section.at(xi).properties(material.nu)
        rows[p] = *slope_factors(length, xi), *_curvature(length, xi)
        stretches[p] = 1.0 if rest is None else norm(product(v.T, rows[p, :3]))
        weights["membrane"][3, p] = weight * length * material.E * s.area
        weights["bending"][3, 3 + p] = weight * length * material.E * s.Iz
    return {name: Form(rows + weight, stretches.copy(), 0.0) for name, weight in weights.items()}


def cable_stretch_form(
    length: float, section: CrossSection, material: Material, *, rest: ArrayLike | None = None
) -> Form:
    """Constants of the thin cable with engineering strain, for `families.beams.cable.stretch_force`.

    They stand where those of a quadratic form would, but are none: not to be added, nor given to other elements.

    Parameters
    ----------
    length : float, m, without stress
    section : CrossSection
    material : Material
    rest : (12,) float, optional
        Coordinates of a shape whose stretch is without stress. Its curvature is not: a cable is straight at rest.

    Raises
    ------
    InputError
        If the length is not above 0.
    """
    membrane, bending = cable_stretch_parts(length, section, material, rest=rest).values()
    H = membrane.H.copy()
    H[3] += bending.H[3]
    return Form(H, membrane.h, 0.0)


def cable_stretch_energy(form: Form, e: ArrayLike) -> Any:
    """Energy (J) of an element of `cable_stretch_form` with the coordinates e, an analytic function of them."""
    v = nodal_vectors(e)
    a, q = product(form.H[:3, :3], v), product(form.H[:3, 3:], v)
    square, turn = np.sum(a * a, axis=1), np.cross(a, q)
    bent = np.sum(turn * turn, axis=1) / square**2
    return 0.5 * np.sum(form.H[3, :3] * (np.sqrt(square) - form.h[:3]) ** 2 + form.H[3, 3:] * bent)


def _at_rest(H: Array, g0: Array) -> Form:
    H = 0.5 * (H + H.T)
    h = product(H, g0)
    return Form(H, h, 0.5 * dot(g0, h))


def _check_length(length: float) -> None:
    if not (np.isfinite(length) and length > 0.0):
        raise InputError(f"length of an element is {length}; it must be above 0 and finite")
