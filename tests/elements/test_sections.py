"""Section properties against tables, quadrature and thin-walled theory; materials by name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from book import Book
from evolvent import InputError, parts
from evolvent.elements import Angle, Arc, General, IBeam, Material, Rectangle, Taper, beam_parts
from evolvent.elements.materials import CFRP, CFRP_UD, MATERIALS, SOURCES

Array = np.ndarray


@pytest.mark.parametrize(("ratio", "factor"), [(1.0, 0.1406), (2.0, 0.2287), (4.0, 0.2808), (10.0, 0.3123)])
def test_torsion_constant_of_rectangles(ratio: float, factor: float) -> None:
    """Timoshenko & Goodier (1970), table of section 109: J = factor times width times thickness^3."""
    for sides in ((0.01, 0.01 * ratio), (0.01 * ratio, 0.01)):
        J = Rectangle(thickness=sides[0], width=sides[1]).properties(0.3).J
        assert factor * ratio * 1e-8 == pytest.approx(J, rel=4e-4)


def by_cells(inside: Any, size: float, n: int = 1200) -> tuple[float, Array, Array]:
    """Area, centroid (y, z) and moments (zz, yy, yz) of a shape by the middles of small squares."""
    at = size * ((np.arange(n) + 0.5) / n - 0.5)
    y, z = np.meshgrid(at, at, indexing="ij")
    mask = inside(y, z)
    y, z, cell = y[mask], z[mask], (size / n) ** 2
    centre = np.array([y.mean(), z.mean()])
    y, z = y - centre[0], z - centre[1]
    return cell * y.size, centre, cell * np.array([(z * z).sum(), (y * y).sum(), (y * z).sum()])


def test_angle_and_i_by_quadrature() -> None:
    angle = Angle(height=0.04, width=0.03, thickness=0.003).properties(0.3)
    area, centre, moments = by_cells(
        lambda y, z: (abs(y) < 0.02) & (abs(z) < 0.015) & ((y < -0.017) | (z < -0.012)), 0.04
    )
    assert (angle.area, angle.Iy, angle.Iz, angle.Iyz) == pytest.approx((area, *moments), rel=5e-3)
    corner = np.array([-0.0185, -0.0135])  # where the centre lines cross
    assert (angle.centre_y, angle.centre_z) == pytest.approx(tuple(corner - centre), rel=5e-3)
    assert angle.J == pytest.approx((0.0385 + 0.0285) * 0.003**3 / 3.0, rel=1e-12)
    i = IBeam(height=0.1, width=0.05, web=0.004, flange=0.006).properties(0.3)
    area, _, moments = by_cells(
        lambda y, z: (abs(y) < 0.05) & (abs(z) < 0.025) & ((abs(y) > 0.044) | (abs(z) < 0.002)), 0.1
    )
    assert (i.area, i.Iy, i.Iz) == pytest.approx((area, *moments[:2]), rel=5e-3)
    assert abs(moments[2]) < 1e-15
    assert i.J == pytest.approx((0.1 * 0.006**3 + 0.094 * 0.004**3) / 3.0, rel=1e-12)


def walls(R: float, angle: float, t: float) -> Array:
    """Area, moments about z and y, shear factors along y and z, place of the shear centre: of a thin arc."""
    th = np.linspace(-0.5 * angle, 0.5 * angle, 40001)
    y, z, ds = R * np.cos(th), R * np.sin(th), R * (th[1] - th[0])
    w = np.full(th.size, ds * t)
    w[[0, -1]] *= 0.5
    y -= (w * y).sum() / w.sum()
    Iz, Iy = (w * y * y).sum(), (w * z * z).sum()
    Q = [np.append(0.0, np.cumsum(0.5 * (f[1:] + f[:-1]) * ds * t)) for f in (y, z)]
    factors = [moment**2 / (w.sum() * (q * q * w).sum() / t**2) for moment, q in ((Iz, Q[0]), (Iy, Q[1]))]
    centre = -(Q[1] / Iy).sum() * R * ds - (R * np.cos(th) - y)[0]
    return np.array([w.sum(), Iz, Iy, *factors, centre])


@pytest.mark.parametrize("angle", [0.8, 2.0, math.pi, 2.0 * math.pi])
def test_arc_against_thin_walls(angle: float) -> None:
    R, t = 0.02, 1e-5
    s = Arc(radius=R, angle=angle, thickness=t).properties(0.3)
    found = [s.area, s.Iz, s.Iy, s.shear_y, s.shear_z, s.centre_y]
    assert found == pytest.approx(walls(R, angle, t).tolist(), rel=2e-4)
    assert pytest.approx(R * angle * t**3 / 3.0, rel=1e-12) == s.J
    assert (s.Iyz, s.centre_z) == (0.0, 0.0)


def test_slit_tube() -> None:
    """Shear centre 2 R from the tube's axis, away from the slit; J is 3 (R/t)^2 below the closed tube's."""
    s = Arc(radius=0.02, angle="360 deg", thickness=2e-4).properties(0.3)
    assert s.centre_y == pytest.approx(0.04, rel=1e-12)
    assert s.shear_z == pytest.approx(1.0 / 6.0, rel=1e-12)
    assert s.Iy == pytest.approx(s.Iz, rel=1e-12)
    assert 2.0 * math.pi * 0.02**3 * 2e-4 / s.J == pytest.approx(3.0 * 100.0**2, rel=1e-12)


def test_shear_factor_of_an_i() -> None:
    """At nu = 0 that of shear flows: int (Q/t)^2 dA A/I^2, in the web and out along the flanges."""
    b, d, web, flange = 0.05, 0.094, 0.0004, 0.0006
    s = IBeam(height=d + flange, width=b, web=web, flange=flange)
    x = np.linspace(0.0, 0.5 * d, 20001)
    I = 2.0 * b * flange * (0.5 * d) ** 2 + web * d**3 / 12.0  # noqa: E741
    Q = b * flange * 0.5 * d + 0.5 * web * ((0.5 * d) ** 2 - x * x)
    in_web = 2.0 * np.trapezoid(Q * Q / web, x)
    out = np.linspace(0.0, 0.5 * b, 2001)
    in_flanges = 4.0 * np.trapezoid((flange * out * 0.5 * d) ** 2 / flange, out)
    area = 2.0 * b * flange + d * web
    assert s.properties(0.0).shear_y == pytest.approx(I * I / (area * (in_web + in_flanges)), rel=1e-3)


def test_a_taper_of_general_sections_with_shear_centres() -> None:
    general = {"area": 1e-4, "Iy": 1e-9, "Iz": 2e-9, "J": 1e-9}
    ends = (General(**general, shear_centre=(0.0, 0.01)), General(**general, Iyz=1e-9, shear_centre=(0.02, 0.03)))
    middle = Taper(root=ends[0], tip=ends[1]).at(0.5)
    assert isinstance(middle, General)
    assert (middle.Iyz, *middle.shear_centre) == pytest.approx((5e-10, 0.01, 0.02))


def test_every_material_has_a_source_and_an_expansion() -> None:
    assert set(SOURCES) == set(MATERIALS)
    assert all(m.thermal_expansion is not None for m in MATERIALS.values())
    assert parts.Beam(length=1, section={"circle": 0.01}, material="titanium", elements=1).material.E == 110.3e9


def test_quasi_isotropic_laminate() -> None:
    """E, nu and the expansion of CFRP follow from the ply's by laminate theory."""
    E1, E2, G, nu, a1, a2 = CFRP_UD.E, 10.3e9, CFRP_UD.shear_modulus, CFRP_UD.nu, CFRP_UD.thermal_expansion, 22.5e-6
    assert a1 is not None
    part = 1.0 - nu * nu * E2 / E1
    Q11, Q22, Q12 = E1 / part, E2 / part, nu * E2 / part
    first = (3.0 * Q11 + 3.0 * Q22 + 2.0 * Q12 + 4.0 * G) / 8.0
    fourth = (Q11 + Q22 + 6.0 * Q12 - 4.0 * G) / 8.0
    assert pytest.approx((1.0 - (fourth / first) ** 2) * first, rel=1e-3) == CFRP.E
    assert fourth / first == pytest.approx(CFRP.nu, rel=1e-3)
    wanted = (a1 * (Q11 + Q12) + a2 * (Q22 + Q12)) / (Q11 + Q22 + 2.0 * Q12)
    assert CFRP.thermal_expansion == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Angle(height=0.04, width=0.003, thickness=0.003), "legs' thickness must be below height and width"),
        (lambda: IBeam(height=0.01, width=0.05, web=0.004, flange=0.006), "thinner than the height"),
        (lambda: IBeam(height=0.1, width=0.003, web=0.004, flange=0.006), "thicker than the flanges are wide"),
        (lambda: Arc(radius=0.02, angle=0.05, thickness=1e-4), "angle is 2.86479 deg; it must be from 5.73 to 360 deg"),
        (lambda: Arc(radius=0.02, angle=7.0, thickness=1e-4), "angle is 401.07 deg"),
        (lambda: Arc(radius=0.02, angle=1.0, thickness=0.02), "must be below its radius"),
        (lambda: General(area=1e-4, Iy=1e-9, Iz=1e-9, J=1e-9, Iyz=1e-9), "Iyz\\^2 must be below Iy Iz"),
        (
            lambda: parts.Beam(length=1, section={"circle": 0.01}, material="titanum", elements=1),
            "did you mean 'titanium'",
        ),
        (
            lambda: beam_parts("full", 1.0, Rectangle(thickness=0.01, width=0.01), CFRP_UD),
            "needs a material without the key `shear`",
        ),
        (
            lambda: parts.Beam(
                length=1, section={"circle": 0.01}, material="steel", elements=3, grading=(1, 2)
            ).start_nodes("boom"),
            "boom.grading has 2 values; it must be one value, or 3",
        ),
        (
            lambda: parts.Beam(
                length=1, section={"circle": 0.01}, material="steel", elements=3, formulation="cable",
                inertia={"offset": (0.1, 0)},
            ).start_nodes("boom"),
            "boom.inertia.offset is given, but boom.formulation is 'cable'",
        ),
        (
            lambda: parts.Beam(
                length=1, section={"circle": 0.01}, material="steel", elements=3, inertia={"inertia_yz": 1.0}
            ).start_nodes("boom"),
            "boom.inertia.inertia_yz is 1 kg m; its square must be below",
        ),
        (
            lambda: parts.Beam(
                length=1, section={"circle": 0.01}, material="steel", elements=3, formulation="cable",
                curvature=(0, 0, 1),
            ).start_nodes("boom"),
            "boom.curvature is given and boom.formulation is 'cable'",
        ),
    ],
)  # fmt: skip
def test_refusals(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_a_shear_modulus_of_its_own() -> None:
    plain, own = Material(young_modulus=1e9, density=1.0), Material(young_modulus=1e9, density=1.0, shear=1e7)
    assert (plain.shear_modulus, own.shear_modulus) == pytest.approx((1e9 / 2.6, 1e7))


def prandtl(mask: Array, h: float) -> float:
    """Torsion constant by Prandtl's stress function on a grid of inner points, 5-point Laplacian: J = 2 int phi dA."""
    number = np.full(mask.shape, -1)
    number[mask] = np.arange(mask.sum())
    rows, columns = [], []
    for axis in (0, 1):
        for a, b in ((number, np.roll(number, -1, axis)), (number, np.roll(number, 1, axis))):
            both = (a >= 0) & (b >= 0)
            rows.append(a[both])
            columns.append(b[both])
    i, j = np.concatenate(rows), np.concatenate(columns)
    n = int(mask.sum())
    A = sparse.diags_array(np.full(n, 4.0)) - sparse.coo_array((np.ones(i.size), (i, j)), shape=(n, n))
    phi = spsolve(A.tocsc(), np.full(n, 2.0 * h * h))
    return 2.0 * h * h * float(phi.sum())


def test_torsion_of_thin_walls_against_the_stress_function(book: Book) -> None:
    """The thin walls' sum b t^3/3 leaves out ends and corners, some per cent."""
    h = 0.15e-3
    inner = {
        "angle 40 x 30 x 3 mm": lambda y, z: (y < 0.003 - h / 2) | (z < 0.003 - h / 2),
        "I 40 x 30 x 3 x 3 mm": lambda y, z: (
            (y < 0.003 - h / 2) | (y > 0.037 + h / 2) | (abs(z - 0.015) < 0.0015 - h / 2)
        ),
    }
    sections = (
        Angle(height=0.04, width=0.03, thickness=0.003), IBeam(height=0.04, width=0.03, web=0.003, flange=0.003),
    )  # fmt: skip
    y, z = np.meshgrid(np.arange(268) * h, np.arange(202) * h, indexing="ij")
    within = (y > h / 2) & (y < 0.04 - h / 2) & (z > h / 2) & (z < 0.03 - h / 2)
    for (name, shape), section in zip(inner.items(), sections, strict=True):
        wanted = prandtl(within & shape(y, z), h)
        book(
            "Statics of beams", f"Torsion constant of thin walls, {name}", reference=f"{1e12 * wanted:.4g} mm^4",
            source="Prandtl's stress function, finite differences", allowed=0.05,
            error=abs(section.properties(0.3).J / wanted - 1.0),
        )  # fmt: skip
    square = prandtl((y > h / 2) & (y < 0.03 - h / 2) & (z > h / 2) & (z < 0.03 - h / 2), h)
    assert square == pytest.approx(Rectangle(thickness=0.03, width=0.03).properties(0.3).J, rel=1e-3)
