"""The force of a contact whose centres coincide has no direction; that on a plane always has one."""

import math

import pytest

import evolvent
from evolvent import EvolventError, InputError, System, elements, parts

DEEP = {"stiffness": 1e3, "law": "conservative", "exponent": 1.0, "initial_overlap": 10.0}


def ball(shape: dict, height: float = 0.0) -> System:
    system = System(gravity=(0.0, 0.0, -9.81))
    sphere = {"sphere": {"radius": 1.0}}
    system.add(parts.RigidBody(mass=1.0, shape=sphere, position=(0.0, 0.0, height)), "ball")
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=shape, **DEEP), "touch")
    return system


@pytest.mark.parametrize("method", ["energy-momentum", "generalized-alpha"])
@pytest.mark.parametrize("height", [0.0, 1e-9])
def test_a_centre_on_a_plane_is_pushed_as_any_other(method: str, height: float) -> None:
    run = ball({"plane": {"normal": [0, 0, 1]}}, height).simulate(until=0.02, every=0.01, method=method, step=1e-4)
    rest, w = 1.0 - 9.81 / 1e3, math.sqrt(1e3)
    assert run["ball"].position.values[-1, 2] == pytest.approx(rest * (1.0 - math.cos(0.02 * w)), rel=1e-5)


@pytest.mark.parametrize(
    "shape", [{"sphere": {"radius": 0.5}}, {"capsule": {"radius": 0.5, "length": 1.0, "axis": [1, 0, 0]}}]
)
def test_centres_at_one_place_are_refused(shape: dict) -> None:
    with pytest.raises(InputError, match="'touch' starts with the centre or axis of one body on that of the other"):
        ball(shape).assemble()
    ball(shape, 0.1).assemble()


def test_a_beam_in_the_middle_of_a_sphere_is_refused() -> None:
    system = System()
    material = elements.Material(young_modulus=1e6, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=0.01, width=0.02)
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "body")
    system.add(parts.Beam(length=1.0, section=section, material=material, elements=2, formulation="cable"), "rod")
    system.add(
        parts.Contact(
            a="rod", b=("body", (0.5, 0.0, 0.0)), shape=parts.Sphere(radius=0.3), points=2, skip=0, stiffness=1e3,
            initial_overlap=2.0,
        ), "touch",
    )  # fmt: skip
    with pytest.raises(InputError, match="'rod' starts with a point in the middle of the sphere 'touch'"):
        system.assemble()


def test_an_equilibrium_on_crossing_edges_of_flush_boxes_is_refused() -> None:
    """A folded stack: edges of panels that are flush cross in one plane, where round-off had been the direction."""
    for solve in (System.equilibrium, System.modes):
        with pytest.raises(EvolventError, match=r"'stack \d' is \S+ m deep, where its force of .* has no direction"):
            solve(evolvent.load("z-fold"))
