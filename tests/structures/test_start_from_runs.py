"""A structure that starts from the end of a run of it: what follows is what the run would have been."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import InputError, cases, parts

RUN: dict[str, Any] = {"method": "energy-momentum", "step": 0.005, "every": 0.05}
STEEL = {"young_modulus": "2 GPa", "poisson_ratio": 0.3, "density": "2000 kg/m^3"}


def latching(**given: Any) -> ev.System:
    """An arm that turns by more than a turn, latches and lets a box go, whose mass hangs on a spring."""
    s = ev.System(gravity=(0, 0, -1.0), **given)
    s.add(parts.RigidBody(mass=1, inertia=(0.1, 0.1, 0.1), position=(0.5, 0, 0)), "arm")
    s.add(parts.Joint(a=(0, 0, 0), b=("arm", (-0.5, 0, 0)), type="revolute", axis=(0, 0, 1)), "hinge")
    s.add(parts.JointSpring(joint="hinge", damping=0.02, latch=7.0, latch_stiffness=50, latch_damping=0.1), "latch")
    s.add(parts.Load(at="arm", torque=(0, 0, 4.0)), "motor")
    s.add(parts.RigidBody(mass=0.2, inertia=(0.01, 0.01, 0.01), position=(1.5, 0, 0)), "box")
    s.add(parts.Spring(a="arm", b="box", stiffness=3.0), "cord")
    s.add(parts.Joint(a=("arm", (0.5, 0, 0)), b=("box", (-0.5, 0, 0)), type="clamp", released_by="latch"), "hold")
    return s


def flexible(**given: Any) -> ev.System:
    s = ev.System(gravity=(0, 0, -9.81), **given)
    section = ev.Rectangle(thickness="5 mm", width="2 cm")
    s.add(parts.Rod(length=0.5, section=section, material=STEEL, elements=3), "rod")
    s.add(parts.Joint(a=(0, 0, 0), b="rod.root", type="clamp"), "clamp")
    s.add(parts.RigidBody(mass=0.01, inertia=(1e-5, 1e-5, 1e-5), position=(0.5, 0, 0)), "tip mass")
    s.add(parts.Joint(a="rod.tip", b="tip mass", type="clamp"), "weld")
    return s


@pytest.mark.parametrize(
    ("build", "cut", "until", "part"),
    [(latching, 1.0, 3.0, "box"), (latching, 2.5, 3.0, "box"), (flexible, 0.1, 0.2, "tip mass")],
)
def test_two_runs_are_one(build: Callable[..., ev.System], cut: float, until: float, part: str, tmp_path: Path) -> None:
    file = tmp_path / "first.nc"
    whole = build().simulate(until=until, **RUN)
    first = build().simulate(until=cut, **RUN)
    ev.save(first, file)
    second = build(start=file).simulate(until=until - cut, **RUN)
    for name in ("position", "velocity", "attitude"):
        # velocities at samples of the method miss the constraints by their error of second order
        close = 5e-4 if name == "velocity" else 1e-12
        assert second[part][name].values[0] == pytest.approx(first[part][name].values[-1], abs=close)
        assert second[part][name].values[-1] == pytest.approx(whole[part][name].values[-1], abs=2e-4)
    if build is latching:
        assert whole["latch"].angle.values[-1] > 2 * np.pi  # turns are counted on
        assert second["latch"].angle.values[0] == pytest.approx(first["latch"].angle.values[-1], abs=1e-12)
        assert second["latch"].latched.values[0] == first["latch"].latched.values[-1] == float(cut > 2.0)


def test_other_values_and_methods(tmp_path: Path) -> None:
    """Values may differ, and parts that only act; an explicit method starts from an implicit run."""
    file = tmp_path / "first.nc"
    ev.save(latching().simulate(until=0.5, **RUN), file)
    after = latching(start=str(file)).with_values({"latch.damping": 0.3})
    after.remove("cord")
    run = after.simulate(until=0.1, method="dopri5")
    whole = latching().simulate(until=0.5, **RUN)
    assert run["arm"].rate.values[0] == pytest.approx(whole["arm"].rate.values[-1], abs=1e-4)
    content = cases.parse_yaml(after.to_yaml(until="0.1 s"), "case")
    assert content["start"] == str(file)
    assert cases.files_of(content)[str(file)]
    assert ev.load(content).simulate(method="dopri5")["arm"].rate.values[-1] == pytest.approx(
        run["arm"].rate.values[-1], abs=1e-9
    )


def test_stages_of_a_study(tmp_path: Path) -> None:
    content = cases.parse_yaml(flexible().to_yaml(until="0.05 s", step="0.005 s"), "case")
    study = {
        "case": content, "over": {"parts.tip mass.mass": [0.01, 0.02]}, "keep": ["second.tip mass.position.z.first"],
        "stages": [{"name": "first"}, {"name": "second", "set": {"gravity": [0, 0, 0]}}],
    }  # fmt: skip
    found = ev.sweep(study, output=tmp_path / "study")["second_tip_mass_position_z_first"].values
    assert found[1] < found[0] < -1e-3


def test_what_is_refused(tmp_path: Path) -> None:
    file = str(tmp_path / "first.nc")
    ev.save(latching().simulate(until=0.02, **RUN), file)
    with pytest.raises(InputError, match=r"first.nc', a run without 'rod'"):
        flexible(start=file).assemble()
    other = latching(start=file)
    other.add(parts.Point(mass=1.0), "dot")
    with pytest.raises(InputError, match="a run without 'dot'"):
        other.assemble()
    less = latching(start=file)
    for name in ("hold", "cord", "box"):
        less.remove(name)
    with pytest.raises(InputError, match="a run with 'box', which does not move or is not there here"):
        less.assemble()
    rubs = latching(start=file).with_values({"latch.friction": 0.1})
    with pytest.raises(InputError, match="'latch' is one of the coordinates with a history"):
        rubs.assemble()
    ev.save(rubs_run := latching().with_values({"latch.friction": 0.1}).simulate(until=0.02, **RUN), file + "2.nc")
    assert "end_state" not in rubs_run.attrs
    with pytest.raises(InputError, match="which keeps no state of its end"):
        latching(start=file + "2.nc").assemble()
    with pytest.raises(InputError, match="store"):
        latching(start=file, sections={"store": {"time": "1 s"}}).assemble()
    with pytest.raises(InputError, match=r"nowhere.nc"):
        latching(start="nowhere.nc").assemble()
    with pytest.raises(InputError, match="start is a DataTree; it must be the file of a run"):
        latching(start=rubs_run).assemble()
