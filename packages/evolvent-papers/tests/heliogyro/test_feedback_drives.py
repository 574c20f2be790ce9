"""Drives that react: commands by a recurrence, decay by the poles of the closed loop, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import evolvent
from evolvent import InputError, System, cases, parts
from evolvent.analysis import feedback
from evolvent.analysis.stepper import Stepper
from evolvent_papers.heliogyro.structure import build

Array = np.ndarray
RADIUS, LENGTH, OFFSET, SPIN = 0.01, 1.0, 0.2, 2.0


def reacting(
    law: str = "(g - out)/(r*tau)",
    *,
    constants: Any = None,
    sensor: Any = None,
    limits: Any = None,
    nodes: int = 1,
    **drive: Any,
) -> System:
    """One link of fixed length on a body that turns at 2 rad/s; its lag is a pendulum's."""
    found = System()
    found.add(parts.RigidBody(motion="driven", rate=SPIN), "body")
    given = {"variables": {"out": "blade.deployed_length"}, "angle": 20.0, **drive}
    own = parts.FeedbackDrive(
        law=law, sensor=sensor or {"period": 0.1}, limits=limits or {},
        constants={"g": 0.5, "r": RADIUS, "tau": 2.0} if constants is None else constants, **given,
    )  # fmt: skip
    found.add(parts.Reel(body="body", radius=RADIUS, drive=own, centre=(OFFSET, 0, 0)), "reel")
    own_thread = {"line_density": 1e-3, "tip_mass": 1e-3, "nodes": nodes, "segments": "inextensible"}
    found.add(parts.Thread(reel="reel", length=LENGTH, **own_thread), "blade")
    return found


def angles(count: int, *, period: float, delay: float, smooth: float, tau: float = 2.0) -> tuple[Array, Array]:
    """Times of commands, and angles of the spool there, by the recurrence of the loop `reacting`; start at 20 rad."""
    late = math.floor(delay / period + 1e-9)
    offset = delay - late * period
    share = 1.0 if smooth == 0.0 else 1.0 - math.exp(-period / smooth)
    angle, rate, target, seen = 20.0, 0.0, 0.0, list[float]()
    times, found = [], []
    at = 0.0
    for k in range(count):
        sampled = k * period
        out = RADIUS * (angle + (sampled - at) * (rate + 0.5 * (target - rate) * (sampled - at) / period))
        seen.append(out if not seen else seen[-1] + share * (out - seen[-1]))
        now = sampled + offset
        angle += 0.5 * (rate + target) * (now - at)
        rate, at = target, now
        target = (0.5 - seen[max(0, k - late)]) / (RADIUS * tau)
        times.append(now)
        found.append(angle)
    return np.array(times), np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize(("delay", "smooth"), [(0.0, 0.0), (0.1, 0.0), (0.25, 0.3), (0.04, 0.2)])
def test_commands_follow_the_recurrence(delay: float, smooth: float) -> None:
    """The length that is out depends on the loop alone: sampled, filtered, late, and led linearly from rate to rate."""
    times, wanted = angles(30, period=0.1, delay=delay, smooth=smooth)
    stepper = Stepper(
        reacting(sensor={"period": 0.1, "delay": delay, "filter": smooth}), method="dopri5", until=3.5, tolerance=1e-9
    )
    for t, angle in zip(times[1:], wanted[1:], strict=True):
        stepper.step(float(t) - stepper.time)
        assert stepper.result("reel.angle") == pytest.approx(angle, rel=1e-9)


@pytest.mark.slow
def test_a_run_is_that_of_its_commands() -> None:
    """The run that follows has the same motion as the steps of the loop, and closes its energy balance."""
    system = reacting("(g - out)/(r*tau) - k*lag_rate", constants={"g": 0.5, "r": RADIUS, "tau": 2.0, "k": 5.0},
                      variables={"out": "blade.deployed_length", "lag": "blade.tip_lag"},
                      sensor={"period": 0.2, "delay": 0.13, "noise": {"lag": "0.2 deg"}, "seed": 3})  # fmt: skip
    run = system.simulate(until=6.0, every=0.5, tolerance=1e-9)
    stepper = Stepper(system, method="dopri5", until=6.0, tolerance=1e-9)
    for k in range(1, 13):
        stepper.step(0.5 * k - stepper.time)
        now = run.sel(time=0.5 * k, method="nearest")
        assert stepper.result("reel.angle") == pytest.approx(float(now["reel"].angle), rel=1e-9)
        assert stepper.result("blade.tip_lag") == pytest.approx(float(now["blade"].tip_lag), rel=1e-5, abs=1e-8)
    assert float(np.abs(run.energy_defect).max()) < 1e-6 * float(run.energy_kinetic.max())
    again = system.simulate(until=6.0, every=0.5, tolerance=1e-9)
    assert np.array_equal(again["reel"].measured_lag.values, run["reel"].measured_lag.values)


@pytest.mark.slow
def test_noise_has_its_size_and_its_seed() -> None:
    def measured(seed: int) -> Array:
        given = {"period": 0.05, "noise": {"lag": "0.5 deg"}, "seed": seed}
        system = reacting("0*lag", constants={}, variables={"lag": "blade.tip_lag"}, sensor=given)
        run = system.simulate(until=30.0, every=0.05, fine=False)
        found: Array = run["reel"].measured_lag.values - run["blade"].tip_lag.values
        return found

    one, other = measured(1), measured(2)
    for noise in (one, other):  # 600 samples: the deviation's own is 3 %, the mean's 4 %
        assert np.std(noise) == pytest.approx(math.radians(0.5), rel=0.15)
        assert abs(np.mean(noise)) < 0.2 * math.radians(0.5)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.2
    assert abs(np.corrcoef(one[1:], one[:-1])[0, 1]) < 0.2


@pytest.mark.slow
def test_limits_hold_and_the_spool_stops_where_its_thread_ends() -> None:
    run = reacting(
        "10 + 0*out", constants={}, limits={"rate": [-1.0, 6.0], "acceleration": 4.0}, sensor={"period": 0.25}
    ).simulate(until=20.0, every=0.05, tolerance=1e-8, fine=False)
    rate = run["reel"].rate.values
    assert rate.max() == pytest.approx(6.0, rel=1e-9)
    assert np.abs(np.diff(rate)).max() <= 4.0 * 0.05 * (1.0 + 1e-9)
    assert rate.min() > -1e-9
    assert rate[-1] == pytest.approx(0.0, abs=1e-3)
    assert float(run["blade"].deployed_length[-1]) == pytest.approx(LENGTH, rel=1e-4)
    assert float(run["blade"].deployed_length.max()) <= LENGTH


def drifted(gain: float, delay: float, until: float) -> tuple[float, float]:
    """Rate at which the lag of one link under the law gain lag_rate grows: by its pole, and by a run from 2 degrees."""
    law, sensor = "-k*lag_rate/r - (out - g)/(r*tau)", {"period": 0.1, "delay": delay, "filter": 0.1}
    constants = {"k": gain, "r": RADIUS, "g": 0.6, "tau": 20.0}
    variables = {"lag": "blade.tip_lag", "out": "blade.deployed_length"}

    def made(lag: float) -> System:
        found = reacting(law, constants=constants, variables=variables, sensor=sensor, angle=60.0)
        return found.with_values({"blade.direction": (math.cos(lag), -math.sin(lag), 0.0)}) if lag else found

    modes = made(0.0).loop_modes(count=4)
    pendulum = SPIN * math.sqrt(OFFSET / 0.6)  # of a point mass
    swing = int(np.argmin(np.abs(modes.pole - 1j * pendulum)))
    start = math.radians(0.2)
    run = made(start).simulate(until=until, every=0.02, tolerance=1e-10, fine=False)
    lag = run["blade"].tip_lag.values
    peaks = np.flatnonzero((np.abs(lag[1:-1]) >= np.abs(lag[:-2])) & (np.abs(lag[1:-1]) > np.abs(lag[2:]))) + 1
    fitted = np.polyfit(run.time.values[peaks[1:]], np.log(np.abs(lag[peaks[1:]])), 1)[0]
    return float(modes.pole[swing].real), float(fitted)


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "delay"), [(0.02, 0.0), (0.04, 0.2), (0.02, 1.7)])
def test_swings_decay_or_grow_by_the_poles_of_the_loop(gain: float, delay: float) -> None:
    """The last delay is more than half a period: what damps without it feeds the swing, in the poles and in the run."""
    pole, run = drifted(gain, delay, 18.0)
    assert run == pytest.approx(pole, rel=0.03)
    assert (pole > 0.0) == (delay > 1.0)


def chain(case: Any, length: float, momentum: float) -> tuple[Array, Array, Array]:
    """A straight blade in the plane of the spin, from lateral forces: state matrix, input by pay-out speed, places.

    Lateral displacements y of the nodes in axes that turn with the body, their rates, and the rate of the body:
    m (y'' + (L0 + s) psi'') = -K y - 2 m W v, with the tension of the spin in K, and J psi'' = N L0 T y_1 / b.
    """
    body, blade = case.body, case.blade
    segment = blade.length / blade.nodes
    count = math.ceil(round(length / segment, 9))
    places = length - segment * np.arange(count)[::-1]
    m = np.full(count, blade.line_density * segment)
    m[-1] = blade.tip_mass + 0.5 * blade.line_density * segment
    x = body.spool_offset + places
    W = momentum / (body.spin_inertia + body.blades * np.sum(m * x**2))
    tension = np.cumsum((m * x)[::-1])[::-1] * W**2
    springs = tension / np.append(places[0], np.full(count - 1, segment))
    K = np.diag(springs) + np.diag(np.append(springs[1:], 0.0)) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    K -= np.diag(m * W**2)
    M = np.block([[np.diag(m), (m * x)[:, None]], [np.zeros((1, count)), np.array([[body.spin_inertia]])]])
    force = np.vstack([-K, np.append(body.blades * body.spool_offset * springs[0], np.zeros(count - 1))])
    A, B = np.zeros((2 * count + 1, 2 * count + 1)), np.zeros(2 * count + 1)
    A[:count, count : 2 * count] = np.eye(count)
    A[count:, :count] = np.linalg.solve(M, force)
    B[count:] = np.linalg.solve(M, np.append(-2.0 * m * W, 0.0))
    return A, B, places


@pytest.mark.slow
def test_poles_of_a_heliogyro_are_those_of_a_chain_under_sampled_control() -> None:
    """The loop of the built-in case, with the gains of its law by hand, on another model of the blade."""
    length, nodes = 4.75, 10
    case = cases.load("heliogyro-feedback", {"blade.nodes": nodes})
    given = case.spool.feedback
    c, T, tau = given.constants, given.sensor.period, given.sensor.filter
    momentum = case.body.spin_inertia * case.body.rate
    A, B, places = chain(case, length, momentum)
    n, share = B.size, 1.0 - math.exp(-T / tau)
    Z = np.zeros((n + 3, n + 3))  # motion, length, rate of it, acceleration
    Z[:n, :n], Z[:n, n + 1], Z[n, n + 1], Z[n + 1, n + 2] = A, B, 1.0, 1.0
    E = expm(Z * T)[: n + 2]
    marker = int(np.argmin(np.abs(places - (length - given.marker))))
    C = np.zeros((2, n + 2))
    C[0, marker], C[1, n] = -1.0 / places[marker], 1.0
    scale = (length / c["L"]) ** 8
    gains = np.array([-scale * c["g"], -1.0 / c["tau"], -scale * c["k"], 0.0])  # m/s by lag, length and their rates
    columns = []
    for x in np.eye(n + 2 + 4 + 4):  # filtered values and rates of the sample before, and of that before it
        motion, newest, last = x[: n + 2], x[n + 2 : n + 6], x[n + 6 :]
        motion = E @ np.append(motion, (gains @ last - motion[n + 1]) / T)
        filtered = newest[:2] + share * (C @ motion - newest[:2])
        columns.append(np.concatenate([motion, filtered, (filtered - newest[:2]) / T, newest]))
    z = np.linalg.eigvals(np.array(columns).T)
    wanted = np.log(z[np.abs(z) > 1e-6].astype(complex)) / T
    spin = momentum / (case.body.spin_inertia + 2.0 * np.sum(_masses(case, places) * (0.05 + places) ** 2))
    still = {"spool.start_length": length, "spool.feedback.rate": 0.0, "body.rate": spin}
    system = build(cases.load("heliogyro-feedback", {"blade.nodes": nodes} | still))
    found = system.loop_modes(time=150.0, count=8)
    assert found.pole.size == 8
    for pole in found.pole:
        near = wanted[np.argmin(np.abs(wanted - pole))]
        assert abs(pole - near) < 2e-3 * abs(pole)


def _masses(case: Any, places: Array) -> Array:
    segment = case.blade.length / case.blade.nodes
    m = np.full(places.size, case.blade.line_density * segment)
    m[-1] = case.blade.tip_mass + 0.5 * case.blade.line_density * segment
    return m


@pytest.mark.slow
def test_the_built_in_loop_leaves_little_swing_at_a_corner() -> None:
    """10 % more inertia and less spin than the law's constants were found for, with noise and delay, on few nodes."""
    nodes = 8
    corner = {"body.inertia": 1.1 * 0.004, "body.rate": 0.9 * 6.0, "blade.nodes": nodes}
    run = evolvent.run("heliogyro-feedback", corner)
    assert run.attrs["status"] == "success"
    assert float(np.degrees(run.residual_swing_tip)) < 0.5
    assert float(np.degrees(run.residual_swing_hub)) < 0.5
    assert float(run.deployed_length[-1, 0]) == pytest.approx(5.0, rel=1e-3)


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "unknown result": ({"variables": {"out": "blade.deployed"}}, r"reel\.drive\.variables\.out: no variable is called"),
    "many numbers": ({"variables": {"out": "blade.tip_position"}}, r"which is not one number; name one of its comp"),
    "unused": (
        {"variables": {"out": "blade.deployed_length", "lag": "blade.tip_lag"}},
        r"reel\.drive\.variables has 'lag', which reel\.drive\.law, .*, does not use",
    ),
    "unknown name": ({"law": "q - out", "constants": {}}, r"law is 'q - out'; 'q' at character 1 is neither"),
    "taken": ({"law": "t", "variables": {"t": "blade.deployed_length"}, "constants": {}}, "'t' would stand for two"),
    "noise of what is not measured": (
        {"sensor": {"period": 0.1, "noise": {"lag": 0.1}}}, r"reel\.drive\.sensor\.noise has 'lag'",
    ),
    "noise in another unit": ({"sensor": {"period": 0.1, "noise": {"out": "1 deg"}}}, r"noise\.out is '1 deg'; 'deg'"),
    "start outside of its limits": ({"limits": {"rate": [1.0, 2.0]}}, r"reel\.drive\.rate is 0 rad/s, outside"),
    "not finite": ({"law": "1/(out - out)", "constants": {}}, r"reel\.drive\.law is (inf|nan) at t = 0 s, with t = 0"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    given, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        reacting(**given).simulate(until=1.0, every=0.5)


@pytest.mark.slow
def test_a_spool_where_a_node_is_released_has_no_modes() -> None:
    """There the motion beside the steady turn has no derivative: a released node brings in energy."""
    found = reacting(angle=50.0, nodes=2)
    with pytest.raises(InputError, match=r"stands at 50 rad just where a node .* give it another angle"):
        found.loop_modes()


def test_limits_and_sensors_are_checked() -> None:
    with pytest.raises(InputError, match=r"limits\.rate is \[2\.0, 1\.0\]; the first, the least, must be below"):
        parts.Limits(rate=(2, 1))
    with pytest.raises(InputError, match=r"Sensor\.period is '0 s'; it must be"):
        parts.Sensor(period="0 s")
    with pytest.raises(InputError, match=r"sensor\.delay is 1 s, more than 10000 times sensor\.period, 1e-05 s"):
        parts.Sensor(period=1e-5, delay=1.0)
    with pytest.raises(InputError, match=r"Sensor\.noise is \{'lag': -1\}; it must be a mapping of names"):
        parts.Sensor(period=1.0, noise={"lag": -1})


@pytest.mark.slow
def test_only_explicit_methods_close_a_loop() -> None:
    system = reacting()
    for method in ("generalized-alpha", "energy-momentum", "hht"):
        with pytest.raises(
            InputError, match=f"'reel' reacts to what is measured, which {method} does not support; use"
        ):
            system.simulate(until=1.0, method=method)
    for call in (system.equilibrium, system.modes):
        with pytest.raises(InputError, match="'blade' is a thread on a spool under feedback, which"):
            call()
    with pytest.raises(InputError, match="no spool reacts"):
        evolvent.load("heliogyro").loop_modes()
    with pytest.raises(InputError, match=r"reel\.drive\.rate is 1 rad/s; modes are those of a spool that stands still"):
        reacting(rate=1.0).loop_modes()
    assert list(feedback.reels(system.assemble())) == ["reel"]
    assert system.simulate(until=0.5, every=0.1).attrs["method"] == "dopri5"


KEYS: dict[str, tuple[dict[str, Any], str]] = {
    "rate as well": ({"spool.rate": 3.5}, r"spool\.rate and spool\.feedback are both given; give one of them"),
    "table as well": (
        {"spool.table": [[0, 1], [1, 1]]}, r"spool\.table and spool\.feedback are both given; give one of them",
    ),
    "nothing measured": (
        {"spool.feedback.law": "3 + 0*t", "spool.feedback.constants": {}, "spool.feedback.sensor.noise": {}},
        r"spool\.feedback\.law is .*, which reads nothing that is measured; use lag, out or spin",
    ),
    "unknown noise": ({"spool.feedback.sensor.noise": {"leg": 0.1}}, r"spool\.feedback\.sensor\.noise has 'leg'"),
    "marker beyond the blade": ({"spool.feedback.marker": "6 m"}, r"spool\.feedback\.marker is 6 m; it must be below"),
    "duration": ({"solver.duration": "auto"}, r"the spools react to what is measured; give it"),
    "implicit": ({"solver.method": "generalized-alpha"}, r"which generalized-alpha does not support; use"),
}  # fmt: skip


@pytest.mark.parametrize("name", KEYS)
def test_keys_of_the_case(name: str) -> None:
    given, message = KEYS[name]
    with pytest.raises(InputError, match=message):
        evolvent.run("heliogyro-feedback", given)
