"""Rigid bodies, point masses and links against validation.md."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent
from book import Book
from evolvent import model as mdl, parts
from evolvent.analysis.system import System
from evolvent.parts.base import unit
from helpers import fitted_order, rotation, run

G = 9.81


@evolvent.law
def rises(t, y, parameters):  # type: ignore[no-untyped-def]
    return y[int(parameters[0])]


@evolvent.law
def falls(t, y, parameters):  # type: ignore[no-untyped-def]
    return -y[int(parameters[0])]


def test_dzhanibekov(book: Book) -> None:
    """J (1, 2, 3), w0 (0.01, 1, 0.01): flip interval 19.5528671 s (validation.md).

    The middle rate passes through zero; its crossings are found by events of the user's.
    """
    system = System()
    system.add(
        parts.RigidBody(
            mass=2.0, inertia=(1.0, 2.0, 3.0), angular_velocity=(0.01, 1.0, 0.01), velocity=(0.1, 0.2, -0.3)
        )
    )
    middle = 7 + 4  # position and quaternion, velocity, then the second rate
    system.add(parts.Event(law=rises, parameters=[middle]))
    system.add(parts.Event(law=falls, parameters=[middle]))
    t = np.linspace(0.0, 100.0, 101)
    seen = run(system.assemble(), t, rtol=1e-12, atol=1e-13)
    assert np.diff(seen.solution.event_times) == pytest.approx([19.5528671] * 4, abs=1e-6)
    assert list(seen.solution.event_kinds) == [1, 0, 1, 0, 1]
    assert np.ptp(seen.momentum, axis=0).max() < 1e-10
    assert np.ptp(seen.energy) < 1e-10
    assert seen.seen.body_position[:, 1] == pytest.approx(np.outer(t, [0.1, 0.2, -0.3]), abs=1e-11)
    book(
        "Rigid bodies", "Dzhanibekov: flip intervals, J (1, 2, 3), for 100 s", reference="19.5528671 s",
        source="closed form, elliptic integral",
        error=np.abs(np.diff(seen.solution.event_times) / 19.5528671 - 1.0).max(), allowed=5e-9,
    )  # fmt: skip


@pytest.mark.parametrize(("method", "tolerance"), [("dopri5", 1e-9), ("rk4", 1e-8)])
def test_free_body_keeps_energy_and_momentum(rng: np.random.Generator, method: str, tolerance: float) -> None:
    """A free body of any inertia: energy, momenta and the quaternion's norm are kept (Euler's equations)."""
    for _ in range(3):
        a = rng.normal(size=(3, 3))
        tensor = a @ a.T
        tensor = np.trace(tensor) * np.eye(3) - tensor  # of a cloud of masses: always one that a body can have
        system = System()
        system.add(
            parts.RigidBody(
                mass=float(rng.uniform(0.5, 3.0)),
                inertia=tensor,
                position=rng.normal(size=3),
                velocity=rng.normal(size=3),
                orientation=unit(rng.normal(size=4)),
                angular_velocity=rng.normal(size=3),
            )
        )
        options = {"step": 2e-3} if method == "rk4" else {"rtol": 1e-11, "atol": 1e-12}
        seen = run(system.assemble(), np.linspace(0.0, 10.0, 21), method, **options)
        for kept in (seen.energy[:, None], seen.momentum, seen.linear_momentum):
            assert np.ptp(kept, axis=0).max() < tolerance * np.abs(kept).max()
        assert np.linalg.norm(seen.y[:, 3:7], axis=1) == pytest.approx(1.0, abs=1e-10)


def test_free_symmetric_top_turns_steadily(book: Book) -> None:
    """A symmetric top: body-axes rate turns at (C - A) / A w3 (Euler); inertial H stays."""
    A, C, w3, w1 = 1.0, 1.6, 2.0, 0.3
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(A, A, C), angular_velocity=(w1, 0.0, w3)))
    t = np.linspace(0.0, 20.0, 201)
    seen = run(system.assemble(), t, rtol=1e-12, atol=1e-13)
    w = seen.y[:, 10:13]
    k = (C - A) / A * w3
    assert w[:, 0] == pytest.approx(w1 * np.cos(k * t), abs=1e-10)
    assert w[:, 1] == pytest.approx(w1 * np.sin(k * t), abs=1e-10)
    assert w[:, 2] == pytest.approx(w3, abs=1e-10)
    book(
        "Rigid bodies", "Free symmetric top, 20 s", reference="precession at (C - A) w3/A", source="closed form, Euler",
        error=np.abs(w[:, 0] - w1 * np.cos(k * t)).max(), allowed=1e-10, unit="rad/s",
    )  # fmt: skip


def pendulum() -> object:
    system = System(gravity=(0.0, -G, 0.0))
    bob = system.add(parts.Point(mass=1.0, position=(-1.0, 0.0, 0.0)))
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=bob, type="link"))
    return system.assemble()


def test_pendulum_a01(book: Book) -> None:
    """IFToMM A01 (L = m = 1, g 9.81, from horizontal): (-0.2750874626, -0.9614192051) at 10 s (validation.md)."""
    seen = run(pendulum(), [0.0, 10.0], rtol=1e-12, atol=1e-13)
    assert seen.y[-1, :2] == pytest.approx([-0.2750874626, -0.9614192051], abs=1e-9)
    assert np.linalg.norm(seen.y[-1, :3]) == pytest.approx(1.0, abs=1e-12)
    book(
        "Rigid bodies", "IFToMM A01, pendulum at 10 s (Dormand-Prince, 1e-12)",
        reference="(-0.2750874626, -0.9614192051) m", source="IFToMM library; elliptic functions",
        error=np.abs(seen.y[-1, :2] - [-0.2750874626, -0.9614192051]).max(), allowed=1e-9, unit="m",
    )  # fmt: skip


def test_pendulum_of_two_lengths_of_body(book: Book) -> None:
    """A body hung by a point off its centre swings like the physical pendulum: J + m h^2 (parallel axes).

    A free body held by three links to the ground at one of its points; small steps in the plane; against SciPy.
    """
    h, mass, inertia = 0.3, 2.0, 0.1
    system = System(gravity=(0.0, -G, 0.0))
    system.add(parts.RigidBody(mass=mass, inertia=inertia, position=(h, 0.0, 0.0)), "bar")
    point = ("bar", (-h, 0.0, 0.0))
    for anchor in ((1e3, 0.0, 0.0), (0.0, 1e3, 0.0), (0.0, 0.0, 1e3)):  # long links: the point moves by nothing
        system.add(parts.Joint(a=anchor, b=point, type="link"))
    t = np.linspace(0.0, 2.0, 41)
    seen = run(system.assemble(), t, rtol=1e-10, atol=1e-11)
    J = inertia + mass * h * h

    def f(_: float, z: np.ndarray) -> list[float]:
        return [z[1], -mass * G * h / J * np.sin(z[0])]

    theta = solve_ivp(f, (0.0, 2.0), [np.pi / 2, 0.0], "DOP853", t, rtol=1e-12, atol=1e-13).y[0]
    assert seen.seen.body_position[:, 1, 0] == pytest.approx(h * np.sin(theta), abs=1e-7)
    assert seen.seen.body_position[:, 1, 1] == pytest.approx(-h * np.cos(theta), abs=1e-7)
    book(
        "Rigid bodies", "Physical pendulum for 2 s, held by links", reference="equation of one angle",
        source="SciPy DOP853, 1e-12", error=np.abs(seen.seen.body_position[:, 1, 0] - h * np.sin(theta)).max(),
        allowed=1e-7, unit="m",
    )  # fmt: skip


def chain(n: int = 10) -> object:
    system = System(gravity=(0.0, -G, 0.0))
    previous: object = (0.0, 0.0, 0.0)
    for k in range(n):
        point = system.add(parts.Point(mass=1.0 / n, position=((k + 1) / n, 0.0, 0.0)), f"p{k}")
        system.add(parts.Joint(a=previous, b=point, type="link"))
        previous = point
    return system.assemble()


def test_chain_of_ten_links(book: Book) -> None:
    """10 rigid links, L 1, total mass 1, pinned, from horizontal: tip at 0.5 s (-0.156401511, -0.915683202).

    (validation.md.) The masses are lumped at the links' outer ends.
    """
    seen = run(chain(), [0.0, 0.25, 0.5], rtol=1e-11, atol=1e-12)
    assert seen.y[-1, 27:29] == pytest.approx([-0.156401511, -0.915683202], abs=2e-9)
    assert seen.accounts[-1, mdl.LOAD] == pytest.approx(seen.energy[-1] - seen.energy[0], rel=1e-9)
    book(
        "Dynamics", "Chain of ten rigid links from level, tip at 0.5 s", reference="(-0.156401511, -0.915683202) m",
        source="independent computation", error=np.abs(seen.y[-1, 27:29] - [-0.156401511, -0.915683202]).max(),
        allowed=2e-9, unit="m",
    )  # fmt: skip


def test_two_free_bodies_on_a_link_keep_momentum(rng: np.random.Generator) -> None:
    """Two free bodies tied point to point: both momenta and the energy are kept, the link keeps its length."""
    system = System()
    for k in range(2):
        system.add(parts.RigidBody(mass=1.0 + k, inertia=(0.2, 0.3, 0.4), position=(2.0 * k, 0.0, 0.0)), f"body-{k}")
    ends = [("body-0", (0.3, 0.1, 0.0)), ("body-1", (-0.2, 0.0, 0.1))]
    system.add(parts.Joint(a=ends[0], b=ends[1], type="link"))
    system.add(parts.Load(at="body-0", torque=(0.3, 1.0, -0.5), until=1.0))
    seen = run(system.assemble(), np.linspace(0.0, 5.0, 51), rtol=1e-11, atol=1e-12)
    p = [
        seen.seen.body_position[:, 1 + k] + np.einsum("tij,j->ti", seen.seen.body_rotation[:, 1 + k], ends[k][1])
        for k in range(2)
    ]
    length = np.linalg.norm(p[1] - p[0], axis=1)
    assert length == pytest.approx(length[0], abs=1e-11)
    after = seen.t >= 1.0
    assert np.ptp(seen.momentum[after], axis=0).max() < 1e-9
    assert np.max(np.abs(seen.linear_momentum)) < 1e-11
    assert np.max(np.abs(seen.energy_defect)) < 1e-9
    assert seen.momentum[-1] == pytest.approx([0.3, 1.0, -0.5], abs=1e-9)


def test_rotation_of_a_driven_body(book: Book) -> None:
    """A driven body turns at its rate about its own axis, from its orientation."""
    quaternion = tuple(unit((0.8, 0.2, -0.4, 0.3)).tolist())
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.7, axis=(0.0, 1.0, 0.0), orientation=quaternion))
    system.add(parts.Point(mass=1.0))
    seen = run(system.assemble(), [0.0, 1.3])
    c, s = np.cos(0.91), np.sin(0.91)
    turned = rotation(quaternion) @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    assert seen.seen.body_rotation[-1, 1] == pytest.approx(turned, abs=1e-12)
    book(
        "Rigid bodies", "Driven body about a tilted axis", reference="rotation matrix", source="closed form",
        error=np.abs(seen.seen.body_rotation[-1, 1] - turned).max(), allowed=1e-12, unit="rad",
    )  # fmt: skip


def test_links_lengths_are_held_to_round_off() -> None:
    """After every step links stand at their lengths and rates (projection); the error does not grow with the steps."""
    errors = []
    for step in (4e-3, 2e-3):
        seen = run(chain(4), np.linspace(0.0, 2.0, 11), "rk4", step=step)
        x = np.concatenate([np.zeros((11, 1, 3)), seen.y[:, :12].reshape(11, 4, 3)], axis=1)
        errors.append(np.max(np.abs(np.linalg.norm(np.diff(x, axis=1), axis=2) - 0.25)))
    assert max(errors) < 1e-12
    assert fitted_order([1.0, 2.0], [1.0, 2.0]) == pytest.approx(1.0)
