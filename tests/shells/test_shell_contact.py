"""Shells that touch surfaces with both faces: by spheres of their thickness at their nodes, with shares by area."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.elements import Circle
from evolvent_base.errors import InputError
from shells.plates import add_symmetry, material

FLOOR = parts.Plane(normal=(0.0, 0.0, 1.0))
G = 9.81
#: N, of `plate`.
WEIGHT = 0.4 * 0.3 * 0.01 * 1000.0 * G
METHODS = ("generalized-alpha", "energy-momentum")


def plate(**keys: Any) -> parts.Shell:
    """A plate of 10 mm."""
    given = {"size": (0.4, 0.3), "elements": (4, 3), "thickness": 0.01, "material": material(1e7, 0.3)}
    return parts.Shell(**(given | keys))


def over_floor(shell: parts.Shell, **keys: Any) -> System:
    """A shell and the ground at z = 0."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(shell, "panel")
    system.add(parts.Contact(**({"a": "panel", "b": (0, 0, 0), "shape": FLOOR, "stiffness": 2e4} | keys)), "floor")
    return system


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
@pytest.mark.parametrize("method", METHODS)
def test_a_plate_that_falls_flat_comes_to_rest(method: str, normal: Any) -> None:
    """On either face, evenly deep: each node carries the weight of its area."""
    place = (0.0, 0.0 if normal[2] > 0.0 else 0.3, 0.015)
    run = over_floor(plate(position=place, normal=normal), damping=5.0).simulate(
        until=0.6, every=0.02, method=method, tolerance=1e-6
    )
    floor = run["floor"]
    assert floor.normal_force.values[-1] == pytest.approx(WEIGHT, rel=1e-3)
    np.testing.assert_allclose(floor.force.values[-1], [0.0, 0.0, WEIGHT], atol=1e-3 * WEIGHT)
    np.testing.assert_allclose(floor.gap.values[-1], -WEIGHT / 2e4, rtol=1e-3)
    np.testing.assert_allclose(run["panel"].position.values[-1][:, 2], 0.005 - WEIGHT / 2e4, rtol=1e-4)
    corner, inside = floor.point_force.values[-1][[0, 5]]
    assert inside == pytest.approx(4.0 * corner, rel=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_a_sliding_plate_slows_down_by_friction(method: str, book: Book) -> None:
    """By mu g, with the moment of the friction on its face."""
    shell = plate(position=(0.0, 0.0, 0.005 - WEIGHT / 2e4), velocity=(1.0, 0.0, 0.0), stiffness_damping=1e-3)
    system = over_floor(shell, damping=1.0, friction=0.3, bristle_stiffness=1e4, initial_overlap=0.2)
    run = system.simulate(until=0.2, every=0.02, method=method)
    lost = 1.0 - run["panel"].velocity.values[-1, :, 0].mean()
    book(
        "Contact", f"Plate that slides on a plane ({method})", reference="mu g t", source="Coulomb's law",
        error=abs(lost / (0.3 * G * 0.2) - 1.0), allowed=2e-3,
    )  # fmt: skip
    np.testing.assert_allclose(run["floor"].force.values[-1], [-0.3 * WEIGHT, 0.0, WEIGHT], rtol=2e-3, atol=1e-6)
    front, back = run["floor"].point_force.values[-1].reshape(5, 4).sum(axis=1)[[4, 0]]
    assert front > back


def test_a_plate_that_bounces_keeps_its_energy(book: Book) -> None:
    """It falls on a corner, with the conservative law."""
    shell = plate(position=(0.0, 0.0, 0.02), velocity=(0.0, 0.0, -0.5), angular_velocity=(0.5, 1.0, 0.0))
    system = over_floor(shell, law="conservative", stiffness=1e4)
    run = system.simulate(until=0.1, every=2e-3, method="energy-momentum", step=1e-3, spectral_radius=1.0)
    assert float(run["floor"].normal_force.max()) > WEIGHT
    book(
        "Contact", "Plate that bounces on a plane, by steps of 1 ms: energy", reference="constant",
        source="closed form", error=float(np.abs(run.energy_defect).max() / run.energy.max()), allowed=1e-9,
    )  # fmt: skip


def test_a_plate_struck_by_a_ball_keeps_both_momenta() -> None:
    """With friction; the ball flies at it aslant."""
    system = System()
    system.add(plate(position=(-0.2, -0.15, 0.0), material=material(1e6, 0.3)), "panel")
    ball = parts.Sphere(radius=0.1)
    start = {"position": (0.03, 0.02, 0.11), "velocity": (0.5, 0.2, -2.0), "angular_velocity": (0.0, 3.0, 0.0)}
    system.add(parts.RigidBody(mass=0.3, inertia=(1e-3, 1e-3, 1e-3), shape=ball, **start), "ball")
    system.add(parts.Contact(a="panel", b="ball", stiffness=1e5, friction=0.3), "hit")
    run = system.simulate(until=0.05, every=1e-3, method="energy-momentum", step=1e-3)
    assert float(run["hit"].normal_force.max()) > 1.0
    assert float(np.abs(run["hit"].point_friction).max()) > 0.1
    p, panel, x = run["ball"].momentum.values, run["panel"], run["ball"].position.values
    linear = p + panel.momentum.values
    angular = run["ball"].angular_momentum.values + np.cross(x, p) + panel.angular_momentum.values
    for whole in (linear, angular):
        assert np.abs(whole - whole[0]).max() < 1e-12 * np.linalg.norm(whole[0])


def test_a_strip_is_pressed_by_a_cylinder() -> None:
    """A clamped strip carries what presses the roller, and bends as under this force along its middle."""

    def bent(*, pressed: bool) -> Any:
        system = System()
        strip = parts.Shell(
            size=(0.4, 0.05), elements=(16, 1), thickness=1e-3, material=material(1e9), position=(0, -0.025, 0),
            clamped=["x0", "x1"],
        )  # fmt: skip
        system.add(strip, "strip")
        if not pressed:
            for node in (16, 17):
                system.add(parts.Load(at=f"strip[{node}]", force=(0.0, 0.0, -1.0)), f"load {node}")
            return system.equilibrium()
        above = (0.2, 0.0, 0.0205)
        system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=above), "roller")
        system.add(parts.Joint(type="prismatic", a=above, b="roller", axis=(0, 0, 1)), "rail")
        system.add(parts.Load(at="roller", force=(0.0, 0.0, -2.0)), "push")
        shape = parts.Cylinder(radius=0.02, axis=(0, 1, 0))
        system.add(parts.Contact(a="strip", b="roller", shape=shape, stiffness=1e5), "press")
        return system.equilibrium()

    run = bent(pressed=True)
    np.testing.assert_allclose(run["press"].force.values[-1], [0.0, 0.0, -2.0], atol=1e-9)
    place = run["strip"].position.values[-1]
    np.testing.assert_allclose(place, bent(pressed=False)["strip"].position.values[-1], atol=1e-8)
    depth = 1.0 / (1e5 / 32)  # of each of the two nodes in the middle
    assert run["roller"].position.values[-1, 2] == pytest.approx(place[16, 2] + 0.0205 - depth, abs=1e-9)


def test_a_strip_lies_on_a_drum(book: Book) -> None:
    """Its middle is at the radius and half the thickness; it presses by its tension over this radius.

    Notes
    -----
    Without friction the tension N and the moment M keep N + M^2/(2 EI): N = T - EI/(2 r^2) where it lies on the drum.
    """
    radius, thickness, width, length, n, pull, stiffness = 0.1, 1e-3, 0.05, 0.3, 48, 5.0, 1e6
    r = radius + 0.5 * thickness
    along = np.linspace(0.0, length, n + 1)
    angle = np.minimum(along / r, 0.5 * np.pi)
    zero = np.zeros(n + 1)
    line = np.stack([r * np.sin(angle), zero, r * np.cos(angle) - along + r * angle], axis=-1)
    normals = np.stack([np.sin(angle), zero, np.cos(angle)], axis=-1)
    start = np.stack([line + np.array([0.0, side * width, 0.0]) for side in (-0.5, 0.5)], axis=1)
    strip = parts.Shell(
        size=(length, width), elements=(n, 1), thickness=thickness, material=material(1e9), clamped=["x0"],
        position=(0.0, -0.5 * width, r), start=start.tolist(), start_normals=np.stack([normals] * 2, axis=1).tolist(),
    )  # fmt: skip
    system = System()
    system.add(strip, "strip")
    system.add(parts.Load(along="strip.x1", force=(0.0, 0.0, -pull / width)), "pull")
    drum = parts.Cylinder(radius=radius, axis=(0, 1, 0))
    system.add(parts.Contact(a="strip", b=(0, 0, 0), shape=drum, stiffness=stiffness), "drum")
    run = system.equilibrium()
    assert run.attrs["status"] == "success"
    tension = pull - 1e9 * width * thickness**3 / 12.0 / (2.0 * r * r)
    pressed = run["drum"].point_force.values[-1].reshape(n + 1, 2).sum(axis=1)[10:14]  # far from the clamp and the tail
    wanted = tension * length / n / r
    book(
        "Contact", "Strip pulled over a drum: force of a node (48 elements)", reference="(T - EI/2r^2) l/r",
        source="elastica without friction", error=float(np.abs(pressed / wanted - 1.0).max()), allowed=5e-3,
    )  # fmt: skip
    place = run["strip"].position.values[-1][20:28]
    depth = tension * length * width / (stiffness * r * width)
    np.testing.assert_allclose(np.hypot(place[:, 0], place[:, 2]), r - depth, atol=1e-7)


def test_a_ring_is_flattened_between_plates(book: Book) -> None:
    """Half of it, by symmetry, to half of its diameter: its sides are elasticas between two flat parts.

    Notes
    -----
    A side leaves the plates without curvature, k^2 = 2 F sin(a)/EI at the angle a to them, whatever the radius was: the
    height is H = 2 B sqrt(EI/2F), B the integral of sqrt(sin a) over a right angle.
    """
    radius, thickness, width, n = 0.1, 1e-3, 0.05, 64
    shell = parts.Shell(
        size=(width, np.pi * radius), radius=radius, elements=(1, n), thickness=thickness, material=material(1e9),
        direction=(0, 1, 0), normal=(0, 0, -1), clamped=["y0"],
    )  # fmt: skip
    system, above = System(), (0.0, 0.0, 2.0 * radius + 0.5 * thickness - 1e-5)
    system.add(shell, "shell")
    add_symmetry(system, shell, {"y1": 1})
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=above), "plate")
    system.add(parts.Joint(type="prismatic", a=above, b="plate", axis=(0, 0, 1)), "rail")
    height, integral = radius, 0.5 * math.sqrt(math.pi) * math.gamma(0.75) / math.gamma(1.25)
    force = 2.0 * integral**2 * 1e9 * width * thickness**3 / 12.0 / height**2
    system.add(parts.Load(at="plate", force=(0.0, 0.0, -force)), "press")
    upper = parts.Plane(normal=(0.0, 0.0, -1.0))
    system.add(parts.Contact(a="shell", b="plate", shape=upper, stiffness=1e5), "upper")
    system.add(parts.Contact(a="shell", b=(0.0, 0.0, -0.5 * thickness), shape=FLOOR, stiffness=1e5), "floor")
    run = system.equilibrium()
    assert run.attrs["status"] == "success"
    assert run["upper"].normal_force.values[-1] == pytest.approx(force, rel=1e-9)
    assert int(run["upper"].points.values[-1]) > 10
    book(
        "Contact", "Ring flattened between plates to half its diameter (64 elements): height",
        reference="elastica, closed form", source="Euler", allowed=5e-4,
        error=abs(float(np.ptp(run["shell"].position.values[-1][:, 2])) / height - 1.0),
    )  # fmt: skip


@pytest.mark.parametrize("keys", [{}, {"step": 0.02}], ids=["adaptive", "steps longer than the box"])
@pytest.mark.parametrize("method", METHODS)
def test_a_fast_plate_does_not_pass_a_thin_box(method: str, keys: Any) -> None:
    """A box of 2 mm at 20 m/s."""
    system = System()
    shell = plate(
        size=(0.2, 0.2), elements=(3, 3), position=(-0.1, -0.1, 0.5), velocity=(0.0, 0.0, -20.0),
        material=material(1e8, 0.3), stiffness_damping=1e-5,
    )  # fmt: skip
    system.add(shell, "panel")
    shape = parts.Box(size=(0.4, 0.4, 0.002))
    system.add(parts.Contact(a="panel", b="ground", shape=shape, stiffness=1e7, damping=0.1), "obstacle")
    given = keys or {"tolerance": 1e-4}
    heights = system.simulate(until=0.04, every=0.01, method=method, fine=False, **given)["panel"].position.values[
        ..., 2
    ]
    assert heights.min() > 0.0
    assert heights[-1].min() > heights[-2].min()  # on its way back


def test_nodes_have_their_shares_of_the_stiffness() -> None:
    """A plate that lies on a floor sinks by its weight over the stiffness, whatever its mesh is."""
    sunk = []
    for elements in ((2, 2), (5, 3)):
        system = over_floor(plate(elements=elements, position=(0.0, 0.0, 0.005)), friction=0.2)
        sunk.append(system.equilibrium()["panel"].position.values[-1][:, 2])
    np.testing.assert_allclose(np.concatenate(sunk), 0.005 - WEIGHT / 2e4, rtol=1e-9)


#: A wall whose thickness is not known.
WALL = {"stiffness": {"matrix": np.diag([1e3, 1e3, 4e2, 1.0, 1.0, 0.4, 3e2, 3e2]).tolist(), "mass_per_area": 1.0}}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"a": "rod", "b": "other"}, r"floor\.b is the shell 'other'; contact of a shell with 'rod' is not"),
        ({"b": "rod"}, r"floor\.b is the rod 'rod'; contact of a rod with 'panel' is not implemented: of"),
        ({"b": "other"}, r"floor\.shape is given, which has no meaning in a contact of shells; leave it out"),
        ({"a": ["panel", "rod"]}, r"floor\.a holds the shell 'panel' and 'rod', which is no shell; give each its own"),
        ({"a": ["panel", "hub"]}, r"floor\.a is a list that holds 'hub', which has no contact points of its own"),
        ({"a": "thin"}, r"floor\.clearance is 0; at a plane it must be above 0: half the thickness of 'thin'"),
        ({"points": 3}, r"floor\.points is given, which has no meaning in a contact of nodes and a surface"),
        ({"law": "paper"}, r"floor\.law is 'paper', which a contact of nodes and a surface does not support"),
        ({"b": (0.0, 0.0, 0.1)}, r"'floor' starts with its bodies 0\.0\d+ m inside each other"),
        ({"skip": 20}, r"floor\.skip is 20; 'panel' has 20 contact points, give less"),
        (
            {"shape": parts.Cylinder(radius=0.1, length=1.0)},
            r"floor\.shape is a cylinder with a length, but floor\.a holds the shell 'panel', for which",
        ),
        (
            {"shape": parts.Sphere(radius=0.03)},
            r"floor\.shape is a sphere that is 0\.07 m wide with the thickness of 'panel', but nodes by which 'panel' "
            r"touches it are 0\.1 m apart; use more elements",
        ),
    ],
)  # fmt: skip
def test_what_a_shell_cannot_touch_is_refused(keys: Any, message: str) -> None:
    system = over_floor(plate(position=(0.0, 0.0, 0.05)), **keys)
    system.add(plate(position=(0.0, 0.0, 0.1)), "other")
    system.add(parts.Shell(size=(1.0, 1.0), elements=(2, 2), section=WALL, position=(2.0, 0.0, 0.1)), "thin")
    rod = parts.Rod(
        length=1.0, section=Circle(radius=0.01), material=material(1e9), elements=2, position=(0, 2, 1)
    )  # fmt: skip
    system.add(rod, "rod")
    system.add(parts.RigidBody(motion="driven", position=(0, 0, 5)), "hub")
    with pytest.raises(InputError, match=message):
        system.assemble()


def test_finer_shells_have_the_same_contact() -> None:
    """Meshes of half the element's length, for an estimate of the mesh error."""
    contact = parts.Contact(a="panel", b=(0, 0, 0), shape=FLOOR)
    assert contact.refined("floor", {"panel": plate()}) is contact
    with pytest.raises(InputError, match=r"does not support 'floor', whose `skip` counts contact points"):
        parts.Contact(a="panel", b=(0, 0, 0), shape=FLOOR, skip=4).refined("floor", {"panel": plate()})
