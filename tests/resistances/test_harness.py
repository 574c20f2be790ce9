"""Harnesses across joints: loops in closed form, energy balances, identification from a measured loop, refusals."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from pydantic_core import PydanticCustomError

from book import Book
from evolvent import InputError, cases, parts
from evolvent.families.coordinates import part_hysteresis as hysteresis
from evolvent.parts import table_file
from evolvent.solvers.static.static import solve_static
from evolvent_base.units import parse
from resistances.rigs import IMPLICIT, METHODS, run, seen, turned, wheel

Array = np.ndarray
STICK, LIMIT, AMPLITUDE = 4.0, 0.3, 0.5
#: Energy that a bristle takes in a cycle of an amplitude, in closed form.
CYCLE = {
    "slip": 4.0 * LIMIT * (AMPLITUDE - LIMIT / STICK),
    "dahl": 4.0 * LIMIT * (AMPLITUDE - LIMIT / STICK * math.tanh(STICK * AMPLITUDE / LIMIT)),
}


def harness(**keys: Any) -> parts.Resistance:
    return parts.Resistance(joint="hinge", type="harness", **keys)


@pytest.mark.parametrize("law", ["slip", "dahl"])
@pytest.mark.parametrize("step", [0.125, 0.05, 0.0125])
def test_a_loop_takes_its_area(book: Book, law: str, step: float) -> None:
    """To round-off at any step that ends where the motion turns back: the path within a step is integrated exactly."""
    it = harness(torque=[[-1.0, -2.0], [0.1, 0.0], [1.0, 3.0]], bristles=[[STICK, LIMIT]], law=law)
    times = np.arange(0.0, 4.01, 0.25)
    found = run(turned(it, AMPLITUDE), times, "energy", step=step)
    own = seen(found, "it")
    assert own["angle"] == pytest.approx(AMPLITUDE * np.sin(2.0 * np.pi * times), abs=1e-9)
    cycles = np.diff(own["hysteresis_work"][5::4])  # after the first way from rest
    book(
        "Rigid bodies", f"Harness ({law}) under a driven angle at a step of {step} cycles: energy taken in a cycle",
        reference=f"{CYCLE[law]:.9f} J", source="area of the loop in closed form",
        error=np.abs(cycles - CYCLE[law]).max() / CYCLE[law], allowed=1e-8,
    )  # fmt: skip
    assert found.balance.by_friction == pytest.approx(own["hysteresis_work"], abs=1e-14)
    assert np.abs(found.energy_defect).max() < 1e-9


@pytest.mark.parametrize("law", ["slip", "dahl"])
@pytest.mark.parametrize("method", METHODS)
def test_a_wheel_rings_down_alike(law: str, method: str) -> None:
    """Under every method the same motion and the same loss; the balance closes."""
    it = harness(torque=[[-1.0, -3.0], [0.0, 0.0], [1.0, 2.0]], bristles=[[4.0, 0.3], [2.0, 0.6]], law=law)
    times = np.linspace(0.0, 3.0, 7)
    found = run(wheel(it, rate=1.5, stiffness=1.0), times, method)
    fine = run(wheel(it, rate=1.5, stiffness=1.0), times, "rk4", step=2e-4)
    one, other = seen(found, "it"), seen(fine, "it")
    for key in ("angle", "torque", "hysteresis_torque", "hysteresis_work", "energy_elastic"):
        assert one[key] == pytest.approx(other[key], abs=2e-3 * np.abs(other[key]).max()), key
    assert np.abs(found.energy_defect).max() < {"rk4": 1e-6, "alpha": 5e-5, "energy": 1e-13}[method]
    assert np.all(np.diff(found.balance.by_friction) >= 0.0)


@pytest.mark.parametrize("law", ["slip", "dahl"])
@pytest.mark.parametrize("step", [0.3, 0.03])
def test_the_balance_closes_at_long_steps(law: str, step: float) -> None:
    """Under energy-momentum without numerical damping: what is stored, moves and is lost adds up to round-off."""
    it = harness(torque=[[-1.0, -3.0], [0.0, 0.0], [1.0, 2.0]], bristles=[[4.0, 0.3], [2.0, 0.6]], law=law, set=0.2)
    found = run(wheel(it, rate=1.5, stiffness=1.0), np.linspace(0.0, 6.0, 6), "energy", step=step)
    assert np.abs(found.energy_defect).max() < 1e-13 * found.energy[0]
    assert found.balance.by_friction[-1] > 0.3


def test_a_measured_loop_gives_its_own_parameters() -> None:
    """Of a loop that such a harness makes; a dense table of it."""
    x = np.concatenate([np.linspace(0.0, 1.0, 101), np.linspace(1.0, -1.0, 201)[1:], np.linspace(-1.0, 0.0, 101)[1:]])
    pairs = [(3.0, 3.0 * 2.0 * hysteresis.DEFLECTIONS[3]), (1.0, 2.0 * hysteresis.DEFLECTIONS[8])]
    torque = 0.5 * x + 0.1 * np.abs(x)
    for stick, limit in pairs:
        force, own = 0.0, np.zeros(x.size)
        for _ in range(2):
            for n in range(x.size):
                own[n] = force
                moved = x[n + 1] - x[n] if n + 1 < x.size else 0.0
                force = hysteresis.bristle(0, stick, limit, force, moved)
        torque = torque + own
    found = hysteresis.identified("loop", np.stack([x, torque], axis=1), "slip", 1e-4)
    assert found.misfit < 1e-5
    best = sorted(found.bristles, key=lambda pair: -pair[0] * pair[1])[:2]
    assert sorted(best) == [pytest.approx(pair, rel=2e-3) for pair in sorted(pairs)]
    assert np.interp([-0.5, 0.0, 0.5], found.x, found.torque) == pytest.approx([-0.2, 0.0, 0.3], abs=2e-3)


@pytest.mark.parametrize("law", ["slip", "dahl"])
def test_a_run_follows_a_measured_loop(law: str) -> None:
    """The loop of a Bouc-Wen law, which neither law of the bristles is, within its stated misfit."""
    A, L, k, beta = 0.8, 0.5, 3.0, 0.6
    x = np.concatenate([np.linspace(-A, A, 400), np.linspace(A, -A, 400)[1:]])
    z = np.zeros(x.size)
    for _ in range(3):
        z[0] = z[-1]
        for n in range(x.size - 1):
            dx = x[n + 1] - x[n]
            sense = math.copysign(1.0, z[n] * dx)
            z[n + 1] = z[n] + k * dx * (1.0 - (beta * sense + 1.0 - beta) * abs(z[n] / L))
    loop = np.stack([x, 0.4 * x + z], axis=1)[::9]
    loop[-1] = loop[0]
    it = harness(loop=loop.tolist(), law=law, misfit=0.04)
    found = run(turned(it, A), np.linspace(0.0, 2.0, 81), "energy", step=1.0 / 200.0)
    own = seen(found, "it")
    forth = slice(71, 81)  # the last quarter, up from -A
    wanted = np.interp(own["angle"][forth], x[:400], 0.4 * x[:400] + z[:400])
    assert np.abs(own["torque"][forth] - wanted).max() < 0.1 * np.ptp(z)
    area = np.trapezoid(0.4 * x + z, x)
    assert own["hysteresis_work"][-1] - own["hysteresis_work"][40] == pytest.approx(area, rel=0.05)


def test_set_and_how_it_was_bent() -> None:
    """The elastic curve moves with the set; bristles are bent from where they had no torque."""
    keys: dict[str, Any] = {"stiffness": 2.0, "rest": 0.1, "set": 0.25, "bristles": [[STICK, LIMIT]]}
    still = seen(run(wheel(harness(**keys), start=0.5), [0.0, 0.01], "energy"), "it")
    assert still["torque"][0] == pytest.approx(2.0 * (0.5 - 0.1 - 0.25))
    bent = seen(run(wheel(harness(**keys, relaxed_at=0.46), start=0.5), [0.0, 0.01], "alpha"), "it")
    assert bent["hysteresis_torque"][0] == pytest.approx(STICK * 0.04)
    far = seen(run(wheel(harness(**keys, relaxed_at=-1.0), start=0.5), [0.0, 0.01], "rk4"), "it")
    assert far["hysteresis_torque"][0] == pytest.approx(LIMIT)


def test_equilibrium() -> None:
    """A wheel with its spring comes to rest beside where the spring alone would have it: the bristle slips."""
    found = solve_static(wheel(harness(bristles=[[STICK, LIMIT]]), stiffness=1.0, rest=0.6).assemble())
    assert found.success, found.message
    own = seen(found, "it")
    assert own["angle"][-1] == pytest.approx(0.6 - LIMIT, abs=1e-9)
    assert own["hysteresis_work"][-1] == pytest.approx(LIMIT * (0.3 - LIMIT / STICK), rel=1e-6)


@pytest.mark.parametrize("method", IMPLICIT)
def test_of_a_travel(method: str) -> None:
    """A mass slides against a harness on a slide: m v dv = -(F + bristle) dx until it stops."""
    from evolvent import System

    system = System()
    system.add(parts.Point(mass=2.0, velocity=(0.4, 0.0, 0.0)), "mass")
    system.add(parts.JointSpring(a="ground", b="mass", axis=(1.0, 0.0, 0.0), motion="translation"), "slide")
    system.add(parts.Resistance(joint="slide", type="harness", bristles=[["100 N/m", "0.5 N"]]), "it")
    found = run(system, np.linspace(0.0, 2.0, 401), method)
    own = seen(found, "it")
    top = 0.005 + (0.16 - 0.00125) / 0.5  # 0.16 J = 0.5 N (x - 5 mm) + 1.25 mJ up to the turn
    assert own["travel"].max() == pytest.approx(top, abs=2e-5)
    assert np.abs(found.energy_defect).max() < 1e-4 * 0.16
    assert own["force"][100] == pytest.approx(0.5, abs=1e-6)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({}, r"it has no torque; give it\.loop, or it\.torque"),
    ({"torque": [[0, 0], [1, 1]], "stiffness": 2.0}, r"it\.torque and it\.stiffness are both given"),
    ({"torque": [[0, 0], [0, 1]]}, r"it\.torque: row 2 is at 0, not above the row before, at 0"),
    ({"loop": [[0, 0], [1, 1]]}, r"it\.loop starts at 0 and ends at 1; a loop ends where it starts"),
    (
        {"loop": [[0, 0], [0.5, 0], [1, 1], [0.5, 1], [0, 0]]},
        r"it\.loop is met to .* of its height, the range of its torques, by the law 'slip'",
    ),
    ({"stiffness": "3 N/m"}, r"it\.stiffness is 3 N/m, but its coordinate is an angle; give it in N m/rad"),
    ({"stiffness": 1.0, "misfit": 0.1}, r"it\.misfit is given without it\.loop"),
    ({"bristles": [[1.0, 0.2]], "rest": 0.1}, r"it\.rest is given without it\.stiffness"),
    ({"loop": [[0, 0], [1, 1], [0, 0.5]], "bristles": [[1.0, 0.2]]}, r"it\.bristles and it\.loop are both given"),
]


@pytest.mark.parametrize(("keys", "sentence"), REFUSED)
def test_refusals(keys: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        wheel(harness(**keys)).assemble()


@pytest.mark.parametrize("method", METHODS)
def test_a_run_goes_on_from_the_state_of_another(method: str) -> None:
    """Bristles are part of the state."""
    it = harness(bristles=[[STICK, LIMIT]])
    options = {"rk4": {}, "alpha": {"step": 1e-3}, "energy": {"step": 1e-3}}[method]
    whole = run(wheel(it, rate=1.5, stiffness=1.0), np.linspace(0.0, 2.0, 5), method, **options)
    half = run(wheel(it, rate=1.5, stiffness=1.0), np.linspace(0.0, 1.0, 3), method, **options)
    assembly = wheel(it, rate=1.5, stiffness=1.0).assemble()
    function, own = METHODS[method]
    given = {key: value for key, value in (own | options).items() if not (key == "tolerance" and options)}
    start = dataclasses.replace(assembly, y=half.y[-1].copy(), s=half.s[-1].copy())
    found = function(start, samples=np.linspace(1.0, 2.0, 3), **given)
    assert found.success, found.message
    for key in ("angle", "hysteresis_torque"):
        assert seen(found, "it")[key] == pytest.approx(seen(whole, "it")[key][2:], abs=2e-4), key


LOOP = [
    [0, 0.0],
    [10, 0.11],
    [30, 0.15],
    [60, 0.22],
    [90, 0.30],
    [80, 0.14],
    [60, 0.08],
    [30, 0.01],
    [10, -0.05],
    [0, 0.0],
]


def written(folder: Any, *lines: str) -> str:
    """A file of a loop with other lines behind its third."""
    rows = [f"{x}, {1e3 * torque}" for x, torque in LOOP]
    path = folder / "loop.csv"
    path.write_text("\n".join(["angle (deg), torque (mN m)", "# test report 12", *rows[:1], *lines, *rows[1:], ""]))
    return str(path)


def test_a_loop_from_a_file_is_that_of_its_rows(tmp_path: Any) -> None:
    """By its name, and in a case; the case that is written back has the rows."""
    path = written(tmp_path)
    rows = np.array(LOOP) * [math.pi / 180.0, 1.0]
    assert np.array(harness(loop=path).loop) == pytest.approx(rows, rel=1e-12)
    assert harness(loop=tmp_path / "loop.csv").loop == harness(loop=path).loop
    part = {"kind": "resistance", "type": "harness", "joint": "hinge", "loop": path, "misfit": 0.1}
    wheel_ = {"kind": "rigid-body", "motion": "spin", "inertia": 0.8}
    hinge = {"kind": "joint-spring", "a": "ground", "b": "panel", "stiffness": 0.3}
    found = cases.load({"system": "structure", "parts": {"panel": wheel_, "hinge": hinge, "it": part}})
    again = cases.parse_yaml(cases.to_yaml(found), "case")["parts"]["it"]["loop"]
    assert parts.Resistance(joint="hinge", type="harness", loop=again).loop == pytest.approx(rows, rel=1e-12)


#: A loop in the files of several programs: each is the same rows, in rad and N m.
DIALECTS = {
    "semicolons, decimal commas, BOM": "\ufeffWinkel (°);Moment (Nm)\n-10,5;-0,5\n0;0\n10;0,5\n",
    "three columns": "cycle,torque / N m,angle / deg\n1,-0.5,-10.5\n1,0,0\n1,0.5,10\n",
    "units row, tabs": "angle\ttorque\tnote\ndeg\tmN·m\t\n-10.5\t-500\tstart\n0\t0\t\n10\t500\tend\n",
    "trailing commas": "angle (deg),torque (N-m),\n-10.5,-0.5,\n0,0,\n10,0.5,\n",
    "pounds": "angle [deg]; torque [in-lbf]\n-10.5; -4.425372896\n0; 0\n10; 4.425372896\n",
    "radians": "angle (radians) torque (N·m)\n-0.1832595715 -0.5\n0 0\n0.1745329252 0.5\n".replace(" t", "\tt"),
}


@pytest.mark.parametrize("ending", ["loop.csv", "LOOP.CSV", "loop.tsv", "loop.Txt"])
@pytest.mark.parametrize("dialect", DIALECTS)
def test_files_as_people_have_them(tmp_path: Any, dialect: str, ending: str) -> None:
    path = tmp_path / ending
    path.write_bytes(DIALECTS[dialect].encode("cp1252" if "three" in dialect else "utf-8"))
    found = np.array([[parse(a, "rad"), parse(b, "N m")] for a, b in table_file.rows_of(str(path))])
    wanted = [[math.radians(-10.5), -0.5], [0.0, 0.0], [math.radians(10.0), 0.5]]
    np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("angle (deg),up (N m),down (N m)\n0,1,2\n1,2,3\n", "has 2 columns of a torque or a force: 'up .N m.', 'down"),
        ("angle (deg),torque\n0,1\n1,2\n", "has no column in a unit of a torque or a force; it must name two"),
        ("angle (%),torque (N m)\n0,1\n1,2\n", "has no column in a unit of an angle or a travel"),
        ("angle (deg),torque (N m)\n0,1\nend\n", "line 3 is no row of the table: 'end'"),
        ("angle (deg);torque (N m)\n1,5;1.5\n2.5;2\n", "one column has one decimal sign"),
    ],
)
def test_tables_that_may_mean_something_else_are_refused(tmp_path: Any, text: str, sentence: str) -> None:
    (tmp_path / "loop.csv").write_text(text)
    with pytest.raises(PydanticCustomError, match=sentence):
        table_file.rows_of(str(tmp_path / "loop.csv"))


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("5, 0.1, 3", r"Resistance\.loop .*line 4 is no row of the table: '5, 0.1, 3'"),
        ("5, much", r"cannot read '.*loop\.csv': line 4 holds 'much' in column 'torque', where a number must be"),
        ("5, nan", r"line 4 of '.*loop\.csv' has 'nan'; it must be a number"),
    ],
)
def test_a_file_that_cannot_be_read_is_named_with_its_line(tmp_path: Any, line: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        harness(loop=written(tmp_path, line))


def test_files_that_are_no_table_are_refused(tmp_path: Any) -> None:
    (tmp_path / "plain.csv").write_text("0.5, 1.5\n1.5, 2.5\n")
    with pytest.raises(
        InputError,
        match="no names, has no column in a unit of an angle or a",
    ):
        harness(loop=str(tmp_path / "plain.csv"))
    with pytest.raises(InputError, match=r"none\.csv"):
        harness(torque=str(tmp_path / "none.csv"))
    with pytest.raises(
        InputError, match=r"'loop\.xlsx' is neither a list of rows nor a file that ends with \.csv or \.tsv or \.txt"
    ):
        harness(loop="loop.xlsx")
    (tmp_path / "units.csv").write_text("angle [deg], torque [kg]\n0, 1\n1, 2\n0, 1\n")
    with pytest.raises(InputError, match="kg"):
        harness(loop=str(tmp_path / "units.csv"))
