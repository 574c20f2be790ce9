"""Keys of joints and contacts that could have no effect, or name something twice, are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements import Material, Rectangle
from evolvent_base import showing
from evolvent_base.answer import Answer, Section, Table
from evolvent_base.errors import InputError


def driven(kind: str, **given: Any) -> System:
    """A wheel that a drive turns, or a point mass that it moves on a line."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "wheel")
    system.add(parts.Point(mass=1.0), "bob")
    drive = given.pop("drive", {"ramp": {"rate": 0.0, "steps": [[0.0, 1.0, 1.0]]}})
    b = "wheel" if kind == "revolute" else "bob"
    system.add(parts.Joint(a="ground", b=b, type=kind, drive=drive, **given), "hinge")
    return system


@pytest.mark.parametrize("kind", ["revolute", "point-on-line"])
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"drive": {"free": {"inertia": 1.0}}}, r"hinge\.drive is a free spool, which prescribes no motion"),
        ({"stiffness": 10.0}, r"hinge\.stiffness and hinge\.drive are both given; leave one of them out"),
        ({"damping": 2.0}, r"hinge\.damping and hinge\.drive are both given"),
        ({"rotational_stiffness": 3.0}, r"hinge\.rotational_stiffness and hinge\.drive are both given"),
        ({"position": (1.0, 0.0, 0.0)}, r"hinge\.position and hinge\.drive are both given"),
    ],
)
def test_a_drive_takes_no_penalties(kind: str, given: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        driven(kind, **given).assemble()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"type": "gear", "b": None}, r"pin\.b is missing; pin\.type 'gear' needs it"),
        (
            {"type": "pulley", "position": (1.0, 0.0, 0.0)},
            r"pin\.position is given, but pin\.type is 'pulley', which has",
        ),
        ({"pitch": 0.1}, r"pin\.pitch is given, but pin\.type is 'spherical', not 'screw'"),
        ({"rotational_stiffness": 1.0}, r"pin\.rotational_stiffness is given without pin\.stiffness"),
        ({"type": "link", "sense": -1}, r"pin\.sense is given without pin\.drum"),
    ],
)
def test_a_joint_has_the_keys_of_its_type(given: dict[str, Any], words: str) -> None:
    system = System()
    system.add(parts.Point(mass=1.0), "bob")
    system.add(parts.Joint(**({"a": "ground", "b": "bob"} | given)), "pin")
    with pytest.raises(InputError, match=words):
        system.assemble()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"stop": 10.0}, r"spring\.stop is given without spring\.low or spring\.high, to which it belongs"),
        ({"latch_stiffness": 10.0}, r"spring\.latch_stiffness is given without spring\.latch, to which it belongs"),
        ({"latch_damping": 10.0}, r"spring\.latch_damping is given without spring\.latch, to which it belongs"),
        ({"bristle_stiffness": 10.0}, r"spring\.bristle_stiffness is given without spring\.friction"),
    ],
)
def test_a_spring_of_a_joint_takes_no_keys_without_effect(given: dict[str, Any], words: str) -> None:
    system = pinned()
    system.add(parts.JointSpring(joint="pin", stiffness=1.0, **given), "spring")
    with pytest.raises(InputError, match=words):
        system.assemble()


def pinned() -> System:
    """A body on a pin, and another one on the first."""
    system = System()
    for k, (name, pin) in enumerate((("arm", "pin"), ("hand", "wrist"))):
        system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(float(k), 0.0, 0.0)), name)
        a = (0.0, 0.0, 0.0) if k == 0 else ("arm", (1.0, 0.0, 0.0))
        system.add(parts.Joint(a=a, b=name, type="revolute", axis=(0.0, 1.0, 0.0)), pin)
    return system


@pytest.mark.parametrize(
    ("spring", "one"),
    [
        ({"joint": "pin"}, True),
        ({"a": "ground", "b": "arm", "axis": (0.0, 1.0, 0.0)}, True),
        ({"a": "arm", "b": "ground", "axis": (0.0, -1.0, 0.0)}, True),
        ({"a": "ground", "b": "arm", "axis": (0.0, 0.0, 1.0)}, False),
        ({"a": "ground", "b": "hand", "axis": (0.0, 1.0, 0.0)}, False),
        ({"joint": "wrist"}, False),
    ],
)
def test_a_synchronization_takes_each_coordinate_once(spring: dict[str, Any], one: bool) -> None:
    system = pinned()
    system.add(parts.JointSpring(stiffness=1.0, **spring), "spring")
    system.add(parts.Joint(type="synchronization", joints=["pin", "spring"], stiffness=2.0), "cable")
    if one:
        with pytest.raises(InputError, match=r"cable\.joints names 'pin' and 'spring', which have one coordinate"):
            system.assemble()
    else:
        assert system.assemble().model.synchronizations.size == 1


@pytest.mark.parametrize("kind", [parts.Beam, parts.Rod])
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"a": ("boom", "boom")}, r"drum\.a names 'boom' twice"),
        ({"a": "boom", "skip": 9}, r"drum\.skip is 9; 'boom' has"),
    ],
)
def test_a_contact_has_points_of_each_once(kind: Any, given: dict[str, Any], words: str) -> None:
    system, material = System(), Material(young_modulus=1e9, poisson_ratio=0.3, density=1000.0)
    system.add(kind(length=1.0, section=Rectangle(thickness=0.01, width=0.02), material=material, elements=2), "boom")
    system.add(parts.Contact(b=(0.5, -1.0, 0.0), shape=parts.Sphere(radius=0.2), **given), "drum")
    with pytest.raises(InputError, match=words):
        system.assemble()


def test_a_narrow_terminal_folds_no_number(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    values = [f"{value:.8g}" for value in np.linspace(0.1234567, 98.7654321, 12)]
    table = Table(heads=[f"value {k}, kg" for k in range(12)], rows=[values], words=0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "60")
    showing.show(Answer(title="values", sections=[Section(title="", blocks=[table])]))
    shown = capsys.readouterr().out
    assert all(value in shown for value in values)
