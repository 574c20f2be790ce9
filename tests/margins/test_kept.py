"""Margins as values that runs and studies keep: closed forms, distributions, refusals; slides and motors in a run."""

import math

import numpy as np
import pytest

import evolvent
from evolvent import System, parts
from evolvent.results.kept import Kept
from evolvent_base.errors import InputError
from margin_cases import FRICTION, NONE, case, zero

pytestmark = pytest.mark.slow


def study(**changes):
    return {
        "case": case(), "sample": "monte-carlo", "samples": 124, "seed": 1,
        "over": {"parts.hinge.stiffness": "normal(nominal, 5%)"}, "keep": ["hinge.margin"],
    } | changes  # fmt: skip


def by_hand(stiffness, friction=FRICTION):
    """The margin of the arm: least at the latch, 0.8 k pi/2 against 2 x 3 times the friction."""
    return 0.8 * stiffness * math.pi / 2 / (6.0 * friction) - 1.0


def test_the_distribution_of_a_margin_that_is_linear_in_the_stiffness():
    found = evolvent.disperse(study())
    one = found["hinge.margin"]
    stiffness = found.dataset["parts.hinge.stiffness"].values
    assert one.values == pytest.approx(by_hand(stiffness), rel=1e-12)
    mean, std, n = by_hand(0.1), 0.05 * (1.0 + by_hand(0.1)), one.values.size
    assert abs(one.moments["mean"] - mean) < 4.0 * std / math.sqrt(n)
    assert abs(one.moments["std"] / std - 1.0) < 4.0 / math.sqrt(2.0 * n)
    assert one.lower.value == np.sort(one.values)[2]  # the third of 124 runs
    assert mean - 3.5 * std < one.lower.value < mean - 1.645 * std  # 5 % of all margins lie below the right one
    assert one.regression.r2 == pytest.approx(1.0, abs=1e-9)
    assert (one.unit, one.text) == ("", "hinge.margin: least margin over the travel at rest")


def test_ranked_sensitivities_of_a_margin():
    over = {"parts.hinge.stiffness": "normal(nominal, 2%)", "parts.hinge.friction": "normal(nominal, 4%)"}
    found = evolvent.disperse(study(over=over))["hinge.margin"]
    # to first order: the margin goes as k/F, so the variances are as 2^2 to 4^2
    k, F = (abs(entry) for entry in found.regression.coefficients)
    assert F / k == pytest.approx(2.0, rel=0.2)


def test_draws_without_a_margin_are_failures():
    """A latch at the angle of the start leaves no travel."""
    found = evolvent.disperse(study(over={"parts.hinge.latch": "table(90 deg, 0 deg)"}, samples=12))
    latch = found.dataset["parts.hinge.latch"].values
    assert [one.case for one in found.failures] == np.flatnonzero(latch == 0.0).tolist()
    assert 0 < len(found.failures) < 12
    assert "no coordinate of the system has a margin" in found.failures[0].reason
    values = found["hinge.margin"].values
    assert values[latch > 0.0] == pytest.approx(by_hand(0.1), rel=1e-12)
    assert np.isnan(values[latch == 0.0]).all()


def test_kept_margins_are_those_of_margin():
    system = evolvent.load(case())
    margins = system.margin()
    keep = ["hinge.margin_in_run", "hinge.latch_time.last", "hinge.margin"]
    found = system.simulate(keep=keep)
    assert list(found) == keep
    assert found["hinge.margin"] == margins.least == pytest.approx(by_hand(0.1), rel=1e-12)
    assert found["hinge.margin_in_run"] == margins.motion("hinge").margin("motorization").min()
    assert found["hinge.latch_time.last"] == margins.latches[0]["time"]
    softer = system.with_values({"hinge.stiffness": 0.05}).simulate(keep=["hinge.margin"])
    assert isinstance(softer, Kept)
    assert softer["hinge.margin"] == pytest.approx(by_hand(0.05), rel=1e-12)
    assert softer.units("hinge.margin") == "1"


def test_any_number_of_workers_gives_the_same_bits():
    asked = study(samples=6, keep=["hinge.margin", "hinge.margin_in_run"])
    one, two = (evolvent.disperse(asked, workers=n).dataset for n in (1, 2))
    for name in ("hinge_margin", "hinge_margin_in_run"):
        assert np.array_equal(one[name].values, two[name].values)
        assert np.isfinite(one[name].values).all()


def test_a_sweep_over_the_keys_of_the_margin():
    over = {"margin.others": ["start", "end"], "parts.hinge.stiffness": [0.05, 0.1]}
    found = evolvent.sweep({"case": case(), "over": over, "keep": ["hinge.margin"]})
    assert found.hinge_margin.values == pytest.approx(by_hand(np.array([[0.05, 0.1]] * 2)), rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"case": case() | {"margin": {}}},
            "friction, hysteresis|hysteresis, harness.* are neither given nor declared",
        ),
        ({"case": {k: v for k, v in case().items() if k != "margin"}}, "are neither given nor declared to be zero"),
        ({"keep": ["hinge.margin_in_run"], "case": case() | {"margin": {}}}, "are neither given nor declared"),
        ({"keep": ["hinges.margin"]}, r"keep holds 'hinges.margin'; no margin is that of 'hinges'; did you mean"),
        ({"keep": ["hinge.margin.min"]}, "'hinge.margin' has no time to reduce; write 'hinge.margin'"),
        ({"case": case(zero=NONE)}, "friction of 'hinge' is declared to be zero, but the case gives it"),
    ],
)
def test_refusals(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        evolvent.disperse(study(samples=3, **changes))


# ------------------------------------------------------------------------------------------------ tables of a run


def slider(**spring):
    """A body of 3 kg on a rail."""
    system = System(settings={"until": "2 s", "every": "0.02 s", "fine": False})
    system.add(parts.RigidBody(mass=3.0, inertia=(1.0, 1.0, 1.0)), "slider")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="slider", type="prismatic", axis=(1, 0, 0)), "rail")
    if spring:
        system.add(parts.JointSpring(joint="rail", **spring), "slide")
    return system


def test_a_slide_in_the_run_by_newtons_law():
    system = slider(stiffness=2.0, rest=1.5, damping=0.4, friction=0.2, low=-9.0, high=0.6, stop=1e4)
    lines = {"slide": {"travel": (0.0, 0.6)}}
    found = system.margin(zero=zero("friction"), lines=lines, stations=3)
    table, run = found.motion("slide"), system.simulate()["slide"]
    n = table.time.size
    assert 5 < n < run.time.size
    assert table.x == pytest.approx(run.travel.values[:n], abs=1e-9)
    shares = dict(zip([one.label for one in table.shares], table.values, strict=True))
    assert shares["slide.stiffness"] == pytest.approx(2.0 * (1.5 - table.x), abs=1e-9)
    assert shares["slide.friction"] == pytest.approx(np.full(n, -0.2), rel=1e-12)
    assert shares["slide.damping"] == pytest.approx(-0.4 * run.rate.values[:n], abs=1e-9)
    acceleration = np.gradient(run.rate.values, run.time.values)[2 : n - 2]
    assert table.values.sum(axis=0)[2 : n - 2] == pytest.approx(3.0 * acceleration, rel=1e-2)
    assert table.required("motorization") == pytest.approx(np.full(n, 6 * 0.2), rel=1e-12)
    # at rest it is least at the stop, and so along the run, whose last sample is before it
    assert found.least == pytest.approx(0.8 * 2.0 * 0.9 / 1.2 - 1.0, rel=1e-12)
    latch = found.latches[0]
    k = int(np.flatnonzero(run.travel.values >= 0.6)[0])
    assert (latch["time"], latch["rate"]) == pytest.approx((run.time.values[k], run.rate.values[k]), rel=1e-12)
    assert latch["energy"] == pytest.approx(1.5 * run.rate.values[k] ** 2, rel=1e-9)
    assert latch["joint"] == "rail"


def test_a_motor_without_a_spring_in_the_run():
    system = slider()
    system.add(parts.Motor(joint="rail", torque={"constant": 1.2}), "motor")
    lines = {"rail": {"travel": (0.0, 0.5), "acceleration": "0.1 m/s^2"}}
    found = system.margin(zero=zero("acceleration"), lines=lines, stations=3)
    table = found.motion("rail")
    # 1.2 N on 3 kg: x = 0.2 t^2, which is 0.5 m at 1.58 s
    assert table.time == pytest.approx(0.02 * np.arange(80), abs=1e-12)
    assert table.x == pytest.approx(0.2 * table.time**2, abs=1e-6)
    assert table.available == pytest.approx(np.full(80, 1.2), rel=1e-12)
    assert table.required("motorization") == pytest.approx(np.full(80, 1.25 * 0.3), rel=1e-12)
    assert found.least == pytest.approx(1.2 / 0.375 - 1.0, rel=1e-12)
    latch = found.latches[0]
    assert latch["time"] == pytest.approx(1.6, abs=1e-12)
    assert latch["rate"] == pytest.approx(0.4 * 1.6, rel=1e-5)
    assert latch["energy"] == pytest.approx(1.5 * 0.64**2, rel=1e-4)


def test_a_motor_that_follows_a_motion_in_the_run():
    """Its torque along a run is what it gives there: the gain times the lag, within its limit."""
    system = slider()
    gains = {"position_gain": 50.0, "velocity_gain": 20.0, "limit": 4.0}
    system.add(parts.Motor(joint="rail", motion={"constant": {"rate": 0.2}}, **gains), "motor")
    found = system.margin(zero=NONE, lines={"rail": {"travel": (0.0, 0.3)}}, stations=3)
    table, run = found.motion("rail"), system.simulate()
    given = run["motor"].force.values[: table.time.size]
    assert table.values[0] == pytest.approx(given, abs=1e-9)
    assert np.ptp(given) > 0.1
    assert found["rail"].available == pytest.approx(np.full(3, 4.0), rel=1e-12)
