"""Surfaces of contacts against minimisation and sampling; parts of contacts that are refused, written and drawn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from evolvent import InputError, System, elements, parts
from evolvent.kernels import body_gaps, surfaces
from evolvent.parts.registry import read_parts
from evolvent.view.drawing import motion_of

Array = np.ndarray


def test_closest_places_of_segments() -> None:
    """Against a bounded minimisation, of any lengths, ends included."""
    rng = np.random.default_rng(0)
    for _ in range(60):
        a, b, d = rng.standard_normal((3, 3))
        a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
        half = np.array([rng.choice([0.0, 0.3, 2.0]), rng.choice([0.0, 0.5, 1.0])])

        def square(x: Array, a: Array = a, b: Array = b, d: Array = d) -> float:
            return float(np.sum((d + x[0] * a - x[1] * b) ** 2))

        best = minimize(square, [0.0, 0.0], bounds=[(-h, h) for h in half], tol=1e-14)
        s, t = body_gaps.closest_positions(d @ a, d @ b, a @ b, *half)
        assert abs(s) <= half[0]
        assert abs(t) <= half[1]
        assert square(np.array([s, t])) <= best.fun + 1e-9


@pytest.mark.parametrize(("v", "place"), [(0.3, 0.15), (3.0, 0.5), (-3.0, -0.5)])
def test_segments_side_by_side(v: float, place: float) -> None:
    """The middle of what lies side by side, or the end."""
    s, t = body_gaps.closest_positions(v, v, 1.0, 0.5, 0.5)
    assert t == pytest.approx(place)
    assert s == pytest.approx(np.clip(t - v, -0.5, 0.5))


@pytest.mark.parametrize("surface", [surfaces.CYLINDER, surfaces.CAPSULE, surfaces.PLANE])
def test_gap_and_its_derivatives(surface: int) -> None:
    rng = np.random.default_rng(1)
    c, a = rng.standard_normal(3), rng.standard_normal(3)
    a /= np.linalg.norm(a)
    for _ in range(20):
        x = c + 2.0 * rng.standard_normal(3)

        def values(x: Array) -> Array:
            return np.array(surfaces.gap_to(surface, *x, *c, *a, 0.3, 0.7 if surface == surfaces.CAPSULE else 1e9))

        gap, *n, distance = values(x)
        assert gap == pytest.approx(distance - 0.3)
        steps = 1e-6 * np.eye(3)
        slope = [(values(x + e)[0] - values(x - e)[0]) / 2e-6 for e in steps]
        assert n == pytest.approx(slope, abs=1e-8)
        point = SimpleNamespace(n=n, distance=distance, offset=0.0)
        row = SimpleNamespace(surface=surface, half_length=0.7)
        _, share, part, total = getattr(surfaces.end_slope, "py_func", surfaces.end_slope)(row, point, x - c, a, 0.0)
        found = part * (np.eye(3) - share * np.outer(a, a) - np.outer(n, n)) / total
        bend = np.array([(values(x + e)[1:4] - values(x - e)[1:4]) / 2e-6 for e in steps])
        assert found == pytest.approx(bend, abs=1e-6)


def test_mass_properties_of_a_capsule() -> None:
    """Against a fine grid of points."""
    shape = parts.Capsule(radius=0.3, length=0.8, axis=(0.0, 0.0, 1.0))
    x = np.linspace(-0.3, 0.3, 81)[:-1] + 0.3 / 80.0
    z = np.linspace(-0.7, 0.7, 201)[:-1] + 0.7 / 200.0
    X, Y, Z = np.meshgrid(x, x, z, indexing="ij")
    inside = X**2 + Y**2 + np.maximum(np.abs(Z) - 0.4, 0.0) ** 2 <= 0.09
    volume = inside.sum() * (0.6 / 80) ** 2 * 1.4 / 200
    assert shape.volume == pytest.approx(volume, rel=2e-3)
    moments = [np.mean((P**2 + Q**2)[inside]) for P, Q in ((Y, Z), (X, Z), (X, Y))]
    np.testing.assert_allclose(np.diag(shape.inertia_per_mass()), moments, rtol=3e-3)


# ------------------------------------------------------------------------------------------------ refusals

BALL = {"mass": 1.0, "shape": parts.Sphere(radius=0.1)}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "itself": ({"a": "ball", "b": ("ball", (0.0, 0.0, 1.0)), "shape": parts.Sphere(radius=0.1)},
               r"'touch' is a contact of a body with itself: a is 'ball'"),
    "no shape": ({"a": ("box", (0.0, 0.0, 1.0)), "b": "ball"},
                 r"touch\.shape_a is left out, and \('box', \(0.0, 0.0, 1.0\)\) is not a body whose `shape`"),
    "deep": ({"a": "ball", "b": "other"}, r"'touch' starts with its bodies 0\.05 m inside each other"),
    "no body": ({"a": "ball", "b": "mass"}, r"touch\.b is 'mass', which is not a point of a rigid body"),
    "law": ({"a": "ball", "b": "other", "law": "paper"}, r"touch\.law is 'paper', which a contact of bodies does not"),
    "points": ({"a": "ball", "b": "other", "points": 3}, r"touch\.points is given, .* in a contact of bodies"),
    "several": ({"a": ["ball", "box"], "b": "other"}, r"touch\.a is a list that holds 'ball', which has no"),
    "cylinder": ({"a": "ball", "b": "other", "shape": parts.Cylinder(radius=0.1)},
                 r"touch\.shape is a cylinder; it must be a sphere, a capsule, a plane or a box"),
    "nobody": ({"a": "ball", "b": "bell"}, r"'touch' refers to 'bell', but no part is called that"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_refused_systems(what: str) -> None:
    system, (fields, message) = System(), REFUSED[what]
    system.add(parts.RigidBody(**BALL), "ball")
    system.add(parts.RigidBody(position=(0.15, 0.0, 0.0), **BALL), "other")
    system.add(parts.RigidBody(mass=1.0, shape=parts.Box(size=(1.0, 1.0, 1.0)), position=(9.0, 0.0, 0.0)), "box")
    system.add(parts.Point(mass=1.0, position=(5.0, 0.0, 0.0)), "mass")
    system.add(parts.Contact(**fields), "touch")
    with pytest.raises(InputError, match=message):
        system.assemble()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: parts.Capsule(radius=0.1, length=0.0), r"Capsule\.length is 0"),
        (lambda: parts.Plane(), r"Plane\.normal is missing"),
        (
            lambda: parts.Plane(normal=(0.0, 0.0, 0.0)),
            r"Plane\.normal is \(0, 0, 0\)|Plane\.normal is \(0\.0, 0\.0, 0\.0\)",
        ),
        (lambda: parts.Contact(a=[], b="plate"), r"Contact\.a is \[\]; it must be beams, rods, shells or a point"),
        (
            lambda: parts.Contact(a="ball", b="plate", shape_a=parts.Plane(normal=(0.0, 0.0, 1.0))),
            r"Contact\.shape_a .* sphere",
        ),
    ],
)
def test_refused_keys(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def rod(system: System, height: float) -> None:
    material = elements.Material(young_modulus=2e9, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=0.02, width=0.02)
    beam = parts.Beam(
        length=1.0, section=section, material=material, elements=4, formulation="cable", position=(0.0, height, 0.0)
    )
    system.add(beam, "rod")


@pytest.mark.parametrize(
    "part",
    [
        parts.Contact(a="rod", b="ground", shape=parts.Plane(normal=(0.0, 1.0, 0.0)), clearance=0.01),
        parts.Contact(a="rod", b=(0.5, 0.0, 0.0), shape=parts.Sphere(radius=0.1)),
        parts.Contact(a="rod", b="ground", shape=parts.Capsule(radius=0.1, length=0.5, axis=(1.0, 0.0, 0.0))),
    ],
)
def test_a_beam_that_starts_inside_is_refused(part: Any) -> None:
    system = System()
    rod(system, 0.0)
    system.add(part, "thing")
    with pytest.raises(
        InputError, match=r"'rod' starts inside the (plane|sphere|capsule) 'thing': a point of it is 0\."
    ):
        system.assemble()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"b": "hub"}, r"'rod' starts inside the cylinder 'thing': a point of it is 0\."),
        (
            {"b": "hub", "shape_a": parts.Sphere(radius=0.1)},
            r"thing\.shape_a is given, which .* of beams and a surface",
        ),
        (
            {"b": "hub", "shape": parts.Box(size=(1.0, 1.0, 1.0))},
            r"thing\.shape is a box; it must be a sphere, a capsule",
        ),
        ({"b": "ground"}, r"thing\.shape is left out, and 'ground' is not a body whose `shape` is a sphere, a capsule"),
        (
            {"b": "hub", "shape": parts.Plane(normal=(0.0, 1.0, 0.0))},
            r"thing\.clearance is 0; at a plane it must be abov",
        ),
        ({"b": "rod"}, r"thing\.around is missing; turns of a beam need it"),
        ({"b": "rod", "around": "hub"}, r"thing\.thickness is missing; turns of a beam need it"),
        (
            {"a": "hub", "b": "rod"},
            r"thing\.b is the beam 'rod', on whose turns only a beam can lie; give one as thing",
        ),
        ({"a": ["rod", "hub"], "b": "hub"}, r"thing\.a is a list that holds 'hub', which has no contact points"),
        ({"a": ["rod", "hubs"], "b": "hub"}, r"'thing' refers to 'hubs', but no part is called that"),
        ({"a": "rod.tip", "b": "hub"}, r"thing\.a is 'rod.tip', which is not a point of a rigid body"),
    ],
)
def test_contacts_of_beams_that_are_refused(keys: dict[str, Any], message: str) -> None:
    """The first has the shape of its body."""
    system = System()
    rod(system, 0.0)
    shape = parts.Cylinder(radius=0.3, length=2.0)
    system.add(parts.RigidBody(motion="driven", shape=shape), "hub")
    system.add(parts.Contact(**{"a": "rod"} | keys), "thing")
    with pytest.raises(InputError, match=message):
        system.assemble()


def test_a_body_is_no_cylinder_without_ends() -> None:
    system = System()
    system.add(parts.RigidBody(motion="driven", shape=parts.Cylinder(radius=0.3)), "hub")
    with pytest.raises(InputError, match=r"hub\.shape\.cylinder\.length is missing; only in a contact"):
        system.assemble()


# ------------------------------------------------------------------------------------------------ files, pictures

YAML: dict[str, Any] = {
    "ball": {"kind": "rigid-body", "mass": "1 kg", "shape": {"sphere": "10 cm"}, "position": [0, 0, "0.3 m"]},
    "log": {"kind": "rigid-body", "mass": "2 kg", "shape": {"capsule": {"radius": "5 cm", "length": "40 cm"}},
            "position": [2, 0, 1]},
    "floor": {"kind": "contact", "a": "ball", "b": [0, 0, 0], "shape": {"plane": {"normal": [0, 0, 1]}},
              "stiffness": "1e4 N/m", "friction": 0.3},
    "pair": {"kind": "contact", "a": "log", "b": "ball"},
    "bed": {"kind": "contact", "a": ["log"], "b": [0, 0, 0], "shape": {"plane": {"normal": [0, 0, 1]}}},
    "row": {"kind": "contact", "a": "ball", "b": [0, 0, "-1 m"], "shape": {"plane": {"normal": [0, 0, 1]}},
            "repeat": {"count": 2, "step": [0, 0, "-1 m"]}},
}  # fmt: skip


def test_contacts_of_a_case_file() -> None:
    found = read_parts(YAML)
    system = System(gravity=(0.0, 0.0, -9.81))
    for name, part in found.items():
        system.add(part, name)
    rows = system.assemble().model.body_contacts
    assert rows["first"].tolist() == [0, 1, 2, 2, 4, 5]
    assert rows["place_b"][4:, 2].tolist() == [-1.0, -2.0]
    written = {
        name: {"kind": part.kind, **part.model_dump(mode="json", exclude_defaults=True)} for name, part in found.items()
    }
    assert read_parts(written) == found


def test_contacts_are_drawn() -> None:
    """The plane as its own disc frame, shapes on their bodies, and the forces at the places where they act."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(mass=1.0, inertia=0.01, position=(0.0, 0.0, 0.0999)), "ball")
    plane, sphere = parts.Plane(normal=(0.0, 0.0, 1.0), size=2.0), parts.Sphere(radius=0.1)
    touch = parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape_a=sphere, shape=plane, friction=0.3)
    system.add(touch, "floor")
    run = system.simulate(until=0.02, method="generalized-alpha", step=1e-3, every=5e-3)
    motion = motion_of(run)
    assert motion is not None
    frames = {frame.name: frame for frame in motion.frames}
    assert max(r for _, r in frames["floor"].solids[-1].profile) == pytest.approx(1.0)
    assert max(r for _, r in frames["ball"].solids[-1].profile) == pytest.approx(0.1)
    (force,) = motion.forces
    np.testing.assert_allclose(force.points[..., 2], 0.0, atol=2e-3)
    assert force.vectors[-1, 0, 2] > 1.0
