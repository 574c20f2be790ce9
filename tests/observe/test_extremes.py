"""Extremes over all steps: compared with closed forms at coarse samples, and in all results that use them."""

import math
import pathlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import System, parts
from evolvent.results import limits, variables
from evolvent.results.kept import reduced
from evolvent.results.observe.variables import Variable

METHODS = ["dopri5", "rk4", "generalized-alpha", "energy-momentum"]


class Bounce(NamedTuple):
    """A system, a force of it, the peak of this force by a closed form, and the period of the motion, s."""

    system: System
    name: str
    peak: float
    period: float


def _latched(latch: float, rate: float, stiffness: float) -> dict[str, float]:
    return {"start": latch + 0.1 * rate, "latch": latch, "latch_stiffness": stiffness}


def hinge() -> Bounce:
    """A wheel with rate w meets an elastic latch after 0.1 s: the torque is at most w sqrt(J k)."""
    J, w, k = 0.4, 2.0, 160.0
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=J, axis=(0.0, 0.0, 1.0), rate=-w), "wheel")
    spring = parts.JointSpring(a="ground", b="wheel", axis=(0.0, 0.0, 1.0), **_latched(0.5, w, k))
    system.add(spring, "part")
    return Bounce(system, "part.torque", w * math.sqrt(J * k), 2.0 * math.pi * math.sqrt(J / k))


def slide() -> Bounce:
    """The same for a travel: the force is at most v sqrt(m k)."""
    m, v, k = 2.0, 0.5, 800.0
    system = System()
    system.add(parts.Point(mass=m, position=(0.0, 1.0, 0.0), velocity=(-v, 0.0, 0.0)), "mass")
    axis = {"axis": (1.0, 0.0, 0.0), "motion": "translation"}
    system.add(parts.JointSpring(a="ground", b="mass", **axis, **_latched(-0.05, v, k)), "part")
    return Bounce(system, "part.force", v * math.sqrt(m * k), 2.0 * math.pi * math.sqrt(m / k))


def _loaded(slack: bool) -> Bounce:
    m, k, F = 0.5, 200.0, 3.0
    system = System()
    system.add(parts.Point(mass=m, position=(1.0, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=k, slack=slack), "part")
    system.add(parts.Load(at="mass", force=(F, 0.0, 0.0)), "load")
    return Bounce(system, "part.force", 2.0 * F, 2.0 * math.pi * math.sqrt(m / k))


def spring() -> Bounce:
    """A mass on a spring, onto which a force F acts at once: the tension is at most 2 F."""
    return _loaded(slack=False)


def cord() -> Bounce:
    """The same with a cord, which only pulls."""
    return _loaded(slack=True)


def thread() -> Bounce:
    """The same for the tip mass of a thread on a reel."""
    m, k, F = 0.5, 200.0, 3.0
    system = System()
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="ground", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    system.add(parts.Thread(reel="reel", length=1.0, line_density=1e-9, nodes=1, tip_mass=m, stiffness=k), "part")
    system.add(parts.Load(at="part.tip", force=(F, 0.0, 0.0)), "load")
    return Bounce(system, "part.hub_tension", 2.0 * F, 2.0 * math.pi * math.sqrt(m / k))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("make", [hinge, slide, spring, cord, thread])
def test_a_peak_between_samples_is_that_of_the_closed_form(make: Callable[[], Bounce], method: str) -> None:
    """Samples that are nearly a period apart miss the peak; results do not depend on the sampling."""
    of = make()
    settings: dict[str, Any] = {"method": method, "until": 1.8 * of.period, "fine": False}
    settings |= {} if method == "dopri5" else {"step": of.period / 400.0}
    keep = [f"{of.name}.abs_max", f"{of.name}.max", f"{of.name}.min"]
    coarse, fine = (of.system.simulate(every=share * of.period, keep=keep, **settings) for share in (0.9, 0.01))
    samples = of.system.simulate(every=0.9 * of.period, **settings)[of.name.partition(".")[0]][
        of.name.partition(".")[2]
    ]
    assert np.abs(samples.values).max() < 0.99 * of.peak
    assert coarse[keep[0]] == pytest.approx(of.peak, rel=1e-3)
    for name in keep:
        assert coarse[name] == pytest.approx(fine[name], rel=1e-3, abs=1e-3 * of.peak)


def driven(inertia: float = 1.0, **keys: Any) -> System:
    """A wheel that a motor turns."""
    system = System(settings={"until": 1.5, "every": 0.3, "fine": False})
    system.add(parts.RigidBody(motion="spin", inertia=inertia, axis=(0.0, 0.0, 1.0)), "wheel")
    system.add(parts.JointSpring(a="ground", b="wheel", axis=(0.0, 0.0, 1.0)), "hinge")
    system.add(parts.Motor(joint="hinge", **keys), "drive")
    return system


RAMP = [[0.0, 0.0], [1.0, 10.0], [1.0, 0.0], [2.0, 0.0]]
JUMPS = [{"torque": RAMP}, {"torque": [[0.0, 0.0], [2.0, 20.0]], "until": 1.0}]


@pytest.mark.parametrize("keys", JUMPS, ids=["table", "until"])
@pytest.mark.parametrize("method", METHODS[:3])
def test_a_torque_that_ends_in_a_jump_reaches_its_largest_value_before(method: str, keys: dict[str, Any]) -> None:
    settings: dict[str, Any] = {"method": method} | ({} if method == "dopri5" else {"step": 0.07})
    found = driven(**keys).simulate(keep=["drive.torque.max", "drive.torque.min"], **settings)
    assert found["drive.torque.max"] == pytest.approx(10.0, rel=1e-9)
    assert found["drive.torque.min"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("method", ["dopri5", "rk4"])
def test_a_torque_that_an_event_ends_reaches_its_largest_value_before(method: str) -> None:
    """From rest t^3/6 of a torque t: at 0.05 rad it is 0.3^(1/3)."""
    system = driven(torque=[[0.0, 0.0], [2.0, 2.0]], released_by="end")
    system.add(parts.Event(law="turn - 0.05", variables={"turn": "wheel.angle"}), "end")
    settings: dict[str, Any] = {"method": method} | ({} if method == "dopri5" else {"step": 0.07})
    found = system.simulate(keep=["drive.torque.max"], **settings)
    assert found["drive.torque.max"] == pytest.approx(0.3 ** (1.0 / 3.0), rel=1e-6)


@pytest.mark.parametrize("method", ["dopri5", "rk4"])
def test_a_torque_before_a_jump_is_that_of_each_copy(method: str) -> None:
    system = driven(inertia=1e6, voltage=RAMP, torque_constant=1.0, resistance=1.0)  # stands still
    system.settings |= {"method": method, "until": 1.2} | ({} if method == "dopri5" else {"step": 0.07})
    constants = np.linspace(0.5, 1.0, 8)
    found = evolvent.simulate_many(
        system, {"drive.torque_constant": constants.tolist()}, ["drive.torque.max"], workers=1
    )
    for value, own in zip(constants.tolist(), found["drive_torque_max"].values.tolist(), strict=True):
        one = system.with_values({"drive.torque_constant": value})
        alone = one.simulate(keep=["drive.torque.max"])["drive.torque.max"]
        assert np.float64(own).tobytes() == np.float64(alone).tobytes()
        assert own == pytest.approx(10.0 * value, rel=1e-4)


@pytest.mark.parametrize("method", METHODS)
def test_a_peak_at_the_start_is_that_of_a_latch_that_has_locked_before(method: str) -> None:
    """A damped latch of a turning body: c w at the start, from where it falls."""
    system = System(settings={"until": 1.0, "every": 0.3, "fine": False, "method": method})
    system.settings |= {} if method == "dopri5" else {"step": 0.02}
    turning = {"motion": "spin", "inertia": 1.0, "axis": (0.0, 0.0, 1.0), "rate": 1.0}
    system.add(parts.RigidBody(**turning), "wheel")
    latch = {"start": 0.0, "latch": 0.0, "latch_stiffness": 1.0, "latch_damping": 2.0}
    system.add(parts.JointSpring(a="ground", b="wheel", axis=(0.0, 0.0, 1.0), **latch), "part")
    run = system.simulate()["part"]
    assert run.latch_torque.values[0] == pytest.approx(-2.0) or run.latch_torque.values[0] == pytest.approx(2.0)
    assert run.latch_torque_peak.values[-1] == pytest.approx(2.0, rel=1e-9)
    kept = system.simulate(keep=["part.latch_torque_peak.last", "part.latch_torque.abs_max"])
    assert list(kept.values()) == pytest.approx([2.0, 2.0], rel=1e-9)


def test_limits_studies_and_files_use_extremes_over_all_steps(tmp_path: pathlib.Path) -> None:
    """Limits of a run, kept values, a run that is read from a file, and variants."""
    of = hinge()
    settings: dict[str, Any] = {"until": 1.8 * of.period, "every": 0.9 * of.period, "fine": False}
    limited = of.system.copy()
    limited.sections["limits"] = [f"{of.name} <= {0.9 * of.peak:.6g} N m"]
    run = limited.simulate(**settings)
    (limit,) = limits.of_run(run)
    assert not limit.is_met
    name = f"{of.name}.max"
    kept = of.system.simulate(keep=[name, "part.angle.min", "part.torque.last"], **settings)
    assert limit.value == kept[name]
    assert "extremes" not in kept.variables[name].attrs
    evolvent.save(run, tmp_path / "run.nc")
    read = evolvent.open(tmp_path / "run.nc")
    for one in (run, read):
        found = reduced(variables.get(one, of.name).variable, "max", name, one.time.values)
        assert float(found) == kept[name]
    many = evolvent.simulate_many(of.system, [{}, {}], [name], workers=1, **settings)
    assert many["part_torque_max"].values.tolist() == [kept[name]] * 2


def test_extremes_along_a_part_are_those_of_its_entries() -> None:
    """The extremes of one cord of a net are those of its own entry."""
    found = Variable(("time", "cord"), np.zeros((3, 2)), "N", "tension", np.array([[-1.0, -2.0], [1.0, 5.0]]))
    assert np.array_equal(found.isel({"cord": 1}).extremes, [-2.0, 5.0])  # type: ignore[arg-type]
    assert found.isel({"time": [0]}).extremes is found.extremes
    tree = xr.DataTree(children={"net": xr.DataTree(xr.Dataset({"tension": (found.dims, found.values)}))})
    assert found.extremes is not None
    tree["net"].tension.attrs |= variables.with_extremes(tree["net"].tension, found.extremes).attrs
    own = variables.extremes_of(variables.get(tree, "net[1].tension"))
    assert own is not None
    assert own.tolist() == [-2.0, 5.0]


def test_extremes_are_those_of_their_variable_alone() -> None:
    """Not of some of its samples, nor of what is computed from it; of a run without fine samples they still are."""
    torque = driven(torque=RAMP).simulate(method="dopri5")["drive"].torque
    extremes = variables.extremes_of(torque)
    assert extremes is not None
    assert extremes.tolist() == pytest.approx([0.0, 10.0])
    with xr.set_options(keep_attrs=True):
        others = [torque.isel(time=slice(0, 2)), 2.0 * torque, -torque, torque + 1.0, torque.cumsum("time")]
    assert [variables.extremes_of(one) for one in others] == [None] * 5
    kept = reduced(others[0].variable, "max", "drive.torque", others[0].time.values)
    assert float(kept) == pytest.approx(3.0)
    for same in (torque[::-1], torque.astype("float32"), torque.copy()):
        assert variables.extremes_of(same) is not None


def test_extremes_stay_where_fine_samples_are_left_out() -> None:
    system = driven(torque=[[0.0, 0.0], [0.7, 0.0], [0.75, 50.0], [0.8, 0.0], [2.0, 0.0]])
    system.settings |= {"fine": True, "method": "dopri5", "every": 0.1}
    run = system.simulate()
    regular = evolvent.results.regular(run)
    found = [variables.extremes_of(one["drive"].torque) for one in (run, regular)]
    assert run.sizes["time"] > regular.sizes["time"] == 16
    assert found[1] is not None
    assert found[0] is not None
    assert found[1].tolist() == found[0].tolist()
    angle = variables.extremes_of(regular["hinge"].angle)
    shown = variables.extremes_of(evolvent.results.display.shown(regular["hinge"].angle))
    assert angle is not None
    assert shown is not None
    assert shown.tolist() == pytest.approx(np.degrees(angle).tolist())
