"""Studies whose cases run in stages: each stage starts from the end of the one before."""

import copy
import os
import pathlib
import shutil

import h5py
import numpy as np
import pytest
import xarray as xr
import yaml
from click.testing import CliRunner

import evolvent
from evolvent import results
from evolvent.commands.sweep import sweep as command
from evolvent.design import studies
from evolvent.design.studies import draw, store
from evolvent_base.errors import InputError
from evolvent_papers import wrapped_rib

SMALL = {"rib.elements": 8, "rib.length": 3, "output.every": "0.1 s"}
WIND = {"phase": "wind", "solver.duration": "1 s"}
DEPLOY = {"phase": "deploy", "drive": None, "solver.duration": "0.5 s"}
PEAK = "tip_speed_peak_time"
STUDY = {
    "study": "chain",
    "case": "wrapped-rib",
    "set": SMALL,
    "stages": [{"name": "wind", "set": WIND}, {"name": "deploy", "set": DEPLOY}],
    "over": {"deploy.damping.alpha": [0, "0.5 1/s"]},
    "keep": ["wind.tip_radius", "wind.rib-1.energy_elastic.last", "deploy.tip_radius", "deploy.steps"],
}


@pytest.fixture
def chain():
    """A copy of the study that may be changed."""
    return copy.deepcopy(STUDY)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The folder of the study, swept here, and its results."""
    folder = tmp_path_factory.mktemp("chain") / "out"
    return folder, studies.sweep(STUDY, output=folder)


@pytest.fixture
def single(chain):
    """The study of one case."""
    return chain | {"over": {"deploy.damping.alpha": ["0.5 1/s"]}}


@pytest.fixture(scope="module")
def of_single():
    """The results of the study of one case."""
    return studies.sweep(copy.deepcopy(STUDY) | {"over": {"deploy.damping.alpha": ["0.5 1/s"]}})


@pytest.fixture
def calls(replace_run):
    """Stages that are computed, in order; set `stop` on it to end the process at the n-th."""

    class Calls(list):
        stop = -1

    found = Calls()

    def counted(case, go_on):
        found.append(case.phase)
        if len(found) == found.stop:
            raise KeyboardInterrupt
        return go_on()

    replace_run(wrapped_rib, counted)
    return found


@pytest.mark.slow
def test_a_stage_starts_from_the_end_of_the_one_before(reference, tmp_path):
    folder, found = reference
    assert (found.status == "success").all()
    assert dict(found.sizes) == {
        "deploy.damping.alpha": 2, "wind_time": 11, "wind_rib": 1, "deploy_time": 6, "deploy_rib": 1,
    }  # fmt: skip
    assert found.deploy_tip_radius.values[:, 0] == pytest.approx(found.wind_tip_radius.values[:, -1], abs=1e-12)
    assert found.deploy_tip_radius.attrs["long_name"].startswith("deploy: ")
    # as by hand
    wind = evolvent.run("wrapped-rib", SMALL | WIND)
    results.save(wind, tmp_path / "wind.nc")
    last = evolvent.run("wrapped-rib", SMALL | DEPLOY | {"start": str(tmp_path / "wind.nc"), "damping.alpha": 0.5})
    np.testing.assert_array_equal(found.wind_tip_radius.values[1], wind.ev.regular().tip_radius.values)
    np.testing.assert_array_equal(found.deploy_tip_radius.values[1], last.tip_radius.values)
    # the runs are kept, each a file like any other
    names = ["000000-deploy.nc", "000000-wind.nc", "000001-deploy.nc", "000001-wind.nc"]
    assert sorted(os.listdir(folder / "stages")) == names
    kept = results.open(folder / "stages" / "000001-deploy.nc")
    assert wrapped_rib.figures(kept)
    assert float(kept.energy_losses.sel(cause="mass damping")[-1]) > 0.0


@pytest.mark.release
def test_the_same_bits_on_processes(reference, tmp_path):
    """As of sweeps without stages (`test_sweep.py`)."""
    xr.testing.assert_identical(studies.sweep(STUDY, output=tmp_path / "two", workers=2), reference[1])


@pytest.mark.slow
def test_the_same_bits_from_the_text(of_single):
    xr.testing.assert_identical(studies.sweep(yaml.safe_load(of_single.attrs["study"])), of_single)


@pytest.mark.slow
def test_a_stage_that_is_done_is_not_computed_again(single, of_single, calls, tmp_path):
    calls.stop = 2
    with pytest.raises(KeyboardInterrupt):
        studies.sweep(single, output=tmp_path / "out")
    assert os.listdir(tmp_path / "out" / "stages") == ["000000-wind.nc"]
    found = studies.sweep(single, output=tmp_path / "out")
    assert calls == ["wind", "deploy", "deploy"]
    xr.testing.assert_identical(found, of_single)


def cut(path):
    path.write_bytes(path.read_bytes()[:1000])


def scaled(path):
    """Two percent more, in a file that can be read."""
    with h5py.File(path, "r+") as file:
        file["tip_radius"][...] *= 1.02


def without_digest(path):
    scaled(path)
    with h5py.File(path, "r+") as file:
        del file.attrs[results.DIGEST]


@pytest.mark.slow
@pytest.mark.parametrize("damage", [cut, scaled, without_digest])
def test_a_damaged_or_altered_run_is_computed_again(single, of_single, reference, calls, tmp_path, damage):
    with store.opened(tmp_path / "out", studies.read(single)):  # as after an interruption, the first stage done
        kept = tmp_path / "out" / "stages" / "000000-wind.nc"
        kept.parent.mkdir(exist_ok=True)
        shutil.copy(reference[0] / "stages" / "000001-wind.nc", kept)
    damage(kept)
    said = []
    found = studies.sweep(single, output=tmp_path / "out", report=said.append)
    assert calls == ["wind", "deploy"]
    xr.testing.assert_identical(found, of_single)
    assert said == [f"{str(kept)!r} is damaged or was altered; the run of this stage is computed again"]


@pytest.mark.slow
def test_a_stage_that_fails_ends_its_case(chain, replace_run, tmp_path):
    def failing(case, go_on):
        found = go_on()
        if case.phase == "wind" and case.damping.alpha == 0.0:
            found.attrs |= {"status": "failed", "message": "it tore"}
        return found

    replace_run(wrapped_rib, failing)
    chain["over"] = {"damping.alpha": [0, "0.2 1/s"]}
    found = studies.sweep(chain, output=tmp_path / "out")
    assert found.status.values.tolist() == ["failed", "success"]
    assert found.reason.values.tolist() == ["stage 'wind': it tore", ""]
    assert np.isnan(found.deploy_tip_radius.values[0]).all()
    assert np.isfinite(found.deploy_tip_radius.values[1]).all()
    names = ["000000-wind.nc", "000001-deploy.nc", "000001-wind.nc"]
    assert sorted(os.listdir(tmp_path / "out" / "stages")) == names

    def refused(case, go_on):
        if case.phase == "deploy":
            raise InputError("no such rib")
        return go_on()

    replace_run(wrapped_rib, refused)
    found = studies.sweep(chain)
    assert found.reason.values.tolist() == ["stage 'deploy': no such rib"] * 2
    assert np.isfinite(found.wind_tip_radius.values).all()  # what was reached is kept


@pytest.mark.slow
def test_three_stages_and_names_that_are_keys_too(chain):
    """A stage may be called as a section of the case is."""
    chain["stages"].insert(1, {"name": "hold", "set": {"phase": "hold", "solver.duration": "auto"}})
    chain["over"] = {"hold.hold.time": ["0.5 s", "1 s"]}
    chain["keep"] = ["hold.tip_radius.last", "deploy.tip_radius.first"]
    found = studies.sweep(chain)
    assert found["hold.hold.time"].values.tolist() == [0.5, 1.0]
    np.testing.assert_array_equal(found.hold_tip_radius_last, found.deploy_tip_radius_first)


@pytest.mark.slow
def test_what_is_kept_by_default(chain):
    del chain["keep"]
    chain["over"] = {"rib.thickness": ["0.3 mm"]}
    found = studies.sweep(chain)
    assert {"wind_tip_speed_peak", "deploy_tip_speed_peak", "wind_steps", "deploy_end_coordinates"} <= set(
        found.data_vars
    )
    assert not any("time" in str(dim) for dim in found.dims)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"stages": {"name": "wind"}}, "stages is {'name': 'wind'}; it must be a list of two or more"),
        ({"stages": [{"name": "wind"}]}, "it must be a list of two or more"),
        ({"stages": [{"name": "a"}, {"nmae": "b"}]}, "unknown key 'stages.1.nmae'; did you mean 'name'?"),
        ({"stages": [{"name": "a"}, {"set": {}}]}, "stages.1.name is empty; it must be a word"),
        ({"stages": [{"name": "a"}, {"name": "a/b"}]}, "stages.1.name is 'a/b'; it must be a word"),
        ({"stages": [{"name": "a"}, {"name": "a"}]}, "stages.1.name is 'a', as of a stage before it"),
        ({"stages": [{"name": "a"}, {"name": "b", "set": [1]}]}, "stages.1.set is [1]; it must be a mapping"),
        ({"case": "heliogyro"}, "no run of 'heliogyro' can start from another"),
        ({"set": {"start": "wound"}}, "set gives 'start', but a stage starts from the end"),
        (
            {"stages": [{"name": "wind", "set": WIND}, {"name": "deploy", "set": DEPLOY | {"start": "wound"}}]},
            "stages.1.set gives 'start', but a stage starts from the end",
        ),
        ({"over": {"wind.start": ["a.nc", "b.nc"]}}, "over varies 'wind.start', but a stage starts from the end"),
        ({"keep": ["tip_radius.last"]}, "keep holds 'tip_radius.last'; it must begin with a stage's name, such as d"),
        ({"keep": ["deploy.tip_radius.lats"]}, "stage 'deploy': keep holds 'tip_radius.lats'; after the variable, did"),
        ({"keep": ["wind.rib-1.tip_sped"]}, "stage 'wind': keep holds 'rib-1.tip_sped'; no variable is called"),
        ({"over": {"depoly.damping.alpha": [1]}}, "unknown key 'depoly.damping.alpha'"),
        ({"over": {"solver.duration": [1, 2]}}, "over varies 'solver.duration', which the stage 'wind' sets"),
        ({"over": {"deploy.phase": ["wind"]}}, "over varies 'deploy.phase', which the stage 'deploy' sets"),
        (
            {"stages": [{"name": "wind", "set": WIND}, {"name": "deploy", "set": {"phase": "deploy"}}]},
            "case 0 of the study (deploy.damping.alpha: 0), stage 'deploy': drive.kind is 'torque'; in phase 'deploy'",
        ),
        (
            {"over": {"deploy.rib.length": [3, 4]}},
            "(deploy.rib.length: 4), stage 'deploy': rib.length is 4, but the stage before it, from which this one "
            "starts, has 3",
        ),
        (
            {"stages": [{"name": "wind", "set": WIND}, {"name": "open", "set": DEPLOY | {"phase": "depoly"}}],
             "over": {"rib.thickness": ["0.3 mm"]}, "keep": []},
            "stage 'open': phase is 'depoly'; did you mean 'deploy'?",
        ),
    ],
)  # fmt: skip
def test_bad_stages_are_refused_before_anything_runs(chain, change, sentence):
    with pytest.raises(InputError) as refused:
        studies.read(chain | change)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_names_to_keep_are_checked_by_the_first_runs(chain):
    with pytest.raises(
        InputError, match=r"keep holds 'deploy.tip_radiu.last', which no run has; did you mean 'deploy.tip_radius"
    ):
        studies.sweep(chain | {"keep": ["wind.tip_radius.last", "deploy.tip_radiu.last"]})


@pytest.mark.slow
def test_the_command_draws_what_varies(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pathlib.Path("s.yaml").write_text(yaml.safe_dump(STUDY, sort_keys=False))
    done = CliRunner().invoke(command, ["s.yaml", "--workers", "1", "--figures", "f"], catch_exceptions=False)
    assert done.stdout.splitlines() == [
        "evolvent study chain: 2 cases, 2 run now",
        "results: chain/results.zarr",
        "runs of the stages: chain/stages, each a file for evolvent plot",
        "figures: 2 in f",
    ]
    assert sorted(os.listdir("f")) == ["deploy_steps.png", "deploy_tip_radius.png"]  # the winding does not vary


@pytest.mark.slow
def test_figures_of_all_stages_where_all_vary(chain):
    chain["over"] = {"rib.thickness": ["0.3 mm", "0.4 mm"]}
    chain["keep"] = [f"{stage}.{name}" for stage in ("wind", "deploy") for name in ("rib-1.tip_speed", PEAK)]
    swept = studies.sweep(chain)
    names = {"wind_rib_1_tip_speed", "wind_peak", "deploy_rib_1_tip_speed", "deploy_peak"}
    assert set(draw.of_system(swept)) == names
    found = wrapped_rib.study_figures(swept)
    runs, string = found["wind_peak"].panels[0].lines
    assert len(runs.y) == len(string.y) == 2
    assert len(found["deploy_peak"].panels[0].lines) == 1  # no string there
