"""Dispersed cases: the same bits for any number of workers, resumable, failures counted, files and messages."""

import copy
import csv
import dataclasses
import json

import numpy as np
import pytest
import xarray as xr

import cf
import evolvent
from evolvent.design import dispersions, studies
from evolvent.design.evaluator import record
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.studies import label
from evolvent.design.studies.runner import Points, runs_of
from evolvent_base.answer import Table
from evolvent_base.errors import InputError

#: A closed form stands in for the runs of this study.
STUDY = {
    "study": "spread",
    "case": "heliogyro",
    "set": {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "0.2 s", "blade.nodes": 3},
    "sample": "monte-carlo",
    "samples": 120,
    "seed": 3,
    "over": {"spool.rate": "normal(nominal, 2%)", "blade.tip_mass, blade.length": "10%"},
    "keep": ["body_rate.last"],
}


def outcomes(study, *, failed=(), empty=()):
    """Rows of a study whose result is 2 rate + mass/g, without a run."""
    axes = {axis.key: np.array(axis.values) for axis in study.axes}
    value = 2.0 * axes["spool.rate"] + 1e3 * axes["blade.tip_mass"]
    found = []
    for k in range(study.count):
        if k in failed:
            found.append(record.Outcome(index=k, status="failed", reason="the drive outruns the thread"))
            continue
        values = xr.DataArray(np.nan if k in empty else value[k], attrs={"units": "rad s-1", "long_name": "rate"})
        found.append(record.Outcome(index=k, status="success", variables={"body_rate_last": values}))
    return label.dataset(study, record.table(found)), value


@pytest.fixture(scope="module")
def read():
    """The study as it is read."""
    return studies.read(copy.deepcopy(STUDY))


def test_keys_that_share_a_draw_vary_together(read):
    rate, mass, length = (np.array(axis.values) for axis in read.axes)
    assert [axis.draw for axis in read.axes] == [0, 1, 1]
    np.testing.assert_allclose(mass / mass.mean(), length / length.mean(), rtol=2e-3)
    assert abs(np.corrcoef(rate, mass)[0, 1]) < 0.3
    again = studies.read(copy.deepcopy(STUDY))
    assert again.digests == read.digests


def test_bounds_moments_and_sensitivities(read):
    dataset, value = outcomes(read)
    found = dispersions.evaluate(dataset)
    (one,) = found.outputs
    assert (one.name, one.unit) == ("body_rate.last", "rad/s")
    assert one.moments["mean"] == pytest.approx(value.mean(), rel=1e-12)
    assert (one.upper.rank, one.lower.rank) == (2, 2)  # 93 runs and more
    assert one.upper.value == np.sort(value)[-2]
    assert one.lower.value == np.sort(value)[1]
    assert one.regression.r2 == pytest.approx(1.0, abs=1e-9)
    assert found[one.name] is one
    with pytest.raises(InputError, match="no result is called 'x'; known: body_rate"):
        found["x"]
    texts = str(found)
    assert "95/95 upper" in texts
    assert "the 2nd most extreme value" in texts


def test_tables_have_units_and_long_words_at_the_left(read):
    found = dispersions.evaluate(outcomes(read)[0])
    (one,) = found.outputs
    shown = {section.title: section for section in found.answer().sections}
    drawn = shown["Keys that vary"].blocks[0]
    assert [row[2].split()[1] for row in drawn.rows] == ["rad/s", "kg"]
    tables = {block.title: block for block in shown["body_rate.last [rad/s]"].blocks if isinstance(block, Table)}
    quantiles, extremes = tables["Quantiles, with intervals of 95 %"], tables["Extremes"]
    assert quantiles.heads == ("probability", "quantile, rad/s", "from, rad/s", "to, rad/s")
    assert (extremes.heads, extremes.words) == (("", "keys", "case", "value, rad/s"), 2)
    assert [row[3] for row in extremes.rows] == [f"{one.moments[key]:.5g}" for key in ("least", "largest")]


def test_failed_runs_count_as_beyond_the_bound(read):
    failed, empty = (4, 17), (33,)
    dataset, value = outcomes(read, failed=failed, empty=empty)
    found = dispersions.evaluate(dataset)
    (one,) = found.outputs
    assert [one.case for one in found.failures] == list(failed)
    assert found.failures[0].keys["spool.rate"] == read.axes[0].values[4]
    assert one.lacking == 3
    assert np.isnan(one.upper.value)
    assert "3 of 120 runs have no value and count as beyond the bound" in one.upper.why
    texts = str(found)
    assert "2 of 120 runs failed; their probability is between 0.2 % and 5.9 %; every bound counts them as" in texts
    assert "body_rate.last has no value in 1 runs that did not fail" in texts
    assert "2 runs failed\n" in texts
    assert "spool.rate = " in texts
    page = found._repr_html_()
    assert page.count("<img") == 1
    assert "<strong>Warning:</strong> 2 cases failed: " in page
    kept = dispersions.evaluate(dataset, coverage=0.9)
    finite = np.sort(np.delete(value, [*failed, *empty]))
    assert kept.outputs[0].upper.rank == 7
    assert kept.outputs[0].upper.value == finite[117 - (7 - 3)]


@pytest.mark.slow
def test_other_samples_give_no_bound():
    corners = {**copy.deepcopy(STUDY), "sample": "corners"}
    del corners["samples"], corners["seed"]
    corners = studies.read(corners)
    assert corners.count == 4
    dataset, value = outcomes(corners)
    (one,) = dispersions.evaluate(dataset).outputs
    assert one.extremes == (0, 3)
    assert one.values[3] == value.max()
    assert "not independent" in one.upper.why
    saltelli = studies.read({**copy.deepcopy(STUDY), "sample": "saltelli", "samples": 32})
    assert saltelli.count == 128
    (one,) = dispersions.evaluate(outcomes(saltelli)[0]).outputs
    assert one.indices.rows == 32
    assert one.seen.sum() == 64
    assert one.indices.first.sum() == pytest.approx(1.0, abs=0.2)


@pytest.mark.slow
def test_files_of_a_dispersion(read, tmp_path):
    dataset, value = outcomes(read, failed=(4,))
    found = dispersions.evaluate(dataset)
    found.save(tmp_path / "d.csv")
    with (tmp_path / "d.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0][:4] == ["case", "status", "reason", "spool.rate [rad/s]"]
    assert rows[0][-1] == "body_rate.last [rad/s]"
    assert len(rows) == 121
    assert rows[5][1:3] == ["failed", "the drive outruns the thread"]
    assert float(rows[7][-1]) == value[6]
    found.save(tmp_path / "d.nc")
    assert cf.faults(tmp_path / "d.nc") == []
    with xr.open_dataset(tmp_path / "d.nc", engine="h5netcdf") as there:
        assert json.loads(there.attrs["dispersion"])["body_rate.last"]["lacking"] == 1
        np.testing.assert_array_equal(there["body_rate_last"], dataset["body_rate_last"])
        assert "spool.rate" in there
    found.report(tmp_path / "d.html")
    page = (tmp_path / "d.html").read_text()
    assert page.count("<img ") == 2
    assert "the drive outruns the thread" in page
    assert 'src="http' not in page


@pytest.mark.slow
@pytest.mark.release
def test_the_same_bits_for_any_number_of_workers(tmp_path):
    """As of sweeps (`tests/studies/test_sweep.py`)."""
    study = {**copy.deepcopy(STUDY), "samples": 8}
    here = evolvent.disperse(study, coverage=0.5, confidence=0.9)
    spread = evolvent.disperse({**study, "batch": 2}, output=tmp_path / "s", workers=2, coverage=0.5, confidence=0.9)
    xr.testing.assert_equal(spread.dataset, here.dataset)


@pytest.mark.slow
def test_the_same_bits_after_an_interruption(tmp_path):
    study = {**copy.deepcopy(STUDY), "samples": 8}
    here = evolvent.disperse(study, coverage=0.5, confidence=0.9)
    assert here.outputs[0].upper.confidence >= 0.9

    class Stop(Exception):
        pass

    def stop(done, count):
        if done >= 3:
            raise Stop

    with pytest.raises(Stop):
        evolvent.disperse({**study, "batch": 1}, output=tmp_path / "r", progress=stop)
    seen = []
    again = evolvent.disperse({**study, "batch": 1}, output=tmp_path / "r", progress=lambda *n: seen.append(n))
    assert seen[0][0] >= 3
    xr.testing.assert_equal(again.dataset, here.dataset)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"sample": "grid"}, "samples is given, but sample: grid takes the values listed"),
        ({"sample": "sobol"}, "samples is 120; with sample: sobol it must be a power of 2, such as 128"),
        (
            {"over": {"spool.rate": "norml(3, 1)"}},
            "over.spool.rate is 'norml(3, 1)'; no distribution is called 'norml'",
        ),
        ({"over": {"spool.rat": "5%"}}, "over: unknown key 'spool.rat'; did you mean 'spool.rate'?"),
        ({"over": {"spool.rate, spool.rate": "5%"}}, "over names 'spool.rate' twice"),
        ({"over": {"blade.tip_mass": "normal(nominal, 100%)"}}, "blade.tip_mass is "),
        (
            {"correlation": [["spool.rate", "blade.lenth", 0.5]]},
            "names 'blade.lenth', which over does not vary; did you",
        ),
        ({"correlation": [["spool.rate", "blade.length", 1.5]]}, "correlation.0.2 is 1.5; it must be a number from -1"),
        ({"correlation": [["blade.tip_mass", "blade.length", 0.5]]}, "which share one draw already"),
        ({"correlation": "high"}, "correlation is 'high'; it must be a list of [key, key, value]"),
        ({"correlation": [["spool.rate", "blade.length"]]}, "it must be [key, key, value]"),
        ({"samples": 10**9}, "samples is 1000000000; it must be a whole number"),
    ],
)
def test_what_cannot_be_drawn_is_refused(change, sentence):
    with pytest.raises(InputError) as refused:
        studies.read({**copy.deepcopy(STUDY), **change})
    assert sentence in str(refused.value)


def test_correlations_that_contradict_one_another_are_refused():
    keys = ["spool.rate", "blade.length", "blade.tip_mass"]
    study = copy.deepcopy(STUDY) | {"over": dict.fromkeys(keys, "1%")}
    study["correlation"] = [[keys[0], keys[1], 0.9], [keys[1], keys[2], 0.9], [keys[0], keys[2], -0.9]]
    with pytest.raises(InputError, match="its matrix is not positive semi-definite"):
        studies.read(study)


@pytest.mark.parametrize("value", [0.0, 1.0, 95, "95", True, float("nan")])
def test_coverage_and_confidence_are_shares(value):
    with pytest.raises(InputError, match="must be above 0 and below 1"):
        evolvent.disperse(copy.deepcopy(STUDY), coverage=value)


def test_a_study_that_draws_nothing_is_no_dispersion():
    study = studies.read({"case": "heliogyro", "over": {"blade.nodes": [3, 4]}, "keep": ["body_rate.last"]})
    outcome = [record.Outcome(index=k, status="success") for k in range(2)]
    with pytest.raises(InputError, match="sample: grid, which draws nothing"):
        dispersions.evaluate(label.dataset(study, record.table(outcome)))


def test_a_sample_that_the_case_refuses_is_a_failed_run(read):
    mass = read.axes[1]
    wrong = dataclasses.replace(mass, values=(-1.0, *mass.values[1:]))
    study = dataclasses.replace(read, axes=(read.axes[0], wrong, *read.axes[2:]))
    (found,) = Evaluator(runs_of(study, ".")).of([Points(study)[0]])
    assert found.status == "failed"
    assert found.reason.startswith("blade.tip_mass is -1.0; it must be")


@pytest.mark.parametrize(("case", "key", "name"), [
    ("solar-array", "parts.hinge 1.stiffness", "hinge 1.angle"), ("heliogyro", "spool.rate", "body_rate"),
])  # fmt: skip
def test_a_value_at_every_sample_is_refused_before_any_run(case, key, name):
    study = {"case": case, "sample": "monte-carlo", "samples": 3, "over": {key: "1%"}, "keep": [f"{name}.last", name]}
    with pytest.raises(InputError) as refused:
        evolvent.disperse(study, progress=lambda done, count: pytest.fail("a run was made"))
    assert f"keep holds '{name}', which has a value at every sample" in str(refused.value)
    assert f"write '{name}.last', or another of .first" in str(refused.value)
