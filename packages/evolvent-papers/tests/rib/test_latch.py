"""A rib that springs off its hub, turns outwards in its hinge against a damper, and latches."""

import math

import numpy as np
import pytest

import evolvent
from evolvent import cases, closed_forms
from evolvent_base.errors import InputError

CASE = "wrapped-rib-deploy-damped"
#: A short rib, 5 radii of the hub long: 5 s to its latch.
SHORT = {
    "rib.length": 3, "rib.elements": 12, "rib.root_damping": 0.005, "solver.duration": 9, "output.every": 0.05,
    "output.fine": False,
}  # fmt: skip


def about_root(run):
    """Angular momentum of the rib about its root, N m s: of a rib on a fixed hub all that there is."""
    return run.angular_momentum.values[:, 2] - 0.6 * run.momentum.values[:, 1]


@pytest.mark.parametrize("damping", [0.005, 0.05])
def test_a_damper_takes_its_coefficient_times_the_angle_of_angular_momentum(damping):
    """Whatever the rib's shape; between the last contact with the hub and the latch."""
    run = evolvent.run(CASE, SHORT | {"rib.root_damping": damping, "solver.tolerance": 3e-5, "solver.duration": 6})
    hinge, impulse, t = run["hinge-1"], run["contact-1"].impulse.values, run.time.values
    before = t < np.nan_to_num(float(hinge.latch_time[-1]), nan=np.inf)
    touches = np.flatnonzero((np.diff(impulse) != 0.0) | ~before[1:])  # of intervals between samples
    ends = np.concatenate([[-1], touches, [t.size - 1]])
    k = int(np.argmax(np.diff(ends)))
    one, last = ends[k] + 1, ends[k + 1]
    turned = float(hinge.angle[last] - hinge.angle[one])
    assert turned < -0.2
    H = about_root(run)
    assert H[last] - H[one] == pytest.approx(-damping * turned, rel=0.005, abs=2e-4 * abs(H[one]))
    assert float(hinge.damper_work[-1]) == pytest.approx(
        float(run.energy_losses.sel(cause="joints")[-1]), rel=1e-6, abs=1e-15
    )


def test_the_energy_that_was_wound_is_accounted_for():
    run = evolvent.run(CASE, SHORT | {"rib.root_damping": 0.005, "rib.root_latch_damping": 0.2})
    case, hinge = cases.load(CASE, SHORT), run["hinge-1"]
    wound = closed_forms.bending_energy(case.strip)
    assert float(run.energy[0]) == pytest.approx(wound, rel=0.02)  # of the mesh
    left, lost = float(run.energy[-1]), float(run.energy_losses[-1].sum())
    assert left + lost == pytest.approx(float(run.energy[0]), rel=0.01)
    assert float(hinge.damper_work[-1]) > 0.02 * wound
    assert float(hinge.latch_work[-1]) > 0.0


def test_a_latched_hinge_stays_at_its_latch():
    run = evolvent.run(CASE, SHORT)
    hinge, t = run["hinge-1"], run.time.values
    after = t > float(hinge.latch_time[-1])
    assert float(hinge.angle[0]) == pytest.approx(0.5 * math.pi, abs=0.02)
    assert after.sum() > 5
    peak = float(hinge.latch_torque_peak[-1])
    assert np.abs(hinge.angle.values[after]).max() <= peak / 2.0 * 1.001  # its moment over its stiffness
    assert np.all(hinge.latched.values == after)


@pytest.mark.slow
def test_a_stiffer_rib_does_the_same_in_less_time():
    """Time goes with 1/sqrt(E), moments with E, where dampers go with sqrt(E)."""
    found = []
    for share in (1.0, 5e6 / 147e9):
        keys = {
            "rib.young_modulus": 147e9 * share, "rib.root_damping": 0.02 * math.sqrt(share),
            "rib.root_latch_stiffness": 2.0 * share, "solver.duration": 9.0 / math.sqrt(share),
            "output.every": 0.05 / math.sqrt(share),
        }  # fmt: skip
        hinge = evolvent.run(CASE, SHORT | keys)["hinge-1"]
        found.append((float(hinge.latch_time[-1]) * math.sqrt(share), float(hinge.latch_torque_peak[-1]) / share))
    assert found[1] == pytest.approx(found[0], rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("alpha", "damping"), [(0.0, 0.0), (0.0, 0.1), (0.015, 0.0)])
def test_a_long_rib_opens_as_its_closed_form(alpha, damping):
    """The rib is some R/L ahead of the straight tail, a damped root behind; the moment is that of an elastica."""
    keys = {"damping.alpha": alpha, "rib.root_damping": damping, "solver.duration": "auto"}
    case = cases.load(CASE, keys)
    run = evolvent.run(CASE, keys)
    found = closed_forms.opening(case.strip, alpha=alpha, damping=damping)
    hinge, t = run["hinge-1"], run.time.values
    latched = float(hinge.latch_time[-1])
    assert latched == pytest.approx(found.latched, rel=0.08 if damping else 0.03)
    tip = np.interp(found.unwound, t, run["rib-1"].tip_speed.values)
    assert tip == pytest.approx(found.tip_speed, rel=0.1)
    if alpha == damping == 0.0:
        turned = math.radians(60.0)
        p = run["rib-1"].position.values
        ahead = np.arctan2(p[:, -1, 1] - p[:, 0, 1], p[:, -1, 0] - p[:, 0, 0])
        at = int(np.argmax((t > latched) & (ahead < -turned)))
        moment = np.abs(hinge.torque.values[at - 5 : at + 6]).mean()
        assert moment == pytest.approx(found.moment(case.strip, turned), rel=0.15)


def test_drag_alone_slows_the_unwinding():
    """By its limits: none gives the closed form without drag; much makes the time alpha m L^4 / 6 EI."""
    strip = cases.load("wrapped-rib-deploy").strip
    free = closed_forms.opening(strip)
    assert free.unwound == pytest.approx(closed_forms.deployment_time(strip), rel=1e-6)
    assert free.tip_speed == pytest.approx(closed_forms.deployment_speed(strip), rel=1e-6)
    assert free.latched - free.unwound == pytest.approx(0.5 * math.pi * 12.0 / free.tip_speed, rel=1e-9)
    slow = closed_forms.opening(strip, alpha=0.2)
    assert slow.unwound == pytest.approx(0.2 * strip.line_density * 12.0**4 / (6.0 * strip.bending_stiffness), rel=1e-3)
    assert math.isinf(slow.latched)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rib.root": "clamp"}, ["rib.root_damping", "'clamp'"]),
        ({"rib.root_latch_stiffness": 0}, ["rib.root_latch is 0 deg", "root_latch_stiffness is 0"]),
        ({"rib.root_latch": None}, ["rib.root_latch_stiffness", "rib.root_latch"]),
        ({"rib.root_latch": "90 deg"}, ["rib.root_latch is 90 deg", "below 90 deg"]),
        ({"rib.root_latch": "-91 deg"}, ["rib.root_latch is -91 deg", "from -90"]),
        ({"rib.root_rest": "0 deg"}, ["rib.root_rest", "rib.root_stiffness is 0"]),
        ({"phase": "hold", "hold": {"time": 1}, "drive": {"torque": 0.2}}, ["rib.root_latch", "phase is 'hold'"]),
    ],
)
def test_hinges_that_cannot_be_are_refused(changes, words):
    with pytest.raises(InputError) as refused:
        cases.load(CASE, changes)
    assert all(word in str(refused.value) for word in words), str(refused.value)


def test_a_damper_that_stops_the_rib_asks_for_a_duration():
    with pytest.raises(InputError, match=r"solver\.duration is auto"):
        assert cases.load(CASE, {"rib.root_damping": 2, "solver.duration": "auto"}).duration


def test_a_spring_at_rest_outwards_opens_the_hinge():
    """Of a rib that drag has stopped, and holds it there without a latch."""
    keys = {"rib.root_latch": None, "rib.root_latch_stiffness": 0, "rib.root_stiffness": 0.02, "rib.root_rest": 0}
    run = evolvent.run(CASE, SHORT | keys | {"damping.alpha": 1, "solver.duration": 40, "output.every": 1})
    hinge = run["hinge-1"]
    assert abs(float(hinge.torque[0])) == pytest.approx(0.02 * 0.5 * math.pi, rel=0.02)
    assert abs(float(hinge.angle[-1])) < 0.1
