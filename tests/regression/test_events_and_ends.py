"""Events that fall on the end of a step, drives past the end of a thread, loads that copies do not share."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import law, parts
from evolvent.analysis.system import System
from evolvent.solvers import solve
from evolvent_base.errors import InputError


@law
def at_time(t, y, p):
    return t - p[0]


def oscillator(*added) -> System:
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.5, 0.0, 0.0)), "p")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="p", stiffness=4.0, length=1.0))
    for part in added:
        system.add(part)
    return system


@pytest.mark.parametrize("stops", [False, True])
def test_samples_of_a_step_that_ends_on_an_event(stops: bool) -> None:
    """An event at the very time of a break: all samples before it hold the motion 1 + cos(2 t) / 2."""
    law = parts.Event(law=at_time, parameters=(2.0,), stops=stops)
    nothing = parts.Load(at="p", force=(0.0, 0.0, 0.0), start=2.0, until=5.0)
    samples = np.linspace(0.0, 2.0 if stops else 4.0, 161)
    found = solve(oscillator(law, nothing).assemble(), samples=samples, method="dopri5", rtol=1e-9, atol=1e-11)
    assert found.success
    assert found.t == pytest.approx(samples, abs=1e-12)
    assert found.y[:, 0] == pytest.approx(1.0 + 0.5 * np.cos(2.0 * found.t), abs=1e-7)


def hub(drive, segments: str = "inextensible", gravity=(0.0, 0.0, 0.0), **thread) -> System:
    system = System(gravity=gravity)
    system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "hub")
    system.add(parts.Reel(body="hub", centre=(0.05, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    given = {"length": 1.0, "line_density": 0.000735, "tip_mass": 0.0005, "nodes": 8} | thread
    system.add(parts.Thread(reel="reel", segments=segments, **given), "blade")
    return system


@pytest.mark.parametrize("segments", ["springs", "inextensible"])
@pytest.mark.parametrize(("drive", "time"), [((3.5, 90.0), 10.0 / 3.5), ((-3.5, 10.0), 10.0 / 3.5)])
def test_a_drive_past_the_end_of_its_thread_fails(segments: str, drive: tuple[float, float], time: float) -> None:
    """Paying out more than there is, or reeling in what is wound already, ends the run at that moment."""
    law = parts.ConstantDrive(rate=drive[0], angle=drive[1])
    method = "rk4" if segments == "springs" else "dopri5"
    found = solve(hub(law, segments, wound_mass="carried").assemble(), samples=[0.0, 4.0], method=method)
    assert found.status == "failed"
    assert "outruns its thread" in found.message
    assert float(found.message.split("t = ")[1].split(" s")[0]) == pytest.approx(time, abs=1e-3)


@pytest.mark.parametrize("angle", [30.0, 12.5])
def test_automatic_fixed_step_of_fixed_segments_is_stable(angle: float) -> None:
    """Just after a release the boundary link is short and stiff; the step follows it (rk4, heun)."""
    drive = parts.ConstantDrive(rate=3.5, angle=angle)
    found = solve(hub(drive).assemble(), samples=[0.0, 15.0], method="rk4")
    assert found.success, found.message
    assert found.statistics["energy_defect"] < 2e-4  # beside the energy moved


def test_a_jump_of_the_drive_keeps_the_order() -> None:
    """The step that begins at a jump of the rate sees the new rate from its first stage on: RK4 stays of order 4."""
    defects = []
    for step in (1e-3, 5e-4):
        drive = parts.RampDrive(rate=3.5, angle=20.0, steps=[(0.1, 0.0, 1.0)])
        system = hub(drive, "springs", stiffness=20.0, nodes=4)
        defects.append(
            solve(system.assemble(), samples=[0.0, 0.4], method="rk4", step=step).statistics["energy_defect"]
        )
    assert defects[1] < defects[0] / 12.0


def test_tension_is_gone_after_separation() -> None:
    """The last node of a thread that was let go pulls on nothing."""
    drive = parts.ConstantDrive(rate=3.5, angle=95.0)
    assembly = hub(drive, separates=True).assemble()
    found = solve(assembly, samples=[0.0, 3.0], method="dopri5")
    assert found.s[-1, 1] == 1
    from evolvent.solvers.common.observations import observe

    tension = observe(assembly.model, found.t, found.y, found.s).tension
    assert tension[0, -1] > 0.0
    assert tension[-1, -1] == 0.0


@pytest.mark.parametrize("rate", [3.5, 3.3, 2.9, 3.1, 1.7])
@pytest.mark.parametrize(
    ("method", "segments"), [("dopri5", "inextensible"), ("dopri5", "springs"), ("rk4", "springs")]
)
def test_separation_at_the_end_of_a_run(method: str, segments: str, rate: float) -> None:
    """A run until the thread is all out ends with the thread let go, on whichever side of that moment round-off is."""
    angle = 97.3
    drive = parts.ConstantDrive(rate=rate, angle=angle)
    end = (100.0 - angle) / rate
    found = solve(hub(drive, segments, separates=True).assemble(), samples=np.linspace(0.0, end, 4), method=method)
    assert found.success, found.message
    assert found.t[-1] == end
    assert found.s[-1, 1] == 1
    assert np.all(found.s[:-1, 1] == 0)
    assert found.event_times == pytest.approx([end], rel=1e-9)


def test_breaks_a_rounding_apart_are_one() -> None:
    """Dormand-Prince steps over the gap between a load's end and the next one's start that should be the same time."""
    loads = [parts.Load(at="p", force=(1.0, 0.0, 0.0), start=0.0, until=0.1 + 0.2)]
    loads += [parts.Load(at="p", force=(1.0, 0.0, 0.0), start=0.3)]
    found = solve(oscillator(*loads).assemble(), samples=[0.0, 1.0], method="dopri5")
    assert found.success, found.message
    assert found.y[-1, 0] == pytest.approx(1.25 + 0.25 * np.cos(2.0), abs=1e-7)


def test_copies_refuse_what_they_do_not_share() -> None:
    """Gravity along the spin axis is the same for all copies; across it, or a law, is not."""
    drive = parts.ConstantDrive(rate=3.5, angle=30.0)
    hub(drive, multiplicity=2, gravity=(0.0, 0.0, -1.0)).assemble()
    with pytest.raises(InputError, match="'blade' stands for 2 copies, but 'gravity'"):
        hub(drive, multiplicity=2, gravity=(0.5, 0.0, 0.0)).assemble()
    system = hub(drive, multiplicity=2)
    system.add(
        parts.Radiation(along="blade", pressure=1e-6, width=0.1, direction=(1.0, 0.0, 1.0), specular=1.0), "light"
    )
    with pytest.raises(InputError, match="'light' is not the same"):
        system.assemble()


@law
def passes(t, y, p):
    return np.sin(2.0 * np.pi * p[0] * t - 1.0)


@pytest.mark.parametrize(("method", "options"), [("rk4", {"step": 4e-4}), ("dopri5", {})])
def test_any_number_of_events_is_logged(method: str, options: dict[str, float]) -> None:
    """A run does not depend on how often the log of its loop was full."""
    from evolvent.solvers.time.explicit import run as explicit_run

    assembly = oscillator(parts.Event(law=passes, parameters=(1000.0,))).assemble()
    assembly.model = assembly.model._replace(breaks=4e-4 * np.arange(1, 10_000))  # no step passes over two events
    samples = np.linspace(0.0, 4.0, 9)
    emptied, empty, make = [], explicit_run.ExplicitRun.make_room, explicit_run._workspace

    def larger(*given):  # type: ignore[no-untyped-def]
        work = make(*given)
        return work._replace(log_t=np.zeros(8 * work.log_t.size), log_k=np.zeros(8 * work.log_k.size, dtype=np.int64))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explicit_run.ExplicitRun, "make_room", lambda run: emptied.append(run) or empty(run))
        found = solve(assembly, samples=samples, method=method, **options)
        count = len(emptied)
        patch.setattr(explicit_run, "_workspace", larger)
        once = solve(assembly, samples=samples, method=method, **options)
    assert found.success
    assert count >= 3
    assert len(emptied) == count
    assert found.event_times == pytest.approx((np.arange(4000) + 1.0 / (2.0 * np.pi)) / 1000.0, abs=1e-9)
    assert np.array_equal(found.y, once.y)
    assert np.array_equal(found.event_times, once.event_times)


def test_an_event_that_fires_again_and_again_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thousand events within a share of the run that is too small for them (here a half) are no events."""
    from evolvent.solvers.time.explicit import run as explicit_run

    monkeypatch.setattr(explicit_run, "CHATTER", 0.5)
    system = oscillator(parts.Event(law=passes, parameters=(1000.0,)))
    found = solve(system.assemble(), samples=[0.0, 4.0], method="rk4", step=4e-4)
    assert found.status == "failed"
    assert "fires repeatedly" in found.message
    assert found.event_times[-1] < 3.0
