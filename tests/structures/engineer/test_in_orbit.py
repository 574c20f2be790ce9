"""Structures as an engineer writes them, in orbit: antennas, booms with cords, a tether, a yo-yo, wires, separation."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import parts

HERE = pathlib.Path(__file__).parent


@pytest.mark.slow
def test_four_tape_antennas_slow_the_bus() -> None:
    """Angular momentum of the bus and four rods, each of which stands out by its length once it is straight."""
    run = ev.run(HERE / "antennas.yaml", {"simulate.until": "4 s"})
    assert run.attrs["status"] == "success"
    mass, length, reach = 0.012, 0.3, 0.052
    bus = 4.0 * (0.1**2 + 0.1**2) / 12
    stowed = bus + 4 * mass * (reach**2 + (0.02**2 + 0.001**2) / 12)
    out = bus + 4 * mass * ((reach + length / 2) ** 2 + (length**2 + 0.02**2) / 12)
    assert np.degrees(run["bus"].rate.values[-1, 2]) == pytest.approx(5.0 * stowed / out, rel=5e-3)
    assert np.degrees(run["bus"].rate.values[-1]) == pytest.approx([0.0, 0.0, 3.78], abs=0.01)
    H = run.angular_momentum.values
    assert H[-1] == pytest.approx(H[0], rel=1e-6, abs=1e-9)


@pytest.mark.slow
def test_four_booms_stretch_cords_between_their_tips() -> None:
    """Booms of 2.9 m from 0.05 m beside the axis; a cord of the quadrangle stretches by what its ends are apart."""
    system = ev.System(title="Drag sail with four booms")
    system.add(parts.RigidBody(mass=8, inertia=(0.12, 0.1, 0.05), shape={"box": (0.1, 0.2, 0.3)}), "bus")
    out, exit_at, stiffness, short = 2.9, 0.05, 10.0, 0.05
    drive = {"ramp": {"angle": 0.1, "steps": [(0, 0.2, 0.05), (56, 2, 0)]}}  # m, s and m/s
    wall = {"section": {"tube": {"radius": "8 mm", "thickness": "0.1 mm"}}, "material": "beryllium-copper"}
    side = math.sqrt(2) * (out + exit_at) - short
    for k in range(4):
        way = (math.cos((k + 0.5) * math.pi / 2), math.sin((k + 0.5) * math.pi / 2), 0.0)
        at = tuple(exit_at * x for x in way)
        boom = parts.Rod(length=3, elements=8, position=at, direction=way, normal=(0, 0, 1), payout=drive, **wall)
        system.add(boom, f"boom {k + 1}")
        system.add(parts.Joint(type="clamp", a=("bus", at), b=f"boom {k + 1}.root"), f"exit {k + 1}")
    for k in range(4):
        ends = {"a": f"boom {k + 1}.tip", "b": f"boom {(k + 1) % 4 + 1}.tip", "length": side}
        system.add(
            parts.Spring(**ends, law="where(x > 0, k*x + c*v, 0)", constants={"k": stiffness, "c": 0.2}),
            f"cord {k + 1}",
        )
    run = system.simulate(until="65 s", every="0.5 s")
    tips = [run[f"boom {k}"].position.values[-1, -1] for k in (1, 3)]
    across = float(np.linalg.norm(tips[0] - tips[1]))
    cord = run["cord 1"].force.values
    assert run["boom 1"].deployed_length.values[-1] == pytest.approx(0.1 + 0.05 * 56.9, rel=1e-9)
    assert across == pytest.approx(2 * (0.1 + 0.05 * 56.9 + exit_at), rel=1e-3)  # 5.990 m: 0.5 mm of bending and strain
    assert cord[-1] == pytest.approx(stiffness * (across / math.sqrt(2) - side), rel=1e-6)
    assert cord[-1] == pytest.approx(1.136, abs=2e-3)
    assert cord[run.time.values < 55.0].max() == 0.0
    assert np.abs(run["bus"].rate.values[-1]).max() < 1e-9


def test_a_yo_yo_slows_a_spinning_body() -> None:
    """Fedor's formula where the body spins about its axis; a body that nutates keeps its angular momentum."""
    turning, across, spin, radius, mass, cord, start = 20.0, 16.0, 2 * math.pi, 0.5, 0.5, 3.0, 0.05
    K = radius**2 + turning / (2 * mass)

    def left(length: float) -> float:
        return spin * (K - length**2) / (K + length**2)

    def run_of(nutation: float) -> Any:
        rate = np.array([turning * spin * math.tan(nutation) / across, 0.0, left(start)])
        system = ev.System(title="Yo-yo")
        body = parts.RigidBody(mass=150, inertia=(across, across, turning), angular_velocity=tuple(rate))
        system.add(body, "body")
        turns = (cord - start) / radius
        for k, side in ((1, 1.0), (2, -1.0)):
            at = np.array([side * radius, -side * start, 0.0])
            unwinding = np.array([side * start * spin, 0.0, 0.0])  # the cord turns by the first spin in the body
            point = parts.Point(mass=mass, position=tuple(at), velocity=tuple(np.cross(rate, at) + unwinding))
            system.add(point, f"mass {k}")
            drum = {"drum": radius, "anchor": (side * math.cos(turns), side * math.sin(turns), 0), "sense": -1}
            system.add(parts.Joint(type="link", a="body", b=f"mass {k}", length=cord, **drum), f"cord {k}")
        return system.simulate(until="0.9 s", every="5 ms")

    at_end = start + radius * spin * 0.9
    assert left(at_end) == pytest.approx(2.6363, abs=1e-4)
    flat = run_of(0.0)
    assert flat["body"].rate.values[-1, 2] == pytest.approx(left(at_end), rel=1e-4)
    tilted = run_of(math.radians(4.0))
    H = tilted.angular_momentum.values
    assert H[-1] == pytest.approx(H[0], rel=1e-6, abs=1e-6)


@pytest.mark.slow
def test_wire_booms_of_which_one_is_late() -> None:
    """Spin by the angular momentum of the spacecraft, 9.5 m of each wire that is out and the wire that is carried."""
    inertia, hub, radius, first, density, tip, line = 120.0, 0.6, 0.05, 2.0, 3.4e-3, 0.09, 15.0
    system = ev.System(title="Pair of wire booms")
    shape = {"cylinder": {"radius": hub, "length": 1, "axis": (0, 0, 1)}}
    system.add(
        parts.RigidBody(mass=300, inertia=(90, 100, inertia), shape=shape, angular_velocity=(0, 0, first)), "craft"
    )
    for name, side, begin in (("A", 1, 0.0), ("B", -1, 20.0)):
        drive = {"ramp": {"angle": 0.5 / radius, "steps": [(begin, 5, 0.05 / radius), (begin + 190, 5, 0)]}}
        axes = {"centre": (side * hub, 0, 0), "payout_axis": (side, 0, 0), "spool_axis": (0, 0, 1)}
        system.add(parts.Reel(body="craft", radius=radius, drive=drive, **axes), f"reel {name}")
        wire = {"length": line, "line_density": "3.4 g/m", "tip_mass": "90 g", "segments": "inextensible"}
        system.add(parts.Thread(reel=f"reel {name}", nodes=8, wound_mass="carried", **wire), f"wire {name}")
    run = system.simulate(until="260 s", every="1 s")

    def about(length: float) -> float:
        out = density / 3 * ((hub + length) ** 3 - hub**3)
        return tip * (hub + length) ** 2 + out + density * (line - length) * hub**2

    by_hand = first * (inertia + 2 * about(0.5)) / (inertia + 2 * about(0.5 + 0.05 * 190))
    assert by_hand == pytest.approx(1.68265, abs=1e-5)
    assert run["craft"].rate.values[-1, 2] == pytest.approx(by_hand, rel=5e-4)
    H = run.angular_momentum.values
    assert np.abs(H / H[0, 2] - H[0] / H[0, 2]).max() < 1e-7


@pytest.mark.slow
def test_a_reel_law_pays_out_a_tether() -> None:
    """The law keeps the rate in proportion to the length, which then is an exponential of time."""
    n, begin, longest, radius, growth = 1.13e-3, 20.0, 1000.0, 0.1, 0.75  # rad/s, m, m, m, -

    @ev.law
    def reel(x, v, t, p):  # type: ignore[no-untyped-def]
        length = x * p[0]
        wanted = min(0.75 * p[1] * length, 0.4 * p[1] * (p[2] - length) + 1e-3) / p[0]
        return -p[3] * (v - wanted)

    system = ev.System(title="Tether with a reel law")
    system.add(parts.Field(type="orbit", rate=n), "orbit")
    system.add(parts.RigidBody(mass=400, inertia=(50, 60, 60), shape={"box": (1, 1, 1)}), "main")
    moves = {
        "position": (0.5 + begin + 0.2, 0, 0),
        "velocity": (growth * n * begin, 0, 0),
        "points": {"hook": (-0.2, 0, 0)},
    }
    system.add(parts.RigidBody(mass=20, inertia=0.5, shape={"box": (0.4, 0.4, 0.4)}, **moves), "end body")
    starts = {"angle": begin / radius, "rate": growth * n * begin / radius}
    drive = parts.FreeSpool(inertia=0.01, law=reel, parameters=(radius, n, longest, 0.05), **starts)
    axes = {"centre": (0.5, 0, 0), "payout_axis": (1, 0, 0), "spool_axis": (0, 0, 1)}
    system.add(parts.Reel(body="main", radius=radius, drive=drive, **axes), "reel")
    line = {"length": 1100, "line_density": 1e-4, "nodes": 11, "stiffness": 200, "damping": 20, "slack": True}
    system.add(parts.Thread(reel="reel", end="end body.hook", **line), "tether")
    run = system.simulate(until="600 s", every="10 s")
    expected = begin * np.exp(growth * n * run.time.values)
    assert expected[-1] == pytest.approx(33.3, abs=0.1)
    assert run["tether"].deployed_length.values == pytest.approx(expected, rel=6e-3)


@pytest.mark.slow
def test_four_springs_separate_a_payload_and_tip_it_off() -> None:
    """Speed by the energy of the springs, and the spread of the rate by that of the impulses."""
    settings = {"until": "0.6 s", "every": "2 ms"}
    radius, stroke, force, stage, payload = 0.3, 0.05, 500.0, 1200.0, 60.0
    system = ev.System(title="Separation by four springs", settings=settings)
    system.add(
        parts.RigidBody(mass=stage, inertia=(400, 400, 300), shape={"box": (1, 1, 1)}, position=(0, 0, -0.5)), "stage"
    )
    system.add(
        parts.RigidBody(mass=payload, inertia=4, shape={"box": (0.6, 0.6, 0.6)}, position=(0, 0, 0.3)), "payload"
    )
    for n in range(4):
        x, y = radius * math.cos((n + 0.5) * math.pi / 2), radius * math.sin((n + 0.5) * math.pi / 2)
        ends = {"a": ("stage", (x, y, 0.4)), "b": ("payload", (x, y, -0.3))}
        system.add(parts.Spring(**ends, length=0.1 + stroke, stiffness=force / stroke), f"spring {n + 1}")
    system.add(
        parts.Joint(type="clamp", a=("stage", (0, 0, 0.5)), b=("payload", (0, 0, -0.3)), until="0.1 s"), "clamp band"
    )
    heights = {"zp": "payload.position.z", "zs": "stage.position.z"}
    system.add(parts.Event(law="zp - zs - 0.85", variables=heights, stops=True), "end of stroke")
    run = system.simulate()
    apart = run["payload"].velocity.values[-1, 2] - run["stage"].velocity.values[-1, 2]
    reduced = stage * payload / (stage + payload)
    assert apart == pytest.approx(math.sqrt(4 * force * stroke / reduced), rel=1e-5)
    assert apart == pytest.approx(1.32287, abs=1e-5)
    over = {f"parts.spring {n}.stiffness": "normal(nominal, 2%)" for n in range(1, 5)}
    keep = [f"payload.rate.{axis}.last" for axis in "xy"]
    found = ev.disperse({"case": system, "sample": "monte-carlo", "samples": 59, "seed": 3, "over": over, "keep": keep})
    impulse = force / math.sqrt(4 * force / stroke / reduced)
    std = (
        math.sqrt(4 * (0.02 * impulse * radius / math.sqrt(2)) ** 2) / 4.0
    )  # without the turns in the stroke, which slow it
    assert math.degrees(std) == pytest.approx(2.3, abs=0.01)
    for key in keep:
        assert 0.6 * std < found[key].moments["std"] < 1.1 * std
        assert found[key].lower.value < -std
        assert found[key].upper.value > std
