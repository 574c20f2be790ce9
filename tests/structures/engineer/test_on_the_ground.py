"""Structures as an engineer writes them: a mast, a linkage, a dish, flexible panels, two wings with their studies."""

from __future__ import annotations

import math
import pathlib
import shutil

import numpy as np
import pytest
import scipy.linalg

import evolvent as ev
from evolvent import parts
from structures.engineer import panel

HERE = pathlib.Path(__file__).parent


@pytest.mark.slow
def test_a_motor_drives_a_telescopic_mast() -> None:
    """Rate at which the motor's torque, less the losses of its gear, carries the weight and the friction."""
    run = ev.run(HERE / "mast.yaml")
    assert run.attrs["status"] == "success"
    lifted = sum(n * mass for n, mass in enumerate((2.0, 1.5, 1.0, 0.7), 1)) * 9.81 + 4 * 3.0
    constant, ratio, resistance = 0.03, 2000.0, 5.0
    current = lifted / (0.6 * ratio * constant)
    by_hand = (28.0 - resistance * current) / (constant * ratio)
    assert by_hand == pytest.approx(0.1936, abs=1e-4)
    travel = run["travel 1"].travel.values
    steady = np.gradient(travel, run.time.values)[(run.time.values > 2.0) & (run.time.values < 4.5)]
    assert steady == pytest.approx(by_hand, rel=1e-3)
    assert set(run.ev.latches.latch.values) == {f"travel {n}" for n in range(1, 5)}
    assert run["stage 4"].position.values[-1, 2] - 0.08 == pytest.approx(3.2, abs=1e-3)


def rocker(turn: float, crank: float, coupler: float, arm: float, ground: float) -> tuple[float, np.ndarray]:
    """Angle of the rocker of a four-bar loop at a turn of its crank, and where coupler and rocker meet."""
    A, D = crank * np.array([math.cos(turn), math.sin(turn)]), np.array([ground, 0.0])
    apart = float(np.linalg.norm(D - A))
    corner = math.acos((coupler**2 + apart**2 - arm**2) / (2 * coupler * apart))
    way = math.atan2(D[1] - A[1], D[0] - A[0]) + corner
    B = A + coupler * np.array([math.cos(way), math.sin(way)])
    return math.atan2(B[1], B[0] - ground), B


@pytest.mark.slow
def test_a_crank_rocks_an_arm_through_backlash() -> None:
    """Swing of the rocker by the geometry of the loop; the arm follows within the play and what the stops give way."""
    lengths = (0.1, 0.3, 0.25, 0.3)
    start, first = math.radians(60.0), (0.0, 0.0, 0.0)
    _, B = rocker(start, *lengths)
    A, D = lengths[0] * np.array([math.cos(start), math.sin(start)]), np.array([lengths[3], 0.0])
    system = ev.System(title="Four-bar linkage with backlash")
    for name, p, q, mass in (("crank", np.zeros(2), A, 0.3), ("coupler", A, B, 0.8), ("rocker", D, B, 0.7)):
        way, half = q - p, np.linalg.norm(q - p) / 2
        turned = {"axis": (0, 0, 1), "angle": math.atan2(way[1], way[0])}
        ends = {"p": (-half, 0, 0), "q": (half, 0, 0)}
        bar = parts.RigidBody(
            mass=mass,
            shape={"box": (2 * half, 0.02, 0.02)},
            position=(*(p + q) / 2, 0.0),
            orientation=turned,
            points=ends,
        )
        system.add(bar, name)
    pins = {
        "O": (first, "crank.p"),
        "A": ("crank.q", "coupler.p"),
        "B": ("coupler.q", "rocker.q"),
        "D": ((*D, 0.0), "rocker.p"),
    }
    for name, (a, b) in pins.items():
        system.add(parts.Joint(a=a, b=b, type="revolute"), name)
    system.add(parts.RigidBody(mass=1.0, shape={"box": (0.4, 0.03, 0.03)}, position=(*D, 0.05)), "arm")
    system.add(parts.Joint(a=(*D, 0.05), b="arm", type="revolute"), "shaft")
    play = {"low": "-0.5 deg", "high": "0.5 deg", "stop": 2000, "damping": 0.01}
    system.add(parts.JointSpring(a="rocker", b="arm", start=0, **play), "backlash")
    system.add(parts.JointSpring(joint="O", stiffness=0), "crank angle")
    turning = {"ramp": {"steps": [(0, 0.5, 2 * math.pi)]}}
    system.add(parts.Motor(joint="crank angle", motion=turning, position_gain=200, velocity_gain=20), "motor")
    run = system.simulate(until="2 s", every="2 ms")
    angles = np.unwrap([rocker(turn, *lengths)[0] for turn in np.linspace(0, 2 * math.pi, 721)])
    by_hand = math.degrees(np.ptp(angles))
    assert by_hand == pytest.approx(51.4561, abs=1e-4)
    assert np.degrees(np.ptp(run["D"].angle.values)) == pytest.approx(by_hand, abs=1e-3)
    beyond = np.abs(run["backlash"].angle.values) - math.radians(0.5)
    touching = np.abs(run["backlash"].torque.values) > 0.1
    assert np.any(touching)
    assert beyond.max() < np.abs(run["backlash"].torque.values).max() / 2000 + 1e-4


@pytest.mark.slow
def test_springs_hold_the_cords_of_a_dish_taut_in_the_sun() -> None:
    """Moment of the cords about a hinge and torque of its spring; the expansion of a rib by its temperature."""
    run = ev.run(HERE / "dish.yaml")
    assert run.attrs["status"] == "success"
    places = run["rib 1"].position.values[-1]
    heights = places[:, 2] - places[0, 2]
    inward = 2 * math.sin(math.pi / 12)  # of the two cords of a rib, along its radius
    pulls = run["cord 1"].force.values[-1] * heights[-1] + run["tie 1"].force.values[-1] * heights[3]
    assert inward * pulls == pytest.approx(float(run["spring 1"].torque.values[-1]), rel=1e-5)
    assert inward * pulls == pytest.approx(1.68743, abs=2e-5)
    assert run["sun 1"].temperature.values[-1] == pytest.approx(80.0)
    cords = [float(run[f"cord {n}"].force.values[-1]) for n in range(1, 13)]
    assert cords == pytest.approx([cords[0]] * 12, rel=1e-6)


@pytest.fixture(name="deck", scope="module")
def _deck(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    path = tmp_path_factory.mktemp("deck") / "panel.pch"
    panel.write(path)
    return path


def test_a_panel_of_ones_own_elements_has_its_frequencies(deck: pathlib.Path) -> None:
    """The free panel of the deck, by the package and by the matrices that are in it."""
    system = ev.System(title="Free panel")
    system.add(
        parts.ReducedBody(file=str(deck), expected_mass=panel.MASS_PER_AREA * panel.LENGTH * panel.WIDTH), "panel"
    )
    found = system.modes(count=10).frequency_hz[6:]
    assert found == pytest.approx(panel.frequencies(*panel.reduced(), 4), rel=1e-6)
    assert found[:2] == pytest.approx([54.327, 89.554], abs=1e-3)
    assert found[:2] == pytest.approx(panel.frequencies(*panel.whole(), 2), rel=5e-3)


def array(deck: pathlib.Path, count: int, *, folded: bool) -> ev.System:
    """Flexible panels in a zigzag or in a row, with springs, cables that synchronize them, and a damper at the root."""
    system = ev.System(title="Flexible panels with cables")
    system.add(parts.RigidBody(mass=300, inertia=(60, 90, 90), shape={"box": (1, 1, 1)}, position=(-0.5, 0, 0)), "bus")
    x = z = turn = 0.0
    before = ("bus", (0.5, -0.225, 0))
    for n in range(1, count + 1):
        start = math.radians(-90 if n == 1 else 180 if n % 2 == 0 else -180) * folded
        turn += start
        body = parts.ReducedBody(
            file=str(deck), position=(x, 0, z), orientation={"axis": (0, 1, 0), "angle": turn}, damping_ratio=0.01
        )
        system.add(body, f"panel {n}")
        system.add(parts.Joint(a=before, b=f"panel {n}.grid1", type="revolute", axis=(0, 1, 0)), f"pin {n}")
        rest, damping = math.radians(10 if n % 2 else -10), 8.0 if n == 1 else 0.0
        latch = {"latch": 0, "latch_stiffness": 5000, "latch_damping": 50}
        spring = parts.JointSpring(
            joint=f"pin {n}", start=start, stiffness=0.3, rest=rest, friction=0.02, damping=damping, **latch
        )
        system.add(spring, f"hinge {n}")
        before = f"panel {n}.grid3"
        x, z = x + panel.LENGTH * math.cos(turn), z - panel.LENGTH * math.sin(turn)
    ratios = [2 if n == 1 else -1 if n % 2 == 0 else 1 for n in range(1, count + 1)]
    cables = {"joints": [f"hinge {n}" for n in range(1, count + 1)], "ratios": ratios}
    system.add(parts.Joint(type="synchronization", stiffness=30, damping=2, **cables), "cables")
    return system


def hand_made(count: int) -> np.ndarray:
    """Frequencies of `array` in a row, latched, Hz, without rigid motions, by matrices of inertial displacements."""
    K, M = panel.reduced()
    size = len(K)
    whole_k, whole_m = (scipy.linalg.block_diag(np.zeros((6, 6)), *[A] * count) for A in (K, M))
    whole_m[:6, :6] = np.diag([300.0, 300.0, 300.0, 60.0, 90.0, 90.0])
    held, turns = [], []
    for n in range(count):
        own, frame = np.zeros((6, len(whole_k))), np.zeros((6, len(whole_k)))
        own[:, 6 + n * size : 12 + n * size] = np.eye(6)
        if n == 0:
            frame[:, :6] = np.eye(6)
            frame[:3, 3:6] = np.cross(np.eye(3), [0.5, -0.225, 0.0]).T
        else:
            at = 6 + (n - 1) * size + 12  # the third grid of the panel before
            frame[:, at : at + 6] = np.eye(6)
        held.append((own - frame)[[0, 1, 2, 3, 5]])
        turns.append((own - frame)[4])
    ratios = np.array([2.0, *[-1.0 if n % 2 else 1.0 for n in range(1, count)]])
    loops = np.diff(ratios[:, None] * np.array(turns), axis=0)
    hinge = 0.3 + 5000.0 + 0.02 / 1e-4  # spring, latch, friction before it slips
    whole_k += hinge * np.transpose(turns) @ turns + 30.0 * loops.T @ loops
    Z = scipy.linalg.null_space(np.vstack(held))
    squares = scipy.linalg.eigh(Z.T @ whole_k @ Z, Z.T @ whole_m @ Z, eigvals_only=True)
    return np.asarray(np.sqrt(squares[6:]) / (2.0 * math.pi))


@pytest.mark.parametrize("count", [2, 6])
def test_flexible_panels_in_a_row_vibrate(deck: pathlib.Path, count: int) -> None:
    """Free motions and hinges 1e11 times softer than the panels, whose springs are not at rest in the latches."""
    found = array(deck, count, folded=False).modes(count=12).frequency_hz
    assert found[:6] == pytest.approx(np.zeros(6), abs=1e-6)
    assert found[6:] == pytest.approx(hand_made(count)[:6], rel=1e-6)


@pytest.mark.slow
def test_six_flexible_panels_unfold(deck: pathlib.Path) -> None:
    """What the springs store at the start goes into friction, dampers and latches, which all lock."""
    run = array(deck, 6, folded=True).simulate(until="8.5 s", every="0.1 s")
    turns = np.radians([100.0, *[190.0] * 5])
    stored = float(np.sum(0.5 * 0.3 * turns**2))
    assert stored == pytest.approx(8.7, abs=0.01)
    assert run.energy_elastic.values[0] == pytest.approx(stored, rel=1e-6)
    assert run.energy_defect.values[-1] == pytest.approx(0.0, abs=5e-3 * stored)
    assert set(run.ev.latches.latch.values) == {f"hinge {n}" for n in range(1, 7)}


@pytest.mark.slow
def test_two_wings_through_an_engineers_day(tmp_path: pathlib.Path) -> None:
    """Run, margins against the torques at the start by hand, dispersion and study of one file."""
    for name in ("wings.yaml", "draws.study.yaml", "stiffness.study.yaml"):
        shutil.copyfile(HERE / name, tmp_path / name)
    run = ev.run(tmp_path / "wings.yaml")
    assert run.attrs["status"] == "success"
    assert set(run.ev.latches.latch.values) == {f"{end} hinge {n}" for end in ("root", "mid") for n in (1, 2)}
    H = run.angular_momentum.values
    assert np.abs(H).max() < 1e-9
    margins = ev.load(tmp_path / "wings.yaml").margin(motion=False)
    for hinge, stiffness, expected in (("root hinge 1", 0.06, -0.4435), ("mid hinge 1", 0.02, 0.0341)):
        table = margins[hinge]
        kind, station = table.governing()
        assert table.margin(kind)[station] == pytest.approx(expected, abs=1e-4)
        # a spring counts with 0.8 of its torque, least at the latch, 30 deg before its rest
        assert abs(table.available[station]) == pytest.approx(0.8 * stiffness * math.radians(30.0), rel=1e-6)
    drawn = ev.disperse(tmp_path / "draws.study.yaml", output=tmp_path / "draws")
    assert drawn["root hinge 1.latch_time.last"].moments["mean"] == pytest.approx(1.9026, abs=5e-3)
    swept = ev.sweep(tmp_path / "stiffness.study.yaml", output=tmp_path / "stiffness")
    times = swept["root_hinge_1_latch_time_last"]
    soft, stiff = (times.sel({times.dims[0]: value}).values for value in (0.05, 0.07))
    assert np.all(stiff < soft)
