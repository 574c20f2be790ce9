"""Thread that flows from a reel to a take-up reel: a travelling string, balances, fixed ends, and what is refused."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
import yaml

from book import Book
from evolvent import InputError, System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.parts.registry import read_parts
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import Run, fitted_order, observe, run, tangent_columns

Array = np.ndarray
CHAPTER = "Threads, reels, tethers"
#: Radius of both reels, length between them (m), strain, axial stiffness (N), line density (kg/m).
RADIUS, SPAN, STRAIN, EA, DENSITY = 0.1, 2.0, 0.01, 1e4, 0.1
#: Wave speed in m of unstretched length per second: c^2 = N / (mu (1 + e)).
C = math.sqrt(EA * STRAIN / (DENSITY * (1.0 + STRAIN)))
NATURAL = SPAN / (1.0 + STRAIN)


def between_reels(
    elements: int,
    *,
    supply: Any,
    winder: Any = None,
    place: Any = (SPAN, 0.0, 0.0),
    gravity: Any = (0.0, 0.0, 0.0),
    moving: Any = None,
    **given: Any,
) -> System:
    """A thread that leaves its reel at the origin along x, and meets another one at `place`."""
    system = System(gravity=gravity)
    if moving is not None:
        system.add(parts.RigidBody(motion="driven", **moving), "arm")
    system.add(parts.Reel(body="ground", radius=RADIUS, centre=(0.0, 0.0, -RADIUS), drive=supply), "supply")
    x, y, z = place
    other: dict[str, Any] = {"payout_axis": (-1.0, 0.0, 0.0), "centre": (x, y, z + RADIUS)}
    if winder is not None:
        body = "ground" if moving is None else "arm"
        system.add(parts.Reel(body=body, radius=RADIUS, drive=winder, **other), "winder")
        given = {"take_up": "winder"} | given
    own: dict[str, Any] = {
        "length": 20.0, "line_density": DENSITY, "nodes": elements, "stiffness": EA * elements / 20.0, "mesh": "moving",
    }  # fmt: skip
    system.add(parts.Thread(reel="supply", **(own | given)), "string")
    return system


def travelling(elements: int, speed: float) -> Assembly:
    """The string at a speed in m of unstretched length per second."""
    supply = parts.ConstantDrive(rate=speed / RADIUS, angle=NATURAL / RADIUS)
    return between_reels(elements, supply=supply, winder=parts.ConstantDrive(rate=-speed / RADIUS)).assemble()


def frequency(n: int, speed: float) -> float:
    """n pi (c^2 - v^2)/(c L), rad/s."""
    return n * math.pi * (C * C - speed * speed) / (C * NATURAL)


@pytest.mark.parametrize("part", [0.0, 0.4, -0.7])
def test_frequencies_of_a_travelling_string(part: float, book: Book) -> None:
    """n pi (c^2 - v^2)/(c L), both ways, of second order in the elements, without damping."""
    speed, elements, errors = part * C, np.array([24, 48, 96]), []
    exact = np.array([frequency(n, speed) for n in (1, 1, 2, 2, 3, 3)])
    for n in elements:
        found = modes(travelling(int(n), speed), count=6)
        assert np.abs(found.pole.real).max() < 1e-6 * exact[0]
        errors.append(np.abs(found.frequency / exact - 1.0))
    orders = fitted_order(1.0 / elements, np.array(errors)[:, 0])
    assert orders == pytest.approx(2.0, abs=0.15)
    if part == 0.4:
        book(
            "Modes", "Travelling string at 0.4 times its wave speed, first frequency (moving mesh, 96 elements)",
            reference="n pi (c^2 - v^2)/(c L)", source="closed form", error=errors[-1][0], allowed=1e-4, order=orders,
            wanted="2",
        )  # fmt: skip


def test_a_mode_in_time(book: Book) -> None:
    """sin(pi s/L) cos(w t + pi v s/(c L)), s the unstretched distance from the supply: two periods."""
    speed, amplitude, elements, errors = 0.4 * C, 1e-4, np.array([24, 48, 96]), []
    w = frequency(1, speed)
    period = 2.0 * math.pi / w
    t = np.linspace(0.0, 2.0 * period, 9)
    for n in elements:
        assembly = travelling(int(n), speed)
        row, s = assembly.model.threads[0], 1.0 - np.arange(1, n) / n
        shape, phase = np.sin(math.pi * s), math.pi * speed / C * s
        at = int(row["iq"]) + 3 * np.arange(1, n) + 2
        rate = int(row["iv"]) + 3 * np.arange(1, n) + 2
        assembly.y[at], assembly.y[rate] = amplitude * shape * np.cos(phase), -w * amplitude * shape * np.sin(phase)
        found = solve_implicit(assembly, samples=t, step=period / 800.0, spectral_radius=1.0)
        assert found.success, found.message
        errors.append(np.abs(found.y[:, at] / amplitude - shape * np.cos(w * t[:, None] + phase)).max())
    order = fitted_order(1.0 / elements, np.array(errors))
    assert order == pytest.approx(2.0, abs=0.2)
    book(
        CHAPTER, "A mode of a string at 0.4 times its wave speed, over two periods (moving mesh, 96 elements)",
        reference="sin(pi s/L) cos(w t + pi v s/(c L))", source="closed form", error=errors[-1], allowed=2e-3,
        order=order, wanted="2",
    )  # fmt: skip


DRIVES = {
    "both ways": parts.RampDrive(angle=18.0, rate=3.0, steps=((0.05, 0.1, -4.0), (0.25, 0.1, 6.0))),
    "free": parts.FreeSpool(inertia=2e-2, angle=18.0, rate=4.0, viscous_damping=1e-2),
}


@pytest.mark.parametrize(
    "moving",
    [None, {"rate": 0.3, "axis": (0.0, 0.6, 0.8)}, {"drive": parts.RampDrive(steps=((0.05, 0.2, 0.5),))}],
    ids=["ground", "turning", "line"],
)
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("winds", [True, False], ids=["take-up", "end"])
def test_balances(winds: bool, drive: str, moving: Any, book: Book) -> None:
    """Energy with what both reels, weight and the driven body do, to the error of the integration, by two methods."""
    take_up = parts.RampDrive(rate=-2.0, steps=((0.1, 0.2, -7.0),)) if winds else None
    place = (1.8, 0.05, 0.1)
    given: dict[str, Any] = {"gravity": (0.0, 0.0, -9.81), "moving": moving, "damping": 2.0, "place": place}
    if not winds:
        given["end"] = ("ground" if moving is None else "arm", place)
    system = between_reels(5, supply=DRIVES[drive], winder=take_up, **given, tip_mass=0.05)
    found = run(system.assemble(), np.linspace(0.0, 0.4, 9), rtol=1e-10, atol=1e-12)
    error = np.abs(found.energy_defect).max() / found.energy.max()
    assert error < 1e-8
    assert np.ptp(found.energy) > 0.1 * found.energy.max()
    if winds and moving is None:
        name = "from a free reel" if drive == "free" else "from a driven reel"
        book(
            CHAPTER, f"Thread onto a take-up reel, {name}: energy (moving mesh)", reference="conserved",
            source="closed form", error=error, allowed=1e-8,
        )  # fmt: skip
    implicit = solve_implicit(system.assemble(), samples=found.t, step=5e-5, spectral_radius=0.9)
    assert implicit.success, implicit.message
    n_q = int(found.assembly.model.info.nq)
    assert implicit.y[-1, :n_q] == pytest.approx(found.y[-1, :n_q], abs=1e-4)
    own = Run(found.assembly, implicit, observe(found.assembly.model, implicit.t, implicit.y, implicit.s))
    assert np.abs(own.energy_defect).max() < 1e-4 * found.energy.max()


@pytest.mark.parametrize("drive", DRIVES)
def test_tangent(drive: str, rng: np.random.Generator) -> None:
    """Of a thread between reels it is exact under a drive; of a free spool but for what rates change in the inertia."""
    take_up = parts.RampDrive(rate=-2.0, steps=((0.1, 0.2, -7.0),))
    assembly = between_reels(4, supply=DRIVES[drive], winder=take_up, place=(1.8, 0.05, 0.1), damping=2.0).assemble()
    y, n_q = assembly.y.copy(), int(assembly.model.info.nq)
    y[:12] += 0.02 * rng.standard_normal(12)
    y[n_q : n_q + 12] += rng.standard_normal(12)
    found, differences = tangent_columns(assembly, y, rng)
    if drive != "free":
        assert np.abs(found - differences).max() < 1e-7 * np.abs(found).max()
        return
    k = int(assembly.model.threads["spool_v"][0]) - n_q
    others = np.delete(np.arange(found.shape[0]), k)
    assert np.abs(found - differences)[np.ix_(others, others)].max() < 1e-7 * np.abs(found).max()


def test_a_flow_that_changes_the_length_has_no_equilibrium() -> None:
    supply, take_up = parts.ConstantDrive(rate=3.0, angle=18.0), parts.ConstantDrive(rate=-2.0)
    system = between_reels(4, supply=supply, winder=take_up, place=(1.8, 0.0, 0.0))
    with pytest.raises(InputError, match=r"pays out 0.3 m/s at 0 s and the take-up .* takes up 0.2 m/s"):
        modes(system.assemble())
    flowing = travelling(4, 1.0)
    with pytest.raises(InputError, match="rotating does not support the thread 'string', which flows to a take-up"):
        modes(flowing, rotating=(0.0, 0.0, 1.0))
    pays = between_reels(4, supply=supply, winder=parts.ConstantDrive(rate=2.0), place=(1.8, 0.0, 0.0))
    with pytest.raises(InputError, match="has paid out more than it has taken up"):
        pays.simulate(until=1.0, every=0.5, step=1e-3)


WINDS, STILL = parts.ConstantDrive(rate=-1.0), parts.ConstantDrive(rate=0.0, angle=18.0)
REFUSED: list[tuple[str, dict[str, Any]]] = [
    ("string.take_up is 'winder'; it needs string.mesh 'moving', not 'material'", {"mesh": "material"}),
    ("string.take_up is 'supply', a reel of the thread 'string'; give one of its own", {"take_up": "supply"}),
    ("string.end and string.take_up are both given", {"end": ("ground", (1.8, 0.0, 0.0))}),
    ("string.nodes is 1; with string.take_up and mesh 'moving' it must be 2 or more", {"nodes": 1}),
    ("string.take_up is 'winder'; it needs string.multiplicity 1, which is 2", {"multiplicity": 2}),
    ("2.8 m from where the thread leaves 'supply'", {"place": (2.8, 0.0, 0.0)}),
]


@pytest.mark.parametrize(("message", "given"), REFUSED)
def test_what_is_refused(message: str, given: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        between_reels(4, **({"supply": STILL, "winder": WINDS, "place": (1.8, 0.0, 0.0)} | given)).assemble()


def test_reels_and_ends_that_are_refused() -> None:
    place = (1.8, 0.0, 0.0)
    free = between_reels(4, supply=STILL, winder=parts.FreeSpool(inertia=1.0), place=place)
    with pytest.raises(InputError, match=r"winder.drive is a free spool, but string.take_up names that reel"):
        free.assemble()
    wound = between_reels(4, supply=STILL, winder=parts.ConstantDrive(rate=-1.0, angle=2.0), place=place)
    with pytest.raises(InputError, match=r"winder.drive.angle is 2.0 rad; a take-up reel is empty at the start"):
        wound.assemble()
    flying = between_reels(4, supply=STILL, place=place, end="body")
    flying.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=place), "body")
    with pytest.raises(InputError, match=r"string.end is 'body', which moves freely; with string.mesh 'moving'"):
        flying.assemble()


CASE = """
supply: {kind: reel, body: ground, radius: 10 cm, centre: [0 m, 0 m, -10 cm],
         drive: {constant: {angle: 18 rad, rate: 2 rad/s}}}
winder: {kind: reel, body: ground, radius: 10 cm, centre: [1.81 m, 0 m, 10 cm], payout_axis: [-1, 0, 0],
         drive: {constant: {rate: -2 rad/s}}}
string: {kind: thread, reel: supply, take_up: winder, length: 20 m, line_density: 0.1 kg/m, nodes: 4,
         stiffness: 2 kN/m, mesh: moving}
"""


def test_a_case_file_and_its_results() -> None:
    """Length and tension stay as they are, and the take-up reel shows what it has wound."""
    system = System()
    for name, part in read_parts(yaml.safe_load(CASE)).items():
        system.add(part, name)
    found = system.simulate(until=0.5, every=0.25)
    assert found["string"].deployed_length.values == pytest.approx(1.8)
    assert found["winder"].wound_length.values == pytest.approx([0.0, 0.05, 0.1])
    assert found["winder"].angle.values == pytest.approx([0.0, -0.5, -1.0])
    assert found["winder"].rate.values == pytest.approx(-2.0)
    assert found["winder"].position.values[-1] == pytest.approx([1.81, 0.0, 0.1])
    strain = 1.81 / 1.8 - 1.0
    assert found["string"].tension.values == pytest.approx(1e4 * strain, rel=1e-6)
    # the mesh at Q pulls by N, and the material brings mu p V
    assert found["string"].hub_tension.values == pytest.approx(1e4 * strain, rel=1e-6)
