"""The stepper as a module of Basilisk: its hub moves as in a run, and as Basilisk's own hinged bodies do."""

from __future__ import annotations

import importlib.util
import pathlib
import runpy
import sys
from typing import Any

import numpy as np
import pytest

import evolvent
import evolvent_cosim
from evolvent import Stepper, System, parts
from evolvent_base.errors import InputError

FILE = pathlib.Path(evolvent_cosim.__file__).with_name("basilisk.py")
HAS = importlib.util.find_spec("Basilisk") is not None
needs_basilisk = pytest.mark.skipif(not HAS, reason="bsk has its own environment: start.py test --release")


def slewed(case: str, without: str) -> System:
    """A case without its own load."""
    found = System()
    for name, part in evolvent.load(case).parts.items():
        if name != without:
            found.add(part, name)
    return found


def commanded(module: Any, torque: list[float], step: float, until: float, ends: float) -> np.ndarray:
    """Rate (rad/s) of a module's hub under a torque that another module's message holds until a time, at every step."""
    from Basilisk.architecture import messaging
    from Basilisk.utilities import SimulationBaseClass, macros

    scenario = SimulationBaseClass.SimBaseClass()
    scenario.CreateNewProcess("all").addTask(scenario.CreateNewTask("own", macros.sec2nano(step)))
    scenario.AddModelToTask("own", module)
    log = module.scStateOutMsg.recorder()
    scenario.AddModelToTask("own", log)
    payload = messaging.CmdTorqueBodyMsgPayload()
    payload.torqueRequestBody = torque
    message = messaging.CmdTorqueBodyMsg().write(payload)
    module.cmdTorqueInMsg.subscribeTo(message)
    scenario.InitializeSimulation()
    scenario.ConfigureStopTime(macros.sec2nano(ends))
    scenario.ExecuteSimulation()
    payload.torqueRequestBody = [0.0, 0.0, 0.0]
    message.write(payload)
    scenario.ConfigureStopTime(macros.sec2nano(until))
    scenario.ExecuteSimulation()
    return np.array(log.omega_BN_B)


@needs_basilisk
@pytest.mark.parametrize(
    ("case", "load", "hub", "torque", "until", "within"),
    [
        ("boom-slew", "slew", "hub", 0.1, 9.0, 1e-6),
        ("solar-array", "", "satellite", 0.02, 7.0, 1e-6),
        ("solar-array", "", "satellite", 0.02, 9.0, 4e-5),  # the error of the time of a latch at 7.4 s, by the step
    ],
)
def test_the_hub_moves_as_in_a_run(
    case: str, load: str, hub: str, torque: float, until: float, within: float
) -> None:  # fmt: skip
    """A flexible boom, and panels that spring open, to the first latch and through it."""
    from evolvent_cosim.basilisk import SpacecraftModule

    step, ends = 0.01, 2.0
    system, settings = slewed(case, load), {"method": "generalized-alpha", "step": 5e-4, "spectral_radius": 0.9}
    module = SpacecraftModule(Stepper(system, inputs=hub, until=until + 1.0, **settings))  # type: ignore[arg-type]
    found = commanded(module, [0.0, 0.0, torque], step, until, ends)
    system.add(parts.Load(at=hub, torque=(0.0, 0.0, torque), until=ends), "command")
    alone = system.simulate(until=until, every=step, fine=False, **settings)  # type: ignore[call-overload]
    rate = alone[hub].rate.values[:, 2]
    np.testing.assert_allclose(found[:, 2], rate, rtol=0.0, atol=within * np.abs(rate).max())
    np.testing.assert_allclose(module.times, np.arange(0.0, until + 0.5 * step, step), atol=1e-9)


@needs_basilisk
def test_a_blade_reels_out_under_a_command() -> None:
    """The sail of the thread paper on a hub that a message slows down."""
    from evolvent_cosim.basilisk import SpacecraftModule

    overrides = {"solver.method": "generalized-alpha"}
    module = SpacecraftModule(Stepper.of_case("heliogyro", overrides, inputs="body", until=20.0))
    found = commanded(module, [0.0, 0.0, -1e-3], 0.1, 5.0, 2.0)
    alone, rates = Stepper.of_case("heliogyro", overrides, inputs="body", until=20.0), []
    alone.set_wrench("body", torque=(0.0, 0.0, -1e-3))
    for k in range(50):
        if k == 20:
            alone.set_wrench("body")
        alone.step(0.1)
        rates.append(alone.body("body").rate[2])
    np.testing.assert_allclose(found[1:, 2], rates, rtol=1e-6)
    assert found[-1, 2] < found[0, 2]


@needs_basilisk
def test_the_page_of_the_guide_runs() -> None:
    page = (pathlib.Path(__file__).parents[4] / "docs" / "guide" / "basilisk.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec(page.partition("```python\n")[2].partition("```")[0], names)
    turned = np.degrees(4.0 * np.arctan(names["module"].scStateOutMsg.read().sigma_BN[2]))
    assert turned == pytest.approx(30.0, abs=0.05)
    assert len(page.splitlines()) <= 40


@needs_basilisk
def test_a_turning_body_has_the_attitude_and_forces_of_its_messages() -> None:
    """A turn about a skew axis at a given rate, past half a revolution, and a force in body axes."""
    from Basilisk.architecture import messaging
    from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, macros

    from evolvent_cosim.basilisk import SpacecraftModule

    system = System()
    axis, rate, mass = np.array([2.0, 1.0, 2.0]) / 3.0, 1.0, 2.0
    system.add(parts.RigidBody(mass=mass, inertia=0.3, angular_velocity=tuple(rate * axis)), "body")
    module = SpacecraftModule(Stepper(system, inputs="body", until=10.0, step=0.005))
    payload = messaging.CmdForceBodyMsgPayload()
    payload.forceRequestBody = [0.4, 0.0, 0.0]
    message = messaging.CmdForceBodyMsg().write(payload)
    module.cmdForceBodyInMsg.subscribeTo(message)
    scenario = SimulationBaseClass.SimBaseClass()
    scenario.CreateNewProcess("all").addTask(scenario.CreateNewTask("own", macros.sec2nano(0.005)))
    scenario.AddModelToTask("own", module)
    log = module.scStateOutMsg.recorder()
    scenario.AddModelToTask("own", log)
    scenario.InitializeSimulation()
    scenario.ConfigureStopTime(macros.sec2nano(5.0))
    scenario.ExecuteSimulation()
    times = np.array(module.times)
    for t, sigma in zip(times[::100], np.array(log.sigma_BN)[::100], strict=True):
        turned = RigidBodyKinematics.PRV2C(rate * t * axis)
        np.testing.assert_allclose(RigidBodyKinematics.MRP2C(sigma), turned, atol=1e-4)
        assert np.linalg.norm(sigma) <= 1.0 + 1e-12
    forces = np.array([RigidBodyKinematics.PRV2C(rate * t * axis).T @ [0.4, 0.0, 0.0] for t in times])
    expected = np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(times)[:, None], axis=0) / mass
    np.testing.assert_allclose(np.array(log.v_BN_N)[-1], expected, atol=2e-3)  # held over steps of 5 ms


@needs_basilisk
def test_hinged_panels_move_as_those_of_basilisk() -> None:
    path = pathlib.Path(__file__).parents[4] / "benchmarks" / "basilisk_panels.py"
    names = runpy.run_path(str(path))
    theirs, alone = names["theirs"](0.1)[0], names["reference"](0.1)
    ours = names["ours"](0.1, tolerance=1e-8)[0]
    peak = np.abs(theirs[:, 0]).max()
    assert np.abs(alone - theirs)[:, 0].max() < 2e-6 * peak
    assert np.abs(alone - theirs)[:, 1:].max() < 2e-6
    assert np.abs(ours - theirs)[:, 1:].max() < 2e-5


@needs_basilisk
def test_what_a_module_cannot_be_of_is_refused() -> None:
    from evolvent_cosim.basilisk import SpacecraftModule

    stepper = Stepper(slewed("boom-slew", "slew"), inputs="hub", until=1.0)
    with pytest.raises(InputError, match="hub is 'hup', which is not among the stepper's inputs; did you mean 'hub'"):
        SpacecraftModule(stepper, "hup")
    with pytest.raises(InputError, match="did you mean"):
        SpacecraftModule(stepper, results=["hub.rat.z"])


def test_without_basilisk_one_sentence_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "Basilisk", None)
    with pytest.raises(InputError) as error:
        runpy.run_path(str(FILE))
    assert str(error.value) == "the module of Basilisk needs the package `bsk`: pip install 'evolvent-cosim[basilisk]'"
