"""Numbers, figures and motion of synthetic runs, which the closed forms fill; no solver is asked."""

import numpy as np
import pytest
import xarray as xr

from evolvent import results
from evolvent.design.studies import draw
from evolvent.families.contact.observer_surfaces import mean_rate
from evolvent.results.rotations import product, turned
from evolvent.view import animation
from evolvent_base import plots
from evolvent_papers import wrapped_rib as system
from rib.synthetic import DEPLOY, HOLD, WIND, synthetic

RUNS = {"wind": WIND, "hold": HOLD, "deploy": DEPLOY}


@pytest.fixture(params=RUNS)
def run(request):
    return synthetic(RUNS[request.param])


def _numbers(run):
    return {number.label: number.value for number in system.numbers(run)}


def test_numbers_of_a_saved_run_are_those_of_the_run(run, tmp_path):
    results.save(run, tmp_path / "run.nc")
    again = results.open(tmp_path / "run.nc")
    assert _numbers(again) == _numbers(run)


def test_numbers_of_winding():
    found = _numbers(synthetic(WIND))
    assert found["wound at the end"] == "3.183 turns"
    assert found["touches the hub at the end"] == "3.183 turns, 100 % of the rib"
    assert found["98 % wound, estimate for a string"] == "66.402 s"
    assert found["largest tip speed"].startswith("33.35 m/s at 66.402 s")
    assert found["bending stiffness of the mesh, over the rib's"] == "1"
    assert "mass damping" in found["energy dissipated by"]
    assert "warning" not in found


def test_numbers_of_holding():
    found = _numbers(synthetic(HOLD))
    assert found["contact force, mean of the last 4 %"] == "3.3333 N (T L / 2 R2 = 3.3333)"
    assert found["curvature x R, away from the ends"].startswith("1.0001 ± ")  # cubics through exact nodes


def test_numbers_of_deployment():
    found = _numbers(synthetic(DEPLOY, {"solver.duration": 4000}))
    assert found["tip radius at the end"] == "8.2123 m (closed form 8.2123)"
    assert found["tip speed, mean of the second half"] == "0.01398 m/s (closed form 0.01398)"
    assert "energy dissipated by" not in found


@pytest.mark.parametrize(
    "changes",
    [
        {"damping.alpha": 0.1},
        {"rib.tip_thickness": "0.1 mm"},
        {"hub.motion": "spin", "hub.inertia": 5},
        {"contact.friction": 0.2},
    ],
)
def test_a_closed_form_that_does_not_hold_is_not_shown(changes):
    run = synthetic(DEPLOY, {"solver.duration": 4000} | changes)
    found = _numbers(run)
    assert not any("closed form" in found[name] for name in found if name != "steps")
    assert "closed form unwinds all in" not in found
    labels = [line.label for figure in system.figures(run) for panel in figure.panels for line in panel.lines]
    assert "closed form" not in labels


def test_a_tapered_rib_is_held_by_other_forces():
    changes = {"rib.tip_thickness": "0.15 mm"}
    found = _numbers(synthetic(HOLD, changes))
    force = 0.2 * 12.0 / 0.36 * 2.0 / 4.5
    assert found["contact force, mean of the last 4 %"] == f"{force:.5g} N (closed form {force:.5g})"
    assert "98 % wound, estimate for a string" not in _numbers(synthetic(WIND, changes))


def test_a_rib_that_lies_the_other_way_round():
    run = synthetic(DEPLOY)
    for name in ("wrap_angle", "touching_angle"):
        run[name] = run[name] - 8.0
    assert _numbers(run)["wound at the end"] == "1.273 turns, the other way round"
    assert _numbers(run)["touches the hub at the end"] == "1.273 turns, the other way round, 40 % of the rib"
    (panel,) = (p for f in system.figures(run) for p in f.panels if p.y_label == "angle, rad")
    assert panel.lines[0].y.min() < 0.0


def test_the_peak_between_samples_is_drawn():
    run = synthetic(WIND)
    run["tip_speed_peak"] = xr.DataArray([50.0], dims="rib")
    run["tip_speed_peak_time"] = xr.DataArray([66.4], dims="rib")
    (panel,) = (p for f in system.figures(run) for p in f.panels if p.y_label == "tip speed, m/s")
    assert [line.y[0] for line in panel.lines if line.marker] == [50.0]


def test_ribs_are_drawn_about_a_hub_that_moves():
    run = synthetic(HOLD, {"hub.motion": "free", "hub.mass": 200, "hub.inertia": 50})
    for part in ("rib-1", "hub"):
        run[part]["position"] = run[part]["position"] + np.array([1.0, 2.0, 3.0])
    shape = system.figures(run)[0]
    for line in shape.panels[0].lines:
        assert np.hypot(line.x, line.y) == pytest.approx(0.6, rel=2e-4)


def test_a_warning_and_a_free_hubs_momentum_are_told():
    free = {"hub.motion": "free", "hub.mass": 200, "hub.inertia": 50}
    run = synthetic(DEPLOY, free)
    run.attrs["warning"] = "something is off"
    found = _numbers(run)
    assert found["warning"] == "something is off"
    assert found["drift of angular momentum"] == "0 kg m2/s"
    assert found["drift of linear momentum"] == "0 kg m/s"
    assert found["hub turned by"] == "0 deg"


@pytest.mark.slow
def test_figures_can_be_drawn(run, tmp_path):
    found = system.figures(run)
    names = {figure.name for figure in found}
    assert {"shape", "tip", "along", "energy-balance"} <= names
    assert ("contact" in names) == (run["contact-1"]["points"].values.max() > 0.0)
    for path in plots.draw(found, tmp_path):
        assert (tmp_path / path).stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_several_ribs_and_a_turning_hub_are_drawn(tmp_path):
    run = synthetic(WIND, {"rib.count": 3, "hub.motion": "spin", "hub.inertia": 50})
    found = {figure.name: figure for figure in system.figures(run)}
    assert "hub" in found
    labels = [line.label for line in found["contact"].panels[2].lines]
    assert labels == ["contact-1", "contact-2", "contact-3"]
    assert plots.draw(list(found.values()), tmp_path)


def test_a_short_run_draws_nothing_and_does_not_move():
    run = synthetic(WIND).isel(time=slice(0, 1))
    assert system.figures(run) == []
    assert animation.of_run(run) is None
    assert system.numbers(run)


def test_the_mean_rate_of_a_line_and_of_a_parabola():
    time = np.sort(np.concatenate([np.linspace(0.0, 10.0, 300), np.linspace(3.0, 4.0, 50)]))
    time = np.unique(time)
    assert mean_rate(time, 2.0 * time, 0.1) == pytest.approx(2.0, rel=1e-12)
    inner = (time > 0.5) & (time < 9.5)
    assert mean_rate(time, 0.5 * time**2, 0.1)[inner] == pytest.approx(time[inner], abs=1e-3)
    assert mean_rate(time[:1], time[:1], 0.1) == [0.0]


def test_the_held_force_is_drawn_beside_the_closed_form():
    run = synthetic(HOLD)
    (panel,) = (p for f in system.figures(run) for p in f.panels if p.y_label == "contact force, N")
    assert [line.label for line in panel.lines][:2] == ["normal force", "mean force"]
    assert panel.lines[1].y == pytest.approx(10.0 / 3.0, rel=1e-6)
    assert panel.lines[2].y == pytest.approx(10.0 / 3.0, rel=1e-12)


def test_motion_shows_the_ribs_with_their_width(run, tmp_path):
    motion = system.motion(run)
    (rib,) = motion.lines
    nodes = run["rib-1"]["position"].values
    assert rib.points[:, :: (rib.points.shape[1] - 1) // (nodes.shape[1] - 1)] == pytest.approx(nodes)
    assert rib.width == 0.03
    assert (tmp_path / animation.write(motion, tmp_path / "rib.html")).stat().st_size > 10_000


@pytest.mark.slow
def test_motion_of_a_hub_that_turns_and_moves():
    """A rib that rests on a hub which turns by 0.3 rad, is tilted and moves is seen at rest."""
    run = synthetic(HOLD, {"hub.motion": "free", "hub.mass": 200, "hub.inertia": 50})
    still = system.motion(run).lines[0].points
    angle = np.linspace(0.0, 0.3, run.sizes["time"])

    def set_motion(attitude, moved):
        rib, hub = run["rib-1"], run["hub"]
        hub["attitude"] = hub["attitude"].copy(data=attitude)
        hub["position"] = hub["position"].copy(data=np.tile(moved, (angle.size, 1)))
        for name in ("position", "slope", "width_direction"):
            rib[name] = rib[name].copy(data=turned(attitude, rib[name].values) + (moved if name == "position" else 0.0))

    # turned about z, then the whole tilted by 90 deg about x and moved
    spin = np.stack([np.cos(angle / 2), 0.0 * angle, 0.0 * angle, np.sin(angle / 2)], axis=1)
    set_motion(spin, np.zeros(3))
    np.testing.assert_allclose(system.motion(run).in_body().lines[0].points, still, rtol=1e-6, atol=1e-12)
    run = synthetic(HOLD, {"hub.motion": "free", "hub.mass": 200, "hub.inertia": 50})
    tilt = np.tile(np.sqrt(0.5) * np.array([1.0, 1.0, 0.0, 0.0]), (angle.size, 1))
    set_motion(product(tilt, spin), np.array([1.0, 2.0, 3.0]))
    motion = system.motion(run)
    np.testing.assert_allclose(motion.in_body().lines[0].points, still, rtol=1e-6, atol=1e-12)
    assert motion.body.origin[0] == pytest.approx([1.0, 2.0, 3.0])
    # the forces of the hub push away from it
    pushed = motion.in_body().forces[0]
    forces, places = (x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (pushed.vectors, pushed.points))
    np.testing.assert_allclose(forces, places, rtol=1e-6, atol=1e-9)


@pytest.mark.slow
def test_figures_of_a_study():
    import json

    alphas = [0.0, 0.2, 0.5]
    time = np.arange(0.0, 180.0, 0.5)
    runs = [synthetic(WIND, {"damping.alpha": a}) for a in alphas]
    speed = [r["rib-1"].to_dataset()["tip_speed"].interp(time=time) for r in runs]
    kept = xr.concat(speed, dim="damping.alpha").rename("rib_1_tip_speed").to_dataset()
    kept["tip_speed_peak_time"] = (("damping.alpha", "rib"), [r["tip_speed_peak_time"].values for r in runs])
    kept = kept.assign_coords({"damping.alpha": ("damping.alpha", alphas, {"units": "1/s"})})
    kept.attrs = {"sample": "grid", "keys": json.dumps(["damping.alpha"]), "system": "wrapped-rib"}
    kept.attrs["study"] = "case: {system: wrapped-rib, phase: wind, drive: {kind: torque, torque: 0.2}}\n"
    assert set(draw.of_system(kept)) == {"rib_1_tip_speed", "peak"}
    assert len(draw.over_time(kept)["rib_1_tip_speed"].panels[0].lines) == 3
    runs_line, string = system.study_figures(kept)["peak"].panels[0].lines
    assert runs_line.y == pytest.approx(string.y, abs=1.0)
    assert string.y == pytest.approx([27.63, 66.40, 145.86], abs=0.01)
    assert system.study_figures(kept.assign_attrs(sample="list")) == {}
    assert draw.over_time(kept.assign_attrs(sample="list")) == {}
