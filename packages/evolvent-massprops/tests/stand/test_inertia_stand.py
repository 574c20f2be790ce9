"""The system `inertia-stand`: reference values, identification, refusals."""

import numpy as np
import pytest

import evolvent
from evolvent import cases
from evolvent.results import variables
from evolvent_massprops.batch import cases as batch_cases
from evolvent_massprops.inertia_stand import SYSTEM, identify

QUICK = {"sensors.duration": "4 s", "identification.order": 3}


def run(**overrides):
    return evolvent.run("inertia-stand", {k.replace("__", "."): v for k, v in overrides.items()})


@pytest.mark.slow
def test_reference_values_at_the_middle(book):
    """stand.md: 13.962, 16.422, 24.59 rad/s; 16.24 J each, 48.72 J in all; lateral 4.22 rad/s twice."""
    found = run()
    assert found.mode_frequency.values == pytest.approx([13.962, 16.422, 24.59], abs=6e-4)
    assert found.mode_energy.values == pytest.approx(16.24, abs=0.005)
    assert float(found.mode_energy.sum()) == pytest.approx(3.0 * 9806.65**2 / (8.0 * 740250.0), rel=1e-5)
    assert found.linear_frequency.values[:2] == pytest.approx(4.22, abs=0.005)
    assert list(found.linear_kind.values[3:]) == ["heave", "pitch", "roll"]
    assert found.attrs["status"] == "success"
    assert float(np.abs(found.energy_defect).max()) < 1e-7 * float(found.energy_potential.max())
    book(
        "Inertia stand and identification", "Stand simulated and identified, no offset: frequencies",
        reference="13.962, 16.422, 24.59 rad/s", source="Belyakov 2002; independent linear model",
        error=np.abs(found.mode_frequency.values - [13.962, 16.422, 24.59]).max(), allowed=6e-4, unit="rad/s",
    )  # fmt: skip
    book(
        "Inertia stand and identification", "Stand simulated and identified, no offset: sum of energies",
        reference="3 F^2/8 k", source="closed form",
        error=abs(float(found.mode_energy.sum()) / (3.0 * 9806.65**2 / (8.0 * 740250.0)) - 1.0), allowed=1e-5,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("offset", "frequencies", "energies"),
    [(0.4, (13.229, 17.332, 24.590), (30.2, 2.27, 16.24)), (0.8, (12.036, 19.050, 24.590), (32.3, 0.171, 16.24))],
)
@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_reference_values_off_the_middle(offset, frequencies, energies, support, book):
    found = run(body__offset_x=offset, stand__support=support, identification__order=3)
    assert found.mode_frequency.values == pytest.approx(frequencies, abs=1.5e-3)
    assert found.mode_energy.values == pytest.approx(energies, rel=0.005)
    error = (found.inertia_identified / found.inertia_true - 1.0).sel(component=["xx", "zz"])
    assert np.abs(error.values).max() < 1e-4
    book(
        "Inertia stand and identification", f"Stand simulated and identified, offset {offset:g} m, {support}: Ixx, Izz",
        reference="put in", source="there and back", error=np.abs(error.values).max(), allowed=1e-4,
    )  # fmt: skip


def test_the_papers_scheme_at_6_ms_shows_the_papers_frequency(book):
    """24.59 as printed, for b = 0.87 m, is 24.6015 less (omega dt)^2 / 48 of it."""
    found = run(
        stand__half_width="0.87 m",
        solver__method="modified-euler",
        solver__step="6.3 ms",
        sensors__rate="166.6 Hz",
        identification__order=3,
        identification__way="none",
    )
    linear = float(found.linear_frequency[-1])
    assert linear == pytest.approx(24.6015, abs=1e-3)
    theta = linear / 166.6
    assert float(found.mode_frequency[-1]) == pytest.approx(linear * (1.0 - theta**2 / 48.0), rel=1e-5)
    assert f"{float(found.mode_frequency[-1]):.2f}" == "24.59"
    assert "takes" in found.attrs["warning"]
    book(
        "Inertia stand and identification", "Modified Euler of the paper, 6 ms: frequency", reference="1 - (w h)^2/48",
        source="closed form; printed 24.59 rad/s",
        error=abs(float(found.mode_frequency[-1]) / (linear * (1.0 - theta**2 / 48.0)) - 1.0), allowed=1e-5,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_methods_agree(support):
    """Two implementations of the mechanics: compiled batches, and the general engine with its adaptive method."""
    overrides = {
        "stand.support": support,
        "stand.lateral_stiffness": [1e5, 2e5, 3e5, 1e5],
        "stand.lateral_damping": 300.0,
        "stand.damping": 500.0,
        "body.offset_x": 0.5,
        "body.offset_z": 0.2,
        "body.height": 0.3,
        "body.products": [100.0, 300.0, -200.0],
        "excitation.force": [500.0, -9000.0, 300.0] if support == "hanging" else [0.0, -9000.0, 0.0],
        "solver.accuracy": 1e-9,
        **QUICK,
        "sensors.duration": "2 s",
    }
    found = [run(**overrides, **{"solver.method": method}) for method in ("dop853", "rk4", "dopri5")]
    for other in found[1:]:
        assert other.sensor_true.values == pytest.approx(found[0].sensor_true.values, abs=5e-9)
        assert other.energy_dissipated.values == pytest.approx(found[0].energy_dissipated.values, abs=1e-5)
        assert float(np.abs(other.energy_defect).max()) < 1e-5 * float(other.energy_potential.max())


@pytest.mark.slow
@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_a_batch_is_a_run_of_the_same_parts(support):
    """States of the compiled batch against `System.simulate` of the loaded case: every part, and the balances."""
    changes = {
        "stand.support": support, "body.offset_x": 0.4, "body.height": 0.2, "body.products": [50.0, 200.0, -100.0],
        "stand.damping": 800.0, "stand.lateral_stiffness": 2e5, "solver.accuracy": 1e-11, **QUICK,
    }  # fmt: skip
    found, system = run(**changes), evolvent.load("inertia-stand", changes)
    assert list(system.parts)[:5] == ["body", "spring-1", "spring-2", "spring-3", "spring-4"]
    other = system.simulate()
    assert np.allclose(other.time, found.time, rtol=0.0, atol=1e-12)
    assert list(found.children) == list(other.children)
    for name in variables.names(other):
        one, two = (variables.get(tree, name).values for tree in (found, other))
        scale = float(np.abs(two).max()) or 1.0
        if name.startswith(("energy", "work")):
            scale = float(np.abs(other.energy_elastic).max())
        assert one == pytest.approx(two, abs=2e-7 * max(scale, 1e-3)), name
    position = found["body"].position.values - found["body"].position.values[0]
    assert found.displacement.values - found.displacement.values[0] == pytest.approx(position, abs=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_is_seeded_and_intervals_hold(seed):
    overrides = {"sensors.noise": "0.05 mm", "body.offset_x": 0.4, "body.offset_z": 0.1, "sensors.seed": seed}
    first, again = run(**overrides), run(**overrides)
    assert np.array_equal(first.sensor_displacement, again.sensor_displacement)
    noise = (first.sensor_displacement - first.sensor_true).values
    assert noise.std() == pytest.approx(5e-5, rel=0.05)
    assert first.sizes["mode"] == 3
    for name in ("xx", "zz"):
        error = float((first.inertia_identified - first.inertia_true).sel(component=name))
        assert abs(error) < 4.0 * float(first.inertia_std.sel(component=name)) + 0.05


def test_what_is_no_mode_of_the_linear_model_gets_neither_its_name_nor_energy():
    """With two modes more asked for than the signals hold, these are harmonics; before, one was called yaw."""
    found = run(**{"identification.order": 5, "identification.way": "none"})
    labels = [n.label.partition(", ")[2] for n in SYSTEM.numbers(found) if n.label.startswith("mode ")]
    assert sorted(labels) == ["heave", "no mode of the linear model", "no mode of the linear model", "pitch", "roll"]
    own = np.isfinite(found.mode_frequency_linear.values)
    assert np.array_equal(np.isfinite(found.mode_energy), own)
    assert found.mode_frequency.values[own] == pytest.approx(found.mode_frequency_linear.values[own], rel=1e-4)
    assert float(found.mode_energy.sum()) == pytest.approx(48.72, abs=0.02)


def test_a_small_swing_is_not_told_but_enters_the_deviations():
    """Without noise the residual's deviations were 4e-6 kg m2, 7500 times less than the error."""
    for overrides in ({}, {"solver.method": "rk4", "solver.accuracy": 1e-6}):
        found = run(**overrides)
        error = np.abs(found.inertia_identified - found.inertia_true).sel(component=["xx", "zz"]).values
        assert np.all(error < 2.0 * found.inertia_std.sel(component=["xx", "zz"]).values)
        assert "swing" not in found.attrs.get("warning", "")


@pytest.mark.parametrize(
    ("excitation", "least"),
    [
        ({"excitation.force": None, "excitation.impulse": [0, -2000, 0], "sensors.noise": "0.1 mm"}, 2e-4),
        ({"excitation.force": [0, -3e5, 0], "sensors.noise": "0.1 mm", "identification.order": 3}, 5e-3),
    ],
)
def test_a_large_swing_is_told_and_widens_the_deviations(excitation, least):
    found = run(**excitation)
    pair = found.sel(component=["xx", "zz"])
    error = np.abs(pair.inertia_identified - pair.inertia_true).values
    assert np.max(error / pair.inertia_true.values) > least
    assert np.all(error < 3.0 * pair.inertia_std.values)
    assert "the swing is large: its frequencies differ" in found.attrs["warning"]
    assert "moments" in found.attrs["warning"]


def test_springs_through_their_natural_length_and_beyond_reason_are_told():
    assert "natural length" not in run(**QUICK).attrs.get("warning", "")
    loose = run(**{"excitation.force": [0, -2e5, 0], **QUICK}).attrs["warning"]
    assert "spring 1 goes through the natural length" in loose or "springs 1, " in loose
    absurd = run(**{"excitation.force": [0, -1e7, 0]})
    assert "times the natural length; no spring stays linear at this stretch" in absurd.attrs["warning"]
    assert "the linear model has no mode within 5%" in absurd.attrs["warning"]
    assert np.all(np.isnan(absurd.inertia_std))


def test_sensors_may_move_alike_without_noise():
    """A release in the plane of symmetry moves both sensors of a side alike, harmonics and all: these are no copies."""
    found = run(**{"excitation.at": [2.0, 0.0, 0.0], "identification.way": "none"})
    assert found.mode_frequency.values[:2] == pytest.approx([13.962, 16.422], abs=6e-4)
    assert "copy" not in found.attrs.get("warning", "")
    twice = {"sensors.points": [[2, 0, 0.9], [2, 0, 0.9], [2, 0, -0.9], [-2, 0, 0.9], [1, 0, 0]]}
    found = run(**twice, **{"sensors.noise": "0.1 mm", "excitation.force": [0, -1e5, 0]})
    assert "the swing is large" in found.attrs["warning"]


def test_prony_of_noisy_signals_is_told():
    noisy = {"identification.method": "prony", "sensors.noise": "0.1 mm", **QUICK}
    assert "noise biases the frequencies and decay rates of prony" in run(**noisy).attrs["warning"]
    assert "esprit gives no standard" in run(**noisy | {"identification.method": "esprit"}).attrs["warning"]
    assert "prony" not in run(**noisy | {"sensors.noise": 0}).attrs.get("warning", "")


def test_no_sum_of_energies_where_nothing_was_identified():
    found = run(**{"identification.order": 6, "sensors.rate": "8 Hz", "sensors.duration": "1.2 s"})
    assert np.all(np.isnan(found.mode_energy))
    assert not [n for n in SYSTEM.numbers(found) if "energies" in n.label]


def test_quantisation_rounds_to_its_steps():
    found = run(**{"sensors.quantisation": "0.1 mm", **QUICK})
    steps = found.sensor_displacement.values / 1e-4
    assert np.abs(steps - np.round(steps)).max() < 1e-9


def test_shapes_find_mass_and_centre():
    found = run(
        **{"identification.way": "shapes", "body.offset_x": 0.4, "body.offset_z": 0.1, "sensors.noise": "0.03 mm"}
    )
    assert float(found.mass_identified) == pytest.approx(15190.0, rel=5e-4)
    assert float(found.offset_x_identified) == pytest.approx(0.4, abs=1e-3)
    assert float(found.offset_z_identified) == pytest.approx(0.1, abs=1e-3)


@pytest.mark.slow
def test_six_modes_find_the_whole_tensor():
    found = run(
        **{
            "identification.way": "six-modes",
            "identification.order": 6,
            "body.offset_x": 0.4,
            "body.offset_z": 0.1,
            "body.height": 0.1,
            "body.products": [60.0, 200.0, -300.0],
            "excitation.force": [300.0, -900.0, 400.0],
            "sensors.directions": "horizontal and vertical",
            "sensors.duration": "40 s",
            "sensors.noise": "1 um",
        }
    )
    assert found.mode_frequency.values == pytest.approx(found.linear_frequency.values, rel=2e-4)
    scale = found.inertia_true.values.max()
    assert np.all(np.isfinite(found.inertia_identified))
    assert (found.inertia_identified - found.inertia_true).values / scale == pytest.approx(0.0, abs=2e-3)


def test_best_spring_gives_the_weakest_mode_more():
    usual = run(**{"body.offset_x": 0.8, "body.offset_z": 0.34, **QUICK})
    best = run(**{"body.offset_x": 0.8, "body.offset_z": 0.34, "excitation.at": "best", **QUICK})
    assert int(best.loaded_spring) == int(usual.best_spring)
    assert float(best.least_energy) == pytest.approx(float(usual.least_energy_best), rel=1e-12)
    assert float(best.mode_energy.min()) > 100.0 * float(usual.mode_energy.min())


@pytest.mark.parametrize(
    "start",
    [
        {"excitation.force": None, "excitation.impulse": [0.0, -300.0, 0.0]},
        {
            "excitation.force": None,
            "excitation.displacement": [0.0, 0.002, 0.0],
            "excitation.rate": [0.01, 0.0, -0.005],
        },
    ],
)
@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_impulse_and_initial_state_follow_the_linear_model(start, support):
    found = run(**start, **{"stand.support": support, "body.offset_x": 0.2, "body.offset_z": 0.1, **QUICK})
    modes = found.sizes["linear_mode"]
    linear = found.linear_energy.values[modes - 3 :]
    assert found.mode_energy.values == pytest.approx(linear, rel=0.01, abs=1e-3)


def test_least_energy_of_a_load_between_the_springs():
    """A force at (x, z): F^2 / 8 k in heave, (x / a)^2 and (z / b)^2 of it in pitch and roll."""
    place = run(**{"excitation.at": ["0.3 m", "0 m", "0.2 m"], **QUICK})
    heave = 9806.65**2 / (8.0 * 740250.0)
    assert float(place.least_energy) == pytest.approx(heave * (0.3 / 2.0) ** 2, rel=1e-5)
    assert float(place.least_energy_best) == pytest.approx(heave, rel=1e-5)
    spring = run(**{"excitation.at": ["2 m", "0 m", "0.8696 m"], "body.offset_x": 0.3, **QUICK})
    number = run(**{"excitation.at": 1, "body.offset_x": 0.3, **QUICK})
    assert float(spring.least_energy) == pytest.approx(float(number.least_energy), rel=1e-12)


def test_least_energy_of_an_initial_state():
    """4 k / 2 times y^2, (a gamma)^2, (b alpha)^2; without a load there is no best spring."""
    start = {"excitation.displacement": [0.0, 1e-3, 0.0], "excitation.rotation": [1e-3, 0.0, 5e-4]}
    found = run(**{"excitation.force": None, **start, **QUICK})
    assert float(found.least_energy) == pytest.approx(2.0 * 740250.0 * (0.8696 * 1e-3) ** 2, rel=1e-5)
    assert not {"least_energy_best", "best_spring"} & set(found.data_vars)
    assert int(found.loaded_spring) == 0


def test_modes_of_one_frequency_are_told():
    """On a square of springs, roll and pitch of equal moments are one line in the signals."""
    found = run(
        **{"stand.half_length": "1 m", "stand.half_width": "1 m", "body.inertia": [4000, 4000, 4000]},
        sensors__duration="4 s",
    )
    assert "2 of heave, roll and pitch have the same frequency, 27.20" in found.attrs["warning"]
    assert found.mode_frequency.values == pytest.approx([13.962, 27.207], abs=1e-3)
    assert np.all(np.isnan(found.inertia_identified))


@pytest.mark.slow
def test_more_modes_than_a_long_record_holds_cost_no_run():
    found = run(sensors__rate="10 Hz", sensors__duration="800 s", identification__order=10)
    assert found.attrs["status"] == "success"
    assert found.sizes["time"] == 8001
    assert np.all(np.isfinite(found.sensor_displacement))
    assert "identification: " in found.attrs["warning"]
    assert np.all(np.isnan(found.inertia_identified))


def test_inertia_whose_equations_have_no_solution_costs_no_modes(monkeypatch):
    def fails(*given):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(identify, "inertia_of", fails)
    found = run(**QUICK)
    assert "identification: the modes give no inertia by fit" in found.attrs["warning"]
    assert found.mode_frequency.values == pytest.approx([13.962, 16.422, 24.59], abs=1e-3)


def test_sensors_that_no_mode_moves_are_told():
    found = run(sensors__directions=[[1, 0, 0]] * 4, stand__support="guided", sensors__duration="4 s")
    assert "identification: no mode of the linear model moves a sensor" in found.attrs["warning"]


def test_motion_below_rounding_is_told():
    with pytest.raises(evolvent.RunFailed, match=r"below the rounding of .* stronger motion"):
        run(**{"excitation.force": [0.0, -1e-6, 0.0], **QUICK})


@pytest.mark.slow
def test_a_batch_gives_the_bits_of_single_runs():
    base = cases.load("inertia-stand", {"sensors.noise": "0.02 mm", "sensors.duration": "3 s", **QUICK})
    varied = [cases.load(base, {"body.offset_x": 0.1 * k, "sensors.seed": k}) for k in range(4)]
    together = SYSTEM.run_batch(varied)
    for case, found in zip(varied, together, strict=True):
        alone = SYSTEM.plan(case).run()
        for name in ("sensor_displacement", "mode_frequency", "inertia_identified"):
            assert np.array_equal(alone[name], found[name], equal_nan=True), name


def test_a_batch_keeps_what_can_be_run():
    """Also beside a case of the general engine, and one whose number of springs is another."""
    good = cases.load("inertia-stand", QUICK)
    falls = cases.load("inertia-stand", {"stand.support": "standing", **QUICK})
    adaptive = cases.load("inertia-stand", {"solver.method": "dopri5", **QUICK})
    five = [[2, 0, 0.9], [2, 0, -0.9], [-2, 0, -0.9], [-2, 0, 0.9], [0, 0, 1]]
    other = cases.load("inertia-stand", {"stand.points": five, **QUICK})
    found = SYSTEM.run_batch([falls, good, adaptive, other])
    assert isinstance(found[0], evolvent.InputError)
    assert [run.attrs["status"] for run in found[1:]] == ["success"] * 3
    assert [run.attrs["method"] for run in found[1:]] == ["dop853", "dopri5", "dop853"]
    assert found[2].sensor_true.values == pytest.approx(found[1].sensor_true.values, abs=5e-9)
    assert found[3].sizes["spring"] == 5


def test_roll_and_pitch_together_are_released_from_a_guided_rest():
    """Their rotations make a small one about y, which the guides hold: it is taken off."""
    start = {"excitation.force": None, "excitation.rotation": ["2 deg", 0, "1 deg"], "stand.support": "guided"}
    ask = start | {"body.offset_x": 0.3, "body.offset_z": 0.1, **QUICK}
    found = [run(**ask, **{"solver.method": method}) for method in ("dop853", "dopri5")]
    for each in found:
        assert each.displacement.values[:, [0, 2]] == pytest.approx(0.0, abs=1e-12)
    assert found[1].sensor_true.values == pytest.approx(found[0].sensor_true.values, abs=2e-8)


def test_what_signals_do_not_tell_is_said_and_left_out():
    found = run(**{"sensors.points": [[0.0, 0.0, 0.0]], "sensors.duration": "4 s", "identification.order": 3})
    assert np.all(np.isnan(found.inertia_identified))
    assert "identification: " in found.attrs["warning"]


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"stand.support": "standing"}, ["cannot hold the body", "slides", "hang it"]),
        ({"sensors.rate": "7 Hz"}, ["sensors.rate", "7 Hz", "highest mode"]),
        ({"solver.method": "rk4", "solver.step": "0.2 s"}, ["solver.step", "stability limit", "rk4"]),
        ({"solver.method": "dopri5", "solver.step": "1 ms"}, ["solver.step", "dopri5"]),
        ({"body.inertia": [3703, 90000, 43920]}, ["body.inertia", "exceeds the sum"]),
        ({"body.products": [0, 30000, 0]}, ["body.inertia", "least principal moment"]),
        ({"stand.stiffness": [1e5, 1e5]}, ["stand.stiffness", "2 values", "4 springs"]),
        ({"excitation.at": 7}, ["excitation.at", "7", "4 springs"]),
        ({"excitation.impulse": [0, 1, 0]}, ["excitation.force and excitation.impulse"]),
        ({"excitation.force": [0, 0, 0]}, ["excitation.force is zero"]),
        ({"sensors.duration": "0.1 s"}, ["sensors.duration", "samples"]),
        ({"sensors.noise": [0.1, 0.1]}, ["sensors.noise", "4 sensors"]),
        ({"stand.points": []}, ["stand.points"]),
        ({"body.mas": 3}, ["body.mas", "body.mass"]),
        ({"stand.stiffness": "740250 N"}, ["stand.stiffness", "N/m"]),
        ({"sensors.rate": "50 m"}, ["sensors.rate", "Hz"]),
        ({"sensors.duration": "1e8 s"}, ["1 / sensors.rate is 0.02 s", "too many"]),
        ({"solver.step": "1 ns"}, ["solver.step is 1e-09 s", "steps, too many"]),
        ({"sensors.points": []}, ["sensors.points"]),
        ({"sensors.directions": [[0, 0, 0]] * 4}, ["sensors.directions.0", "not all zero"]),
        ({"sensors.directions": [[0, 1, 0]]}, ["sensors.directions has 1 rows", "4 springs"]),
        (
            {"stand.support": "guided", "excitation.force": None, "excitation.displacement": [0.001, 0, 0]},
            ["initial state", "guided"],
        ),
    ],
)
def test_bad_input_is_one_clear_sentence(overrides, words):
    with pytest.raises(evolvent.InputError) as error:
        evolvent.run("inertia-stand", overrides)
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize("method", ["rk4", "modified-euler"])
def test_a_step_above_the_limit_never_succeeds(method, monkeypatch):
    """Not even where nobody looks at the limit: the energy balance tells."""
    overrides = {"solver.method": method, "sensors.rate": "8 Hz", "solver.step": "0.125 s", "sensors.duration": "60 s"}
    with pytest.raises(evolvent.InputError, match="stability limit"):
        evolvent.run("inertia-stand", overrides)
    monkeypatch.setattr(batch_cases, "stability_limit", lambda method: 10.0)
    with pytest.raises(evolvent.RunFailed, match=r"energy balance|finite"):
        evolvent.run("inertia-stand", overrides)


@pytest.mark.slow
def test_figures_motion_and_numbers_come_from_a_saved_run(tmp_path):
    from evolvent import results
    from evolvent_base import plots

    path = tmp_path / "run.nc"
    results.save(run(**QUICK), path)
    opened = evolvent.open(path)
    labels = [n.label for n in SYSTEM.numbers(opened)]
    assert "Ixx identified" in labels
    assert "sum of the modes' energies" in labels
    drawn = plots.draw(SYSTEM.figures(opened), tmp_path)
    assert len(drawn) == 6
    motion = SYSTEM.motion(opened)
    assert [line.kind for line in motion.lines] == ["spring"] * 4
    assert motion.magnification > 1.0
