"""Parts on a torsion rig: the sets of the package, other sets, wrong records, and the engine beside closed forms."""

from __future__ import annotations

import math
import pathlib
import zipfile

import numpy as np
import pytest

import evolvent
from book import Book
from evolvent import parts
from evolvent_base.errors import InputError
from evolvent_papers import laboratory
from evolvent_papers.laboratory import torsion
from evolvent_papers.laboratory.book import Verdict

STORED = pathlib.Path(torsion.__file__).with_name("data") / "torsion.zip"


def unpacked(folder: pathlib.Path, name: str = "rigid") -> pathlib.Path:
    with zipfile.ZipFile(STORED) as files:
        files.extract(f"{name}.csv", folder)
    return folder / f"{name}.csv"


@pytest.fixture(scope="module")
def verdict() -> Verdict:
    return laboratory.found("torsion").validate()


@pytest.mark.slow
def test_the_sets_of_the_package(verdict: Verdict, book: Book) -> None:
    """`docs/laboratory/torsion.md` states these numbers."""
    found = {one.what: one for one in verdict.comparisons}
    periods = found["rigid, frame: periods of 4 orientations, each by the others, rms of the difference"]
    assert periods.predicted == pytest.approx(1.28, abs=0.01)
    assert (periods.meets, periods.covered) == (True, True)
    book(
        "Inertia stand and identification", "Torsion rig, frame `rigid`: periods of orientations, each by the others",
        reference="measured periods", source="BicycleParameters (Moore 2012), BSD-2", error=periods.predicted / 100.0,
        allowed=0.015, unit="",
    )  # fmt: skip
    assert verdict.text == "1 of 1 goals are met; 7 of 8 differences are within their bands of 95 %"
    assert "rigid, frame: B1 is wrong: its moment is 3.4644 kg m², 19.0 % off the 2.806" in verdict.notes[1]
    fork = next(one for one in verdict.notes if one.startswith("rigid, fork: the moments contradict"))
    assert "S2 or S4 is wrong, which the records cannot tell" in fork
    assert "S1 285.2 %" in fork
    assert "without S1 the others still contradict one another by 4.4 standard uncertainties" in fork
    assert "what is missing is an orientation near 179 deg" in fork


@pytest.mark.slow
def test_another_folder_a_file_and_a_planted_record(tmp_path: pathlib.Path) -> None:
    """The same commands take other sets: with B1 as the others have it nothing is wrong, then B3 is, 10 % too long."""
    path = unpacked(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("TtB1,1,3.42292311327", "TtB1,1,3.0813"), encoding="utf-8")
    settings = torsion.Settings()
    whole, _ = torsion.evaluated(str(tmp_path), settings)
    assert next(one for one in whole if one.letter == "B").found.wrong == ()
    path.write_text(
        text.replace("TtB1,1,3.42292311327", "TtB1,1,3.0813").replace("3.07592110787", "3.38"), encoding="utf-8"
    )
    planted, _ = torsion.evaluated(str(path), settings)
    assert next(one for one in planted if one.letter == "B").found.wrong == ("B3",)


def test_wheels_by_pendulum_and_by_torsion(tmp_path: pathlib.Path) -> None:
    """A wheel whose torsion about the axle is measured too: closed form of a ring."""
    k = 4.65 * (3.0 * 0.015**2 + 0.8355**2) / 12.0 * (2.0 * math.pi / 0.957) ** 2
    mass, radius, length, g = 1.5, 0.3, 0.28, 9.81
    moment = mass * radius**2
    swing = 2.0 * math.pi * math.sqrt((moment + mass * length**2) / (mass * g * length))
    rows = {
        "mP": 4.65,
        "dP": 0.03,
        "lP": 0.8355,
        "TtP1": 0.957,
        "mF": mass,
        "lF": length,
        "g": g,
        "TcF1": swing,
        "TtF1": 2.0 * math.pi * math.sqrt(0.5 * moment / k),
        "TtF2": 2.0 * math.pi * math.sqrt(moment / k),
    }
    content = "".join(f"{key},1,{value!r},{1e-4 * value!r}\n" for key, value in rows.items())
    (tmp_path / "ring.csv").write_text(f"quantity,reading,value,uncertainty\n{content}", encoding="utf-8")
    (one,) = laboratory.found("torsion").validate(data=str(tmp_path)).comparisons
    assert one.what == "ring, front wheel: moment about the axle by the pendulum; measured: by torsion"
    assert (one.predicted, one.measured) == pytest.approx((moment, moment), rel=1e-9)
    assert one.covered


def test_what_is_no_set_is_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="is not a folder with CSV files"):
        torsion.bicycles(str(tmp_path / "none"))
    with pytest.raises(InputError, match="has no CSV file with the columns quantity,reading,value,uncertainty"):
        torsion.bicycles(str(tmp_path))
    head = "quantity,reading,value,uncertainty\n"
    (tmp_path / "a.csv").write_text(head, encoding="utf-8")
    with pytest.raises(InputError, match="value,uncertainty and rows below them"):
        torsion.bicycles(str(tmp_path))
    (tmp_path / "a.csv").write_text(f"{head}mP,1,4.65,0.01\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"a.csv: dP is missing; mass, diameter, length and period of the rod are mP"):
        torsion.bicycles(str(tmp_path))
    (tmp_path / "a.csv").write_text(f"{head}mP,1,heavy,0.01\n", encoding="utf-8")
    with pytest.raises(InputError, match="heavy"):
        torsion.bicycles(str(tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0.0, 40.0, 233.0])
def test_the_engine_has_the_periods_of_the_closed_forms(degrees: float) -> None:
    """n^T I n over the stiffness of the bar, also where the body has products of inertia with its normal."""
    inertia = np.array([[2.15, 0.1, -0.63], [0.1, 4.2, 0.05], [-0.63, 0.05, 2.24]])
    a = math.radians(degrees)
    line = np.array([math.cos(a), 0.0, -math.sin(a)])
    closed = 2.0 * math.pi * math.sqrt(line @ inertia @ line / 11.67)
    assert torsion.engine_period(inertia, a, 11.67) == pytest.approx(closed, rel=1e-9)
    length = math.hypot(0.43, 0.29)
    closed = 2.0 * math.pi * math.sqrt((4.2 + 22.9 * length**2) / (22.9 * 9.81 * length))
    assert torsion.engine_swing(22.9, 4.2, (0.43, -0.29), 9.81) == pytest.approx(closed, rel=1e-9)


@pytest.mark.slow
def test_a_run_of_the_engine_has_the_damped_period() -> None:
    """Zero crossings of a damped torsion over time: 2 pi / (omega sqrt(1 - zeta^2))."""
    moment, stiffness, zeta = 2.7, 11.67, 0.05
    system = evolvent.System()
    system.add(parts.RigidBody(mass=1.0, inertia=moment), "part")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="part", type="revolute", axis=(0.0, 0.0, 1.0)), "bar")
    damping = 2.0 * zeta * math.sqrt(stiffness * moment)
    system.add(parts.JointSpring(joint="bar", stiffness=stiffness, damping=damping, rest=0.1), "spring")
    run = system.simulate(until=16.0, every=0.01, method="dopri5", tolerance=1e-10)
    angle = np.asarray(run["spring/angle"], dtype=float) - 0.1
    time = np.asarray(run["time"], dtype=float)
    down = np.flatnonzero((angle[:-1] > 0.0) & (angle[1:] <= 0.0))
    local = [np.polynomial.Polynomial.fit(time[k - 2 : k + 4], angle[k - 2 : k + 4], 5).roots() for k in down]
    zeros = [float(r[np.argmin(np.abs(r - time[k]))].real) for r, k in zip(local, down, strict=True)]
    closed = 2.0 * math.pi * math.sqrt(moment / stiffness) / math.sqrt(1.0 - zeta**2)
    assert np.mean(np.diff(zeros)) == pytest.approx(closed, rel=1e-6)
