"""Storage in the stowed position: relaxation, creep, recovery, temperature, margins, cases."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
import scipy
import yaml

import evolvent
from book import Book
from evolvent import System, cases, elements, parts
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.relaxation.family import set_of
from evolvent.solvers.static.storage import reduced_time, store
from evolvent_base.errors import InputError
from viscoelastic_rods import bent_rod

#: Three-element law of the closed forms: E_inf = 0.4, E_1 = 0.6, tau = 1 s.
LAW = {"prony": [(0.6, 1.0)]}
CHAPTER = "Relaxation and storage"
YEAR = 365.25 * 86_400.0
SHIFT = {"arrhenius": {"energy": "80 kJ/mol", "reference": "20 degC"}}
ZERO = ["hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]


def panel(law: Any, *, until: float = 1.0, **keys: Any) -> System:
    """A panel on a hinge with a spring, held stowed by a clamp until a time."""
    system = System(**keys)
    system.add(parts.RigidBody(mass=2.0, inertia=(0.3, 0.3, 0.5)), "panel")
    system.add(parts.Joint(a="ground", b="panel", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "hinge")
    spring = parts.JointSpring(
        joint="hinge", stiffness=0.2, rest=2.5, damping=0.01, friction=0.01, latch=1.5, latch_stiffness=1000.0,
        latch_damping=1.0, viscoelastic=law,
    )  # fmt: skip
    system.add(spring, "spring")
    system.add(parts.Joint(a="ground", b="panel", type="clamp", position=(0, 0, 0), until=until), "hold-down")
    return system


@pytest.mark.parametrize("time", [0.3, 1.0, 10.0])
def test_a_held_rod_relaxes_and_keeps_curvature(time: float, book: Book) -> None:
    found = store(bent_rod(LAW, curvature=0.5).assemble(), time)
    model = found.assembly.model
    left = 0.4 + 0.6 * math.exp(-time)
    kept = set_of(model, model.rod_elements[1], 6)
    book(
        CHAPTER, f"Rod bent and held for {time:g} tau: curvature kept", reference="k0 E_1 (1 - exp(-t/tau))",
        source="closed form, E_inf 0.4, E_1 0.6", error=abs(kept[5] / (0.5 * (1.0 - left)) - 1.0), allowed=1e-9,
    )  # fmt: skip
    if time == 10.0:
        assert left == pytest.approx(0.4000272, abs=5e-8)
        assert kept[5] / 0.5 == pytest.approx(0.5999728, abs=5e-8)


def test_what_is_kept_after_a_release_decays_at_its_rate(book: Book) -> None:
    """Held for 10 tau and released at once: 0.5999728 of the angle remains, and decays at E_inf/(E_0 tau)."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.3, 0.3, 0.5)), "panel")
    system.add(parts.Joint(a="ground", b="panel", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "hinge")
    system.add(parts.JointSpring(joint="hinge", stiffness=2.0, rest=0.5, viscoelastic=LAW), "spring")
    system.add(parts.Joint(a="ground", b="panel", type="clamp", position=(0, 0, 0)), "hold-down")
    held = store(system.assemble(), 10.0).assembly
    held.model.constraints["until"] = np.where(
        np.array([name == "hold-down" for name in held.row_parts]), -1.0, held.model.constraints["until"]
    )
    free = store(held, 3.0, tolerance=1e-7, most_moved=1.0)
    iq = int(free.assembly.model.bodies["iq"][1])
    q = free.solution.y[:, iq : iq + 7]
    angle = 0.5 - 2.0 * np.arctan2(q[:, 6], q[:, 3])
    assert angle[0] / 0.5 == pytest.approx(0.5999728, abs=5e-8)
    book(
        CHAPTER, "Hinge held for 10 relaxation times and released: angle kept", reference="0.5999728 exp(-0.4 t/tau)",
        source="closed form, rate E_inf/(E_0 tau)", allowed=1e-6,
        error=np.max(np.abs(angle / (0.5 * 0.6 * (1.0 - math.exp(-10.0)) * np.exp(-0.4 * free.times)) - 1.0)),
    )  # fmt: skip
    assert math.log(2.0) / 0.4 == pytest.approx(1.7328680, abs=5e-8)


def test_creep_under_a_constant_load(book: Book) -> None:
    system = System(gravity=(10.0, 0.0, 0.0))
    system.add(parts.Point(mass=1.0, position=(1.0, 0, 0)), "mass")
    system.add(parts.Spring(a=(0.0, 0, 0), b="mass", stiffness=100.0, length=1.0, viscoelastic=LAW), "spring")
    found = store(system.assemble(), 20.0)
    strain = found.solution.y[:, 0] - 1.0
    exact = 0.1 * (1.0 - 0.6 * np.exp(-0.4 * found.times)) / 0.4
    book(
        CHAPTER, "Spring under a constant load for 20 relaxation times: creep", source="closed form",
        reference="(1 - 0.6 exp(-0.4 t/tau))/0.4", error=np.max(np.abs(strain / exact - 1.0)), allowed=1e-6,
    )  # fmt: skip


def test_a_shift_is_a_change_of_time(book: Book) -> None:
    factor = 30.0 / 3652.5
    temperature = 1.0 / (1.0 / 293.15 + math.log(factor) * 8.314462618 / 80e3)
    law = {"prony": [(0.3, "10 days"), (0.2, "2 years")], "shift": SHIFT}
    cold = store(panel(law).assemble(), 10.0 * YEAR, 293.15).assembly
    warm = store(panel(law).assemble(), 10.0 * YEAR * factor, temperature).assembly
    kept = [one.model.branch_strains["w0"] for one in (cold, warm)]
    book(
        CHAPTER, "Hinge stored for 30 days in heat in place of ten years at 20 degC", reference="a_T = 30/3652.5",
        source="time-temperature superposition", allowed=1e-9,
        error=np.max(np.abs(kept[1] - kept[0])) / np.max(np.abs(kept[0])),
    )  # fmt: skip


def test_a_history_of_temperatures_counts_by_its_integral(book: Book) -> None:
    law = panel({"prony": [(0.3, "1 day")], "shift": SHIFT}).assemble().relaxations[0][1]
    rows = np.array([[0.0, 280.0], [3e5, 320.0], [4e5, 320.0], [9e5, 290.0]])

    def pace(t: float) -> float:
        return 1.0 / law.factor(float(np.interp(t, rows[:, 0], rows[:, 1])), "T")

    exact = sum(
        scipy.integrate.quad(pace, a, b, epsabs=0.0, epsrel=1e-12)[0] for a, b in ((1e5, 3e5), (3e5, 4e5), (4e5, 8e5))
    )
    book(
        CHAPTER, "Reduced time of a history of temperatures (Arrhenius)", reference="integral of dt/a_T",
        source="SciPy, quad", error=abs(reduced_time(law, rows, 1e5, 8e5) / exact - 1.0), allowed=1e-9,
    )  # fmt: skip
    stored = store(panel({"prony": [(0.3, "1 day")], "shift": SHIFT}).assemble(), 9e5, rows.tolist()).assembly
    whole = reduced_time(law, rows, 0.0, 9e5)
    assert float(stored.model.branch_strains["w0"][0]) == pytest.approx(-2.5 * math.exp(-whole / 86_400.0), rel=1e-9)


def test_every_analysis_begins_after_storage() -> None:
    store_ = {"time": "10 years"}
    law = {"prony": [(0.3, "10 days"), (0.2, "1 h")]}
    fresh, aged = (
        panel(law, sections={"margin": {"zero": ZERO}} | extra, settings={"until": 6.0})
        for extra in ({}, {"store": store_})
    )
    before, after = fresh.margin(motion=False), aged.margin(motion=False)
    # at the start of the travel the springs have half of their torque, and one of the whole stiffness beyond it
    torque = [one["spring"].values[0] for one in (before, after)]
    assert torque[1][0] / torque[0][0] == pytest.approx(0.5, rel=1e-9)
    assert torque[0][-1] - torque[1][-1] == pytest.approx(torque[0][0] - torque[1][0], rel=1e-9)
    assert after.least < before.least
    runs = [one.simulate(every=0.5, fine=False, method="energy-momentum") for one in (fresh, aged)]
    assert runs[1]["spring"].torque.values[0] / runs[0]["spring"].torque.values[0] == pytest.approx(0.5, rel=1e-9)
    assert float(runs[1]["spring"].latch_time.values[-1]) > float(runs[0]["spring"].latch_time.values[-1])
    shown = aged.storage()
    assert "50 %" in str(shown)
    assert "10 years" in str(shown)
    assert [one.part for one in shown.forces] == ["spring"]
    assert len(shown.answer().figures) == 2


def test_a_case_says_how_long_and_how_warm() -> None:
    content = {
        "system": "structure",
        "parts": {
            "mass": {"kind": "point", "mass": "1 kg", "position": "[1.1, 0, 0 m]"},
            "spring": {"kind": "spring", "a": [0, 0, 0], "b": "mass", "stiffness": "100 N/m", "length": "1 m",
                       "viscoelastic": {"prony": [[0.6, "1 h"]], "shift": SHIFT}},
            "hold": {"kind": "joint", "a": [1.1, 0, 0], "b": "mass", "type": "spherical"},
        },
        "store": {"time": "10 years", "temperature": [["0 s", "0 degC"], ["10 years", "40 degC"]]},
        "simulate": {"until": "1 s"},
    }  # fmt: skip
    content["parts"]["mass"]["position"] = [1.1, 0, 0]
    case = cases.load(content)
    system = cases.system("structure").system(case)
    assert system.sections["store"]["time"] == "315576000.0 s"
    found = system.assemble()
    assert float(found.model.branch_strains["w0"][0]) == pytest.approx(0.0, abs=1e-12)
    again = cases.load(yaml.safe_load(system.to_yaml()))
    assert again.store == case.store


@pytest.mark.parametrize(
    ("sections", "law", "sentence"),
    [
        ({"store": {"time": "1 h"}}, None, r"`store` has no effect: no part is viscoelastic"),
        ({"store": {"time": "-1 h"}}, LAW, r"store|time"),
        ({"store": {"time": "1 h", "temperature": "-300 degC"}}, LAW, r"temperature"),
        (
            {"store": {"time": "1 h", "temperature": 310.0}},
            {"prony": [(0.6, 1.0)], "shift": {"table": {"rows": [(280.0, 1.0), (300.0, 0.0)]}}},
            r"store\.temperature is 310 K; the shift of the Prony series of 'spring' holds from 280 to 300 K",
        ),
    ],
)
def test_storage_that_cannot_be_is_refused(sections: Any, law: Any, sentence: str) -> None:
    with pytest.raises((InputError, ValueError), match=sentence):
        panel(law, sections=sections).assemble()


def test_storage_without_a_hold_is_refused() -> None:
    system = panel(LAW)
    system.remove("hold-down")
    assembly = system.assemble()
    with pytest.raises(InputError, match=r"nothing holds 'spring' in its stowed position.*hold it by"):
        store(assembly, 10.0)


def test_a_folded_tape_relaxes_and_opens_with_its_balance(book: Book) -> None:
    """All stresses of a held fold relax alike; the release balances what is stored, moved and dissipated."""
    system = System()
    material = elements.Material(young_modulus=40e9, poisson_ratio=0.3, density=1700.0, viscoelastic=LAW)
    section = elements.TapeSection(radius=0.015, angle=math.pi / 3.0, thickness=3e-4)
    tape = parts.Rod(
        length=0.08, elements=12, section=section, material=material, stiffness_damping=1e-3,
        folds=[{"at": 0.04, "angle": math.pi / 2.0}],
    )  # fmt: skip
    system.add(tape, "tape")
    system.add(parts.Joint(a="ground", b="tape.root", type="clamp"), "root")
    system.add(parts.Joint(a="ground", b="tape.tip", type="clamp", until=0.002), "tip")
    found = store(system.assemble(), 10.0)
    elastic = found.solution.kept.balance["elastic"]
    book(
        CHAPTER, "Fold of a tape spring held for 10 relaxation times: energy", reference="0.4 + 0.6 exp(-2 t/tau)",
        source="closed form", error=abs(elastic[-1] / elastic[0] / (0.4 + 0.6 * math.exp(-20.0)) - 1.0), allowed=1e-9,
    )  # fmt: skip
    assert found.times.size < 40  # nothing creeps
    system.sections["store"] = {"time": "10 s"}
    tips = []
    for step in (2e-4, 1e-4, 5e-5):
        run = system.simulate(
            until=0.006, every=0.006, fine=False, method="energy-momentum", step=step, spectral_radius=1.0
        )
        assert abs(float(run.energy_defect.values[-1])) < 1e-9
        tips.append(run["tape"].position.values[-1, -1, 1])
    assert 2.5 < (tips[0] - tips[1]) / (tips[1] - tips[2]) < 6.0  # second order


@pytest.mark.parametrize(
    "table",
    [
        [(10.0, 2.0), (20.0, 0.0), (22.0, -1.5), (40.0, -1.6)],
        [(-20.0, 6.0), (50.0, 5.0), (60.0, 0.0), (70.0, -30.0)],
    ],
)
def test_reduced_time_by_tables_whose_slopes_jump(table: Any) -> None:
    """Over each straight line of temperatures and of decades the integral is in closed form."""
    rows = [(273.15 + T, decades) for T, decades in table]
    law = Viscoelastic(prony=[(0.6, 1.0)], shift={"table": {"rows": rows}})
    history = np.array([[0.0, rows[0][0]], [7.0, rows[-1][0]]])
    slope, exact = (rows[-1][0] - rows[0][0]) / 7.0, 0.0
    for (a, m), (b, n) in itertools.pairwise(rows):
        exact += (b - a) / slope * (10.0**-n - 10.0**-m) / ((m - n) * math.log(10.0))
    assert reduced_time(law, history, 0.0, 7.0) == pytest.approx(exact, rel=1e-9)


def test_what_nothing_holds_is_refused_for_points_and_rods() -> None:
    point, rod = System(), System()
    point.add(parts.Point(mass=1.0, position=(2.0, 0, 0)), "mass")
    point.add(parts.Spring(a=(0.0, 0, 0), b="mass", stiffness=1.0, length=1.0, viscoelastic=LAW), "spring")
    material = elements.Material(young_modulus=1e9, density=1000.0, viscoelastic=LAW)
    folded = parts.Rod(
        length=1.0, elements=8, section=elements.Circle(radius=0.005), material=material,
        folds=[{"at": 0.5, "angle": 1.0, "radius": 0.1}],
    )  # fmt: skip
    rod.add(folded, "rod")
    rod.add(parts.Joint(a="ground", b="rod.root", type="clamp"), "root")
    for system, name in ((point, "spring"), (rod, "rod")):
        with pytest.raises(
            InputError, match=f"nothing holds '{name}' in its stowed position: in equilibrium its stress"
        ):
            store(system.assemble(), 10.0)


@pytest.mark.parametrize(
    ("law", "section", "sentence"),
    [
        (LAW, {"temperature": "80 degC"}, r"store\.temperature has no effect: no Prony series has a `shift`"),
        (None, {"temperature": 60}, r"store\.temperature is 60; .* of 100 K or above and up to 1000 K, such as"),
        (None, {"temperature": [["0 s", "20 degC"], ["2 s", "30 degC"]]}, r"run from 0 s to 2 s; .* store\.time, 10 s"),
        (None, {"temperature": [["1 s", "20 degC"], ["20 s", "30 degC"]]}, r"from 1 s to 20 s; they must begin at 0"),
    ],
)  # fmt: skip
def test_temperatures_of_storage_without_effect_or_unit_are_refused(law: Any, section: Any, sentence: str) -> None:
    law = {"prony": [(0.3, "1 day")], "shift": SHIFT} if law is None else law
    with pytest.raises(InputError, match=sentence):
        panel(law, sections={"store": {"time": "10 s"} | section}).assemble()


def test_margins_say_what_relaxes_during_the_deployment() -> None:
    for time, said in ((0.01, True), (1e4, False)):
        content: Any = {"sections": {"margin": {"zero": ZERO}}, "settings": {"until": 6.0}}
        margins = panel({"prony": [(0.3, time)]}, **content).margin()
        assert not margins.warnings  # the margin along the run counts it
        notes = str(margins.notes())
        assert "along the run viscoelastic parts act with what they have at each sample" in notes
        assert ("'spring' has a relaxation time of 0.01 s, and the run takes 6 s" in notes) is said


def test_a_run_states_the_storage_before_it() -> None:
    run = evolvent.run("hinge-stored", {"simulate.until": 0.1})
    rows = {one.label: one.value for one in cases.presenter(run).numbers(run)}
    assert rows["stored before"] == "10 years at 20 °C"
    run = evolvent.run("hanging-chain", {"simulate.until": 0.1})
    assert "stored before" not in {one.label for one in cases.presenter(run).numbers(run)}
