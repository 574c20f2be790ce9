"""Laws as expressions: a spring against the same law in Python, events at times that are known, what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evolvent import InputError, System, elements, law, parts
from evolvent.families.events.part import _turned
from evolvent.parts.base import Part
from evolvent.solvers import solve
from evolvent.solvers.time.implicit.plan import solve_implicit

K, K3, C = 10.0, 4.0, 0.1
TEXT, CONSTANTS = "k*x + k3*x**3 + c*v + where(t < 0.7, 0, 0.2)", {"k": K, "k3": K3, "c": C}


@law
def hardening(extension, rate, t, p):  # type: ignore[no-untyped-def]
    return p[0] * extension + p[1] * extension**3 + p[2] * rate + (0.0 if t < 0.7 else 0.2)


@law
def never(t, y, p):  # type: ignore[no-untyped-def]
    return -1.0


def oscillator(**law: Any) -> System:
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.3, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, **law), "spring")
    system.add(parts.Load(at="ball", direction=(1.0, 0.0, 0.0), profile=[(0.0, 0.0), (0.7, 0.0)]), "break")
    return system


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk4", "dopri5", "generalized-alpha"])
def test_spring_as_by_a_python_law(method: str) -> None:
    found = []
    for keys in ({"law": hardening, "parameters": (K, K3, C)}, {"law": TEXT, "constants": CONSTANTS}):
        assembly, t = oscillator(**keys).assemble(), np.linspace(0.0, 3.0, 7)
        if method == "generalized-alpha":
            found.append(solve_implicit(assembly, samples=t, step=0.01))
        else:
            found.append(solve(assembly, samples=t, method=method, step=0.01 if method == "rk4" else None))
    assert found[1].y == pytest.approx(found[0].y, rel=1e-12, abs=1e-13)
    assert np.abs(found[1].energy_defect).max() < (1e-3 if method == "generalized-alpha" else 1e-7)


def test_times_of_a_spring_become_breaks() -> None:
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.3, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", law=TEXT, constants=CONSTANTS), "spring")
    assert system.assemble().model.breaks.tolist() == [0.7]


def falling(event: Part) -> System:
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(event, "event")
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 1.0)), "ball")
    system.add(parts.RigidBody(inertia=2.0, motion="spin"), "hub")
    system.add(parts.RigidBody(mass=1.0, inertia=2.0, motion="free", points={"ear": (0.3, -0.2, 0.5)}), "craft")
    system.add(parts.RigidBody(inertia=2.0, motion="driven"), "stand")
    system.add(parts.Load(at="hub", axis=(0.0, 0.0, 1.0), profile={"expression": "6*t**2"}), "slew")
    system.add(parts.Load(at="craft", axis=(0.0, 1.0, 0.0), profile=[(0.0, 2.0), (1.0, 2.0)]), "turn")
    return system


#: Variables, law, and the time at which it rises through zero.
EVENTS = {
    "time": ({}, "t - 0.3", 0.3),
    "place": ({"h": "ball.position.z"}, "0.5 - h", math.sqrt(1.0 / 9.81)),
    "velocity": ({"v": "ball.velocity.z"}, "-2 - v", 2.0 / 9.81),
    "rate about an axis": ({"w": "hub.rate"}, "w - 0.2", 0.2 ** (1.0 / 3.0)),
    "angle about an axis": ({"a": "hub.angle"}, "a - 0.2", 0.8**0.25),
    "rate of a free body": ({"w": "craft.rate.y"}, "w - 0.35", 0.35),
    "rate at a point of a free body": ({"w": "craft.ear.rate.y"}, "w - 0.35", 0.35),
    "place of a point of a free body": (
        {"x": "craft.ear.position.x"},
        "0.58 - x",  # 0.3 cos a + 0.5 sin a = sqrt(0.34) cos(a - atan(5/3)), a = t^2/2, falls at its second crossing
        math.sqrt(2.0 * (math.atan2(0.5, 0.3) + math.acos(0.58 / math.sqrt(0.34)))),
    ),
    "place of a free body": (
        {"z": "craft.position.z", "v": "craft.velocity.z"},
        "-z - v - 3",
        -1.0 + math.sqrt(1.0 + 6.0 / 9.81),
    ),
}


@pytest.mark.parametrize("kind", EVENTS)
def test_event(kind: str) -> None:
    variables, law, time = EVENTS[kind]
    event = parts.Event(law=law, variables=variables or None, stops=True)
    solution = solve(falling(event).assemble(), samples=np.linspace(0.0, 3.0, 31), method="dopri5")
    assert solution.status == "stopped by event"
    assert solution.event_times == pytest.approx([time], abs=1e-8)
    assert parts.Event.model_validate(event.model_dump(mode="json", exclude_defaults=True)) == event


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "quantity": ({"h": "ball.positon.z"}, r"event\.variables\.h is 'ball\.positon\.z'; it must be a quantity such as"),
    "axis": ({"h": "ball.position"}, r"event\.variables\.h is 'ball\.position'; did you mean 'position\.z'"),
    "no rate": ({"h": "ball.rate.z"}, r"event\.variables\.h is 'ball\.rate\.z'; known: position\.x"),
    "off the centre": (
        {"h": "craft.ear.velocity.z"},
        "off the centre of mass of its body, where only positions are read",
    ),
    "no such point": ({"h": "craft.eat.position.z"}, r"event\.variables\.h is 'craft\.eat'; .*ear"),
    "no vector": ({"h": "hub.rate.z"}, r"event\.variables\.h is 'hub\.rate\.z'; did you mean 'rate'"),
    "part": ({"h": "bal.position.z"}, r"'event' refers to 'bal', but no part is called that; did you mean 'ball'"),
    "driven": ({"h": "stand.rate"}, r"event\.variables\.h: 'stand' is no point, no body that moves by forces"),
    "load": ({"h": "slew.rate"}, r"event\.variables\.h: 'slew' is no point"),
    "name": ({"t": "ball.position.z", "h": "ball.position.z"}, r"event\.variables\.t has the name of the time"),
    "unknown": ({"height": "ball.position.z"}, "'h' at character 1 is neither a variable nor a constant"),
    "mapping": (3, "Event.variables is 3; it must be a mapping of names to quantities of parts"),  # type: ignore[dict-item]
    "bad name": ({"a b": "ball.position.z"}, "Event.variables is .* it must be a mapping of names"),
}


def test_a_point_of_a_body_is_read_by_its_attitude() -> None:
    q = np.array([0.4, -0.5, 0.7, 0.2]) / math.sqrt(0.94)
    arm, names = np.array([0.3, -0.2, 0.5]), ["_h_0", "_h_1", "_h_2", "_h_3"]
    found = [
        float(eval(_turned(arm, i, names), {"__builtins__": {}}, dict(zip(names, q.tolist(), strict=True))))
        for i in range(3)
    ]
    assert found == pytest.approx(Rotation.from_quat(q, scalar_first=True).apply(arm), abs=1e-14)


def test_the_tip_of_a_rod_is_read_where_it_is() -> None:
    """The centres of mass of the shares of its end nodes are within it; it turns about its root."""
    system = System()
    section = elements.Rectangle(width=0.02, thickness=0.02)
    material = elements.Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0)
    turning = {"velocity": (0.0, 0.5, 0.0), "angular_velocity": (0.0, 0.0, 1.0)}
    rod = parts.Rod(position=(0.5, 0.0, 0.0), length=1.0, elements=4, section=section, material=material, **turning)
    system.add(rod, "rod")
    system.add(parts.Event(law="y - 1.2", variables={"y": "rod.tip.position.y"}, stops=True), "event")
    run = system.simulate(until=2.0, every=0.1, fine=False)
    assert float(run["rod"].position.values[-1, -1, 1]) == pytest.approx(1.2, abs=1e-6)


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(kind: str) -> None:
    variables, message = REFUSED[kind]
    with pytest.raises(InputError, match=message):
        falling(parts.Event(law="h", variables=variables)).assemble()


def test_a_python_law_takes_the_state() -> None:
    with pytest.raises(InputError, match=r"event\.variables are those of an expression"):
        falling(parts.Event(law=never, variables={"h": "ball.position.z"})).assemble()


SPRINGS: dict[str, tuple[dict[str, Any], str]] = {
    "constant": ({"law": "k*x", "constants": {"kk": 1.0}}, "spring.law is 'k.x'; 'k' at character 1 .* mean 'kk'"),
    "taken": ({"law": "t*x", "constants": {"t": 1.0}}, "the constant 't' of spring.law has a name that is taken"),
    "infinite": ({"law": "1/(x - x)"}, r"'spring' at t = 0 s: the expression '1/\(x - x\)' returns inf"),
    "undefined": ({"law": "log(-1 - x*x)"}, r"'spring' at t = 0 s: the expression .* returns nan; .* finite"),
    "parameters": ({"law": "x", "parameters": (1.0,)}, "spring.parameters are those of a Python law"),
    "constants": ({"law": hardening, "constants": {"k": 1.0}}, "spring.constants are those of an expression"),
}


@pytest.mark.parametrize("kind", SPRINGS)
def test_refused_springs(kind: str) -> None:
    keys, message = SPRINGS[kind]
    with pytest.raises(InputError, match=message):
        solve(oscillator(**keys).assemble(), samples=[0.0, 1.0], method="rk4", step=0.01)
