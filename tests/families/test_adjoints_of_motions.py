"""The adjoint beside forward mode under generalized-alpha: large motions, changes of loads, radius 1 and below."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from evolvent import System, elements, parts
from families.reduced import two_node_file

INERTIA = (0.1, 0.15, 0.2)
DRAG = ["-0.5*vx", "-0.5*vy + 0.1*x", "-0.5*vz*vz"]
TWISTS = ["-0.05*vx*abs(vx)", "-0.1*vy + 0.1*x", "-0.1*vz"]
TURNS = {"velocity": (1.0, 0.5, 0.0), "angular_velocity": (2.0, 3.0, -1.0)}
SYSTEMS: dict[str, Callable[[System], None]] = {}
#: Angular momentum of free systems is corrected in forward mode, and not in the adjoint.
WITHIN = 3e-5


def enter(name: str) -> Callable[[Callable[[System], None]], Callable[[System], None]]:
    """Enter a function that adds parts beside a free body that turns under a name."""

    def entered(add: Callable[[System], None]) -> Callable[[System], None]:
        SYSTEMS[name] = add
        return add

    return entered


@enter("drag off the centre")
def drag(system: System) -> None:
    system.add(parts.Load(at=("body", (0.4, 0.2, 0.1)), law=DRAG), "drag")


@enter("drag in axes of the body")
def drag_in_body(system: System) -> None:
    system.add(parts.Load(at=("body", (0.4, 0.2, 0.1)), law=DRAG, frame="body"), "drag")


@enter("a torque by a law")
def torque(system: System) -> None:
    system.add(parts.Load(at="body", type="torque", law=TWISTS), "turn")


@enter("a torque by a law in axes of the body")
def torque_in_body(system: System) -> None:
    system.add(parts.Load(at="body", type="torque", law=TWISTS, frame="body"), "turn")


@enter("an acceleration field")
def field(system: System) -> None:
    system.add(parts.Field(law=DRAG), "field")


@enter("a wheel in an orbit")
def wheel(system: System) -> None:
    system.add(parts.Field(type="orbit", rate=0.9), "orbit")
    system.add(parts.ReactionWheel(body="body", inertia=0.02, axis=(0.3, 0.2, 0.9), rate=9.0, viscous_damping=0.2), "w")


@enter("a spring by a law")
def spring(system: System) -> None:
    system.add(
        parts.Spring(a=(2.0, 0.0, 0.0), b=("body", (0.4, 0.2, 0.1)), law="5*x + 3*x**3 + 0.2*v*abs(v)"), "spring"
    )


def on_it(system: System, tip: str) -> None:
    """A mass at the tip, and a torque whose profile has corners, at which steps land and accelerations jump."""
    profile = [(0.0, 0.0), (0.1, 0.4), (0.15, 0.0), (0.2, -0.3), (0.3, 0.0)]
    system.add(parts.Load(at="body", axis=(0.0, 0.2, 1.0), profile=profile), "turn")
    system.add(parts.Point(mass=0.2, at=tip), "tip")


@enter("a rod")
def rod(system: System) -> None:
    tube = elements.Tube(radius=0.01, thickness=5e-4)
    fields = {"section": tube, "material": "cfrp", "elements": 3, "stiffness_damping": 0.003}
    system.add(parts.Rod(length=2.0, position=(0.1, 0.0, 0.0), **fields), "rod")
    system.add(parts.Joint(a="body", b="rod.root", type="clamp"), "clamp")
    on_it(system, "rod.tip")


@enter("a reduced body")
def reduced(system: System) -> None:
    system.add(parts.ReducedBody(file=two_node_file(), position=(0.1, 0.0, 0.0)), "panel")
    system.add(parts.Joint(a="body", b="panel.root", type="clamp"), "clamp")
    on_it(system, "panel.tip")


def made(name: str) -> System:
    system = System()
    still = {} if name in ("a rod", "a reduced body") else TURNS
    system.add(parts.RigidBody(mass=2.0, inertia=INERTIA, **still), "body")
    SYSTEMS[name](system)
    return system


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1.0, 0.9, 0.4])
@pytest.mark.parametrize("name", SYSTEMS)
def test_it_is_forward_mode(name: str, radius: float) -> None:
    values = ["body.position.x.last", "body.rate.x.last", "body.rate.z.last"]
    settings = {"method": "generalized-alpha", "until": 0.4, "every": 0.1, "step": 0.005, "spectral_radius": radius}
    keys = ["body.mass", "body.inertia.0"] if "tip" not in made(name).parts else ["tip.mass", "body.inertia.2"]
    forward, adjoint = (
        made(name).sensitivity(values, keys, mode=mode, **settings).dataset.derivative.values
        for mode in ("forward", "adjoint")
    )
    size = np.abs(forward).max(axis=0)
    assert np.abs(adjoint - forward).max() < WITHIN * size.max()
