"""Membrane strips: tension and twist, spin, root pitch, sunlight, against closed forms (`closed_forms.membranes`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from book import Book
from evolvent import System, parts
from evolvent.closed_forms import driven_twist, spinning_strip_modes, sunlight_coning
from evolvent.elements import Circle, General, Material, Rectangle, Strip, Tube
from evolvent.equations import implicit
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.modal.linear import linearize
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent_base.errors import InputError
from rods.test_rod_kernels import by_differences, forces

Array = np.ndarray
#: Of a strip of length 1 and mass 1 at the rate 1: strain of its root, and a chord beside which it is long.
STRAIN, CHORD = 1e-6, 2e-3
MESHES = (8, 16, 32)
SPIN = (0.0, 0.0, 1.0)
RATIOS = (0.0, 0.5, 1.0, 2.0, 3.0)


def towards_the_tip(elements: int) -> tuple[float, ...]:
    """Lengths of elements with nodes at sin(s pi/2), s uniform: in this variable the tension has no singular end."""
    return tuple(np.diff(np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, elements + 1))))


def strip(elements: int, *, chord: float = CHORD, strain: float = STRAIN, pitch: float = 0.0, **keys: Any) -> parts.Rod:
    """A strip along x with its normal along z, of hardly any stiffness but that of its tension."""
    thickness = 1e-9
    material = Material(
        young_modulus=0.5 / (strain * chord * thickness), poisson_ratio=0.0, density=1.0 / (chord * thickness)
    )
    return parts.Rod(
        length=1.0, section=Strip(thickness=thickness, width=chord), material=material, elements=elements,
        grading=keys.pop("grading", towards_the_tip(elements)), normal=(0.0, -math.sin(pitch), math.cos(pitch)),
        angular_velocity=SPIN, **keys,
    )  # fmt: skip


def on_the_axis(elements: int, **keys: Any) -> System:
    """A strip whose root turns freely about both axes across it, at a pitch that is held."""
    system = System()
    system.add(strip(elements, **keys), "strip")
    system.add(parts.RigidBody(motion="driven", rate=SPIN[2]), "base")
    hinge = parts.Joint(a=("base", (0, 0, 0)), b="strip.root", type="universal", axis=(0, 1, 0), axis_b=(0, 0, 1))
    system.add(hinge, "hinge")
    return system


def romberg(values: Array) -> Array:
    """Limit of values (3, ...) on meshes of h, h/2 and h/4, whose errors are of order 2 and then 4."""
    first = (4.0 * values[1:] - values[:-1]) / 3.0
    return np.asarray((16.0 * first[1] - first[0]) / 15.0)


def nearest(found: Array, wanted: Array) -> Array:
    return np.asarray(found[np.abs(found[:, None] - wanted).argmin(axis=0)])


@pytest.mark.slow
def test_modes_of_a_spinning_strip(book: Book) -> None:
    """Errors of flap fall with order 3 (1e-4 at 16 elements), of twist with order 2: its inertia is lumped."""
    flap, lag, twist = spinning_strip_modes(3)
    found = []
    for elements in MESHES:
        modes = on_the_axis(elements).modes(count=12, rotating=SPIN)
        square = modes.frequency**2
        slender = on_the_axis(elements, chord=6e-6, strain=2e-5).modes(count=12, rotating=SPIN)
        flaps = nearest(square, flap)
        found.append([flaps, nearest(np.setdiff1d(square, flaps), twist), nearest(slender.frequency**2, lag)])
    rows = np.array(found)
    flaps, twists, lags = rows[:, 0], rows[:, 1], rows[:, 2]
    assert np.abs(flaps[1] / flap - 1.0).max() < 2e-4
    assert np.abs(twists[1] / twist - 1.0).max() < 0.025
    same = {"reference": "closed form", "source": "MacNeal 1967", "allowed": 1e-4}
    book("Modes", "flap of a spinning membrane strip: 1, 6, 15 (rod, 32 elements)", **same,
         error=float(np.abs(flaps[2] / flap - 1.0).max()))  # fmt: skip
    book("Modes", "twist of a spinning membrane strip: 2, 7, 16 (rod, limit of 8, 16 and 32 elements)", **same,
         error=float(np.abs(romberg(twists) / twist - 1.0).max()))  # fmt: skip
    book("Modes", "lag of a spinning membrane strip: 0, 5, 14 (rod, 32 elements)", **same,
         error=float(np.abs(lags[2] - lag).max() / 14.0))  # fmt: skip


@pytest.mark.slow
def test_twist_by_a_driven_root_pitch(book: Book) -> None:
    """Pitch of the tip over that of the root; its reciprocal is extrapolated, which has no poles."""
    found = []
    for elements in MESHES:
        system = System()
        horn = parts.RigidBody(mass=1e-3, inertia=(1e-9, 1e-9, 1e-9), angular_velocity=SPIN)
        system.add(horn, "horn")
        system.add(strip(elements), "strip")
        system.add(parts.RigidBody(motion="driven", rate=SPIN[2]), "base")
        system.add(parts.Joint(a=("base", (0, 0, 0)), b="horn", type="revolute", axis=(1, 0, 0)), "pitch")
        hinge = parts.Joint(a="horn", b="strip.root", type="universal", axis=(0, 1, 0), axis_b=(0, 0, 1))
        system.add(hinge, "hinge")
        outputs = ["strip.root.rotation.x", "strip.tip.rotation.x"]
        model = linearize(system.assemble(), ["horn.torque.x"], outputs, rotating=SPIN)
        H = model.frequency_response(np.array(RATIOS[1:])).response.reshape(len(RATIOS) - 1, 2)
        run = on_the_axis(elements, pitch=1e-3).equilibrium(rotating=SPIN)
        turn = np.asarray(run["strip"]["twist_angle"])[-1]
        found.append([1e-3 / (1e-3 + turn[-1]), *(H[:, 0] / H[:, 1]).real])
    limit = 1.0 / romberg(np.array(found))
    wanted = np.array([driven_twist(ratio, np.ones(1))[0] for ratio in RATIOS])
    book(
        "Modes", "tip over root pitch of a spinning strip, constant and at 0.5, 1, 2, 3 times the rate (limit)",
        reference="closed form", source="Legendre functions", error=float(np.abs(limit / wanted - 1.0).max()),
        allowed=1e-4,
    )  # fmt: skip


@pytest.mark.slow
def test_coning_under_sunlight(book: Book) -> None:
    p, errors = 1e-5, []
    for elements in MESHES:
        system = on_the_axis(elements)
        system.add(parts.Radiation(along="strip", pressure=0.5 * p / CHORD, specular=1.0), "light")
        run = system.equilibrium(rotating=SPIN)
        place, slope = np.asarray(run["strip"]["position"])[-1], np.asarray(run["strip"]["slope"])[-1]
        w = sunlight_coning(place[:, 0])
        errors.append([np.abs(place[:, 2] / p - w).max() / w[-1], abs(slope[0, 2] / p / 2.0 - 1.0)])
    found = np.array(errors)
    assert found[1, 1] < 3e-3
    book(
        "Statics of beams", "coning of a spinning strip under sunlight: 2 p ln(1 + x/l) (rod, 16 elements)",
        reference="closed form", source="closed_forms.membranes", error=float(found[1, 0]), allowed=1e-4,
    )  # fmt: skip


SOFT = Material(young_modulus=2e6, poisson_ratio=0.3, density=1000.0)
FILM = Strip(thickness=2e-3, width=0.1)


def hung(section: Any = FILM, **keys: Any) -> System:
    """A strip that hangs from a clamp with a body at its end, on which a torque about the strip acts."""
    system = System(gravity=(0.0, 0.0, -9.81))
    keys = {"elements": 4, "direction": (0, 0, -1)} | keys
    system.add(parts.Rod(length=1.0, section=section, material=SOFT, **keys), "strip")
    system.add(parts.Joint(a=(0, 0, 0), b="strip.root", type="clamp"), "clamp")
    system.add(parts.RigidBody(mass=1.0, inertia=(0.001, 0.001, 0.001), position=(0, 0, -1)), "body")
    system.add(parts.Joint(a="body", b="strip.tip", type="clamp"), "end")
    system.add(parts.Load(at="body", torque=(0.0, 0.0, 0.02)), "torque")
    return system


def test_torque_of_a_strip_under_tension() -> None:
    """GJ k + N r2 k + E A (r4 - r2^2) k^3/2: a strip twisted by a torque about its axis, which hangs under a weight."""
    weight, turn = 20.0, 1.5
    system = System()
    system.add(parts.Rod(length=1.0, section=FILM, material=SOFT, elements=6), "strip")
    system.add(parts.Joint(a=(0, 0, 0), b="strip.root", type="clamp"), "clamp")
    system.add(parts.Joint(a=(0, 0, 0), b="strip.tip", type="point-on-line", axis=(1, 0, 0)), "guide")
    system.add(parts.Load(at="strip.tip", force=(weight, 0, 0)), "weight")
    r2, r4 = FILM.fibre_means()
    own = FILM.properties(0.3)
    EA, GJ = SOFT.E * own.area, SOFT.shear_modulus * own.J
    moment = (GJ + weight * r2) * turn + 0.5 * EA * (r4 - r2**2) * turn**3
    system.add(parts.Load(at="strip.tip", torque=(moment, 0, 0)), "torque")
    one = system.equilibrium()["strip"]
    assert float(one["twist_angle"][-1, -1]) == pytest.approx(turn, rel=1e-9)
    assert np.asarray(one["torsional_moment"])[-1] == pytest.approx(np.full(6, moment), rel=1e-9)
    assert np.asarray(one["axial_force"])[-1] == pytest.approx(np.full(6, weight), rel=1e-9)
    energy = 0.5 * GJ * turn**2 + 0.5 * weight**2 / EA + EA * (r4 - r2**2) * turn**4 / 8.0
    assert float(one["energy_elastic"][-1]) == pytest.approx(energy, rel=1e-9)


def test_energy_momentum_conserves_the_energy_of_a_free_strip() -> None:
    """It tumbles by 0.2 rad a step, curved and twisted."""
    system = System()
    start = {"curvature": (2.0, 0.0, 0.5), "angular_velocity": (30.0, 5.0, 20.0)}
    rod = parts.Rod(length=1.0, section=FILM, material=SOFT, elements=4, **start)
    system.add(rod, "strip")
    assembly = system.assemble()
    assert np.all(assembly.model.rod_elements["fibres"] > 0.0)
    found = solve_energy(assembly, samples=0.02 * np.arange(51), step=0.01, spectral_radius=1.0)
    assert found.success, found.message
    energy = found.kept.balance.kinetic + found.kept.balance.elastic
    assert found.kept.balance.elastic.max() > 0.01 * energy[0]
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-10


@pytest.mark.slow
def test_methods_agree() -> None:
    ends = []
    for method, keys in (("dopri5", {}), ("generalized-alpha", {"step": 1e-3}), ("energy-momentum", {"step": 1e-3})):
        run = hung(elements=2).simulate(until=0.1, every=0.05, method=method, **keys)
        ends.append(float(run["strip"]["twist_angle"][-1, -1]))
    assert ends[1:] == pytest.approx(ends[:1] * 2, rel=1e-4)


def test_which_sections_couple() -> None:
    """Means of rho^2 and rho^4 against sums over fibres."""
    x = np.linspace(-0.5, 0.5, 2001)
    y, z = np.meshgrid(0.02 * x, 0.1 * x)
    for power, found in zip((1, 2), Rectangle(thickness=0.02, width=0.1).fibre_means(), strict=True):
        assert found == pytest.approx(np.mean((y**2 + z**2) ** power), rel=3e-3)
    assert Circle(radius=0.1).fibre_means() == pytest.approx((0.005, 1e-4 / 3.0))
    assert Tube(radius=0.1, thickness=0.1).fibre_means() == pytest.approx(Circle(radius=0.1).fibre_means())
    assert Tube(radius=0.1, thickness=1e-6).fibre_means() == pytest.approx((0.01, 1e-4), rel=1e-4)
    general = General(area=1e-3, Iy=1e-8, Iz=1e-8, J=1e-8)
    with pytest.raises(InputError, match=r"tension_twist is true, but .* of the kind General; it needs a strip"):
        hung(general, tension_twist=True).assemble()
    system = hung()
    system.add(parts.ThermalLoad(part="strip", temperature={"constant": 10.0}), "heat")
    with pytest.raises(InputError, match="a rod whose tension resists twist"):
        system.assemble()


LIGHT = 4.56e-6


def lit(**keys: Any) -> System:
    """A strip of 2 m with its normal along y, curved, on the ground."""
    system = System()
    rod = parts.Rod(length=2.0, section=FILM, material=SOFT, elements=4, curvature=(1.0, 0.2, 0.3))
    system.add(rod, "strip")
    system.add(parts.Radiation(**({"along": "strip", "pressure": LIGHT, "specular": 1.0} | keys)), "light")
    return system


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_light_on_a_strip_by_its_attitude(side: float) -> None:
    """Of each node's share of the strip, with the normal of its section; either side of the strip may be lit."""
    specular, diffuse, direction = 0.5, 0.3, side * np.array([0.3, 0.8, -0.5])
    system = lit(direction=tuple(direction), specular=specular, diffuse=diffuse)
    run = system.simulate(until=1e-3, every=1e-3)
    s = direction / np.linalg.norm(direction)
    turns = Rotation.from_quat(np.asarray(run["strip"]["attitude"])[0], scalar_first=True)
    total = np.zeros(3)
    for length, n in zip(system.parts["strip"].centres()[0], turns.as_matrix()[:, :, 1], strict=True):
        c = abs(s @ n)
        dark = n * np.sign(s @ n)
        total += LIGHT * 0.1 * length * c * ((1 - specular) * s + (2 * specular * c + 2 / 3 * diffuse) * dark)
    assert np.asarray(run["light"]["force"])[0] == pytest.approx(total, rel=1e-12)
    assert total @ s > 0.0


def test_light_on_a_strip_has_times() -> None:
    run = lit(start=0.5, until=1.0).simulate(until=1.5, every=0.25)
    pushes = np.abs(np.asarray(run["light"]["force"])).max(axis=1) > 0.0
    assert pushes.tolist() == [False, False, True, True, False, False, False]


def test_tangent_of_light_on_a_strip() -> None:
    assembly = lit(direction=(0.3, 0.8, -0.5), pressure=1e3, specular=0.5, diffuse=0.3).assemble()
    y, matrix = assembly.y.copy(), matrix_of(assembly.model)
    forces(assembly, y)
    implicit.tangent(0.0, y, np.zeros(0), 0.0, 0.0, 1.0, assembly.model, matrix)
    K = sparse_of(matrix).toarray()
    assert K == pytest.approx(by_differences(assembly, y), abs=1e-8 * np.abs(K).max())
    light = K - K.T  # elastic forces have a potential, light has none
    assert np.abs(light).max() > 1.0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"along": None}, "light.at is missing; give at, along or over"),
        ({"at": "strip.tip"}, "light.at and light.along are both given"),
        ({"specular": 0.8, "diffuse": 0.3}, "light.specular and light.diffuse add up to 1.1"),
        ({"along": "stripe"}, "'stripe'"),
    ],
)
def test_light_that_is_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        lit(**keys).assemble()


def test_width_of_a_strip_without_one() -> None:
    system = System()
    general = General(area=1e-3, Iy=1e-8, Iz=1e-8, J=1e-8)
    system.add(parts.Rod(length=1.0, section=general, material=SOFT, elements=2), "rod")
    system.add(parts.Radiation(along="rod", pressure=LIGHT, specular=1.0), "light")
    with pytest.raises(InputError, match=r"light\.width is missing; 'rod' is a rod whose section has none"):
        system.assemble()


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.9, 1.2])
def test_a_rod_under_a_tension_beyond_its_elements_warns(share: float) -> None:
    """Above 12 E I/L^2 of an element; a strip has no such limit."""
    width, elements = 0.01, 4
    limit = 12.0 * 70e9 * width**4 / 12.0 * elements**2
    for section in (Rectangle(thickness=width, width=width), Strip(thickness=width, width=width)):
        system = System()
        material = Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0)
        rod = parts.Rod(length=1.0, section=section, material=material, elements=elements, direction=(0.6, 0.0, 0.8))
        system.add(rod, "rod")
        system.add(parts.Joint(a=(0, 0, 0), b="rod.root", type="clamp"), "clamp")
        ramp = [(0.0, 0.0), (0.01, share * limit), (1.0, share * limit)]
        system.add(parts.Load(at="rod.tip", direction=rod.direction, profile=ramp), "pull")
        run = system.simulate(until=0.012, every=2e-4, method="energy-momentum", step=2e-5)
        warned = "its shape is unstable" in run.attrs.get("warning", "")
        assert warned == (share > 1.0 and not isinstance(section, Strip)), section
        tension = float(run["rod/axial_force"].max())
        assert warned or tension == pytest.approx(share * limit, rel=0.04)
