"""Sweeps: the same bits however they are computed, failures kept, nothing lost at any end of the process."""

import concurrent.futures
import contextlib
import os
import pathlib
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest
import xarray as xr
import yaml
from click.testing import CliRunner

import evolvent
from evolvent.commands.sweep import sweep as command
from evolvent.design import studies
from evolvent.design.evaluator import evaluator as ev, pools
from evolvent.design.evaluator.log import Log
from evolvent.design.evaluator.task import compute
from evolvent.design.studies import draw, store
from evolvent.design.studies.runner import Points, runs_of
from evolvent_base.errors import InputError
from evolvent_papers import heliogyro

MAIN = "from evolvent.commands.sweep import sweep; sweep()"


def dump(study):
    """YAML of a study, its keys in their order."""
    return yaml.safe_dump(study, sort_keys=False)


def same(a, b):
    """Whether two datasets are equal bit for bit, attributes and all."""
    xr.testing.assert_identical(a, b)
    for name in a.variables:
        assert a[name].dtype == b[name].dtype
        assert a[name].values.tobytes() == b[name].values.tobytes(), name


def children():
    """Processes that this one has started."""
    return psutil.Process().children(recursive=True)


@pytest.fixture
def long_study(study):
    """A study of 12 cases, one a task, in each of which some time goes by."""
    study["set"]["output.every"] = "0.2 ms"
    study["over"] = {"spool.rate": {"from": 3, "to": 4, "points": 6}, "blade.nodes": [3, 5]}
    study["batch"] = 1
    return study


@pytest.fixture
def reference(whole):
    """A copy of the results of the study."""
    return whole.copy(deep=True)


@pytest.mark.slow
def test_results_are_labelled(study, reference, tmp_path):
    assert dict(reference.sizes) == {"spool.rate": 3, "blade.nodes": 2, "blade_1_node": 5}
    assert reference["spool.rate"].units == "rad/s"
    assert reference["spool.rate"].long_name == "spool.rate"
    assert reference.body_rate_last.units == "rad s-1"
    assert (reference.status == "success").all()
    assert (reference.reason == "").all()
    one = evolvent.run("heliogyro", {**study["set"], "spool.rate": 3.5, "blade.nodes": 5})
    at = reference.sel({"spool.rate": 3.5, "blade.nodes": 5})
    assert float(at.body_rate_last) == float(one.body_rate[-1])
    np.testing.assert_array_equal(at.blade_1_lag_max, one["blade-1"].lag.max("time"))
    assert {"study", "versions", "sources", "version", "system"} <= set(reference.attrs)
    same(studies.sweep(yaml.safe_load(reference.attrs["study"])), reference)


def test_the_same_bits_in_batches_and_from_a_folder(study, reference, swept):
    xr.testing.assert_equal(studies.open(swept), reference)
    seen = []
    again = studies.sweep(study | {"batch": 2}, output=swept, progress=lambda *n: seen.append(n))
    same(again, studies.open(swept))
    assert seen == [(6, 6)]
    batched = studies.sweep(study | {"batch": 4})
    xr.testing.assert_equal(batched, reference)


def test_failed_cases_keep_their_reason(study):
    study["over"] = {"spool.rate": ["3.5 rad/s", "2000 rad/s"]}
    found = studies.sweep(study)
    assert found.status.values.tolist() == ["success", "failed"]
    assert "the drive outruns the thread" in str(found.reason[1].item())
    assert np.isfinite(found.body_rate_last[0])
    assert np.isnan(found.body_rate_last[1])


def test_a_system_may_run_batches(study, reference, monkeypatch):
    sizes = []

    def run_batch(batch):
        sizes.append(len(batch))
        return [heliogyro.SYSTEM.plan(case).run() for case in batch]

    monkeypatch.setattr(heliogyro.SYSTEM, "run_batch", run_batch, raising=False)
    found = studies.sweep(study | {"batch": 4})
    assert sizes == [4, 2]
    xr.testing.assert_equal(found, reference)


def test_a_batch_that_raises_is_taken_apart(study, reference, monkeypatch):
    def run_batch(batch):
        raise ZeroDivisionError

    monkeypatch.setattr(heliogyro.SYSTEM, "run_batch", run_batch, raising=False)
    xr.testing.assert_equal(studies.sweep(study), reference)


def test_whatever_a_case_raises_is_its_reason(study, replace_run):
    def run(case, go_on):
        if case.blade.nodes == 3:
            raise ZeroDivisionError("in the middle")
        return go_on()

    replace_run(heliogyro, run)
    found = studies.sweep(study)
    assert set(found.reason.values[:, 0]) == {"ZeroDivisionError: in the middle"}
    assert (found.status[:, 1] == "success").all()


def test_names_to_keep_are_checked_by_the_first_runs(study):
    with pytest.raises(InputError, match=r"keep holds .*; no variable is called 'body_rat'; did you mean 'body_rate'"):
        studies.sweep(study | {"keep": ["body_rat.last"]})


# ------------------------------------------------------------------------------------------------ the folder


@pytest.mark.slow
def test_a_folder_is_not_shared(study, tmp_path, monkeypatch):
    studies.sweep(study, output=tmp_path / "s")
    other = {**study, "over": {"spool.rate": [3.0, 4.0]}}
    with pytest.raises(InputError, match="holds the study 'short' with other cases; give another folder with -o"):
        studies.sweep(other, output=tmp_path / "s")
    with pytest.raises(InputError, match="with other kept variables"):
        studies.sweep({**study, "keep": ["steps"]}, output=tmp_path / "s")
    monkeypatch.setattr(store, "sources", lambda: "other")
    with pytest.raises(InputError, match="with other sources"):
        studies.sweep(study, output=tmp_path / "s")
    monkeypatch.undo()
    (tmp_path / "f").mkdir()
    (tmp_path / "f" / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="holds other files and no study"):
        studies.sweep(study, output=tmp_path / "f")
    with pytest.raises(InputError, match="is not a folder"):
        studies.sweep(study, output=tmp_path / "f" / "letter.txt")
    shutil.copytree(tmp_path / "s", tmp_path / "t")
    for path in (tmp_path / "t" / "results.zarr", tmp_path / "t" / "study.json"):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    with pytest.raises(InputError, match="holds other files and no study"):
        studies.sweep(study, output=tmp_path / "t")
    with store.opened(tmp_path / "s", studies.read(study)), pytest.raises(InputError, match="another process works"):
        studies.sweep(study, output=tmp_path / "s")


def test_folders_that_cannot_be_opened(study, tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        studies.open(tmp_path / "none")
    with pytest.raises(InputError, match="not the folder of a study"):
        studies.open(tmp_path)
    with store.opened(tmp_path / "s", studies.read(study)):
        pass
    with pytest.raises(InputError, match="is not finished; sweep it again"):
        studies.open(tmp_path / "s")
    studies.sweep(study, output=tmp_path / "s")
    (tmp_path / "s" / "results.zarr" / ".zmetadata").write_text("{")
    with pytest.raises(InputError, match="is missing or damaged"):
        studies.open(tmp_path / "s")
    (tmp_path / "s" / "study.json").write_text("{}")
    with pytest.raises(InputError, match="does not describe a study"):
        studies.open(tmp_path / "s")


def without_results(swept, folder):
    """A copy of a finished study without its results."""
    shutil.copytree(swept, folder)
    shutil.rmtree(folder / "results.zarr")
    return folder / "cases.sqlite"


def changed(log, statement):
    """A log that another program has changed."""
    with contextlib.closing(sqlite3.connect(log)) as file, file:
        file.execute(statement)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damage", "done"),
    [
        (lambda log: changed(log, "UPDATE evaluations SET content = zeroblob(1000) WHERE number = 2"), 4),
        (lambda log: changed(log, "UPDATE evaluations SET keys = '[0, 3]' WHERE number = 2"), 4),
        (
            lambda log: changed(
                log, "INSERT INTO evaluations SELECT 4, keys, content, digest FROM evaluations LIMIT 1"
            ),
            6,
        ),
        (lambda log: changed(log, "CREATE VIEW other AS SELECT * FROM evaluations"), 0),
        (lambda log: log.write_bytes(log.read_bytes()[:5000]), None),
        (lambda log: log.write_bytes(b"all is well" * 400), 0),
    ],
)
def test_a_damaged_log_loses_only_what_is_damaged(study, reference, swept, tmp_path, damage, done):
    log = without_results(swept, tmp_path / "s")
    damage(log)
    reports, seen = [], []
    study["batch"] = 2
    again = studies.sweep(study, output=tmp_path / "s", report=reports.append, progress=lambda *n: seen.append(n))
    xr.testing.assert_equal(again, reference)
    assert done is None or seen[0] == (done, 6)
    assert seen[-1] == (6, 6)
    assert len(reports) == 1
    assert "cases.sqlite' is damaged or altered, and computed again" in reports[0]
    (log.parent / "results.zarr").rename(tmp_path / "away")
    studies.sweep(study, output=tmp_path / "s", report=reports.append)
    assert len(reports) == 1  # the log is whole again


# ------------------------------------------------------------------------------------------------ ends of processes


def start(folder, *words):
    """The command in its own process group."""
    return subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", MAIN, "study.yaml", "-o", "out", *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def wait_for(condition, seconds=180.0):
    """Until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def recorded(folder):
    """Cases of every record of a folder's log."""
    with contextlib.closing(Log(folder / "cases.sqlite")) as log:
        return [tuple(keys) for keys, _ in log.found]


def started(folder, records=3):
    """Whether some cases are done, found in a copy of the log, which the process that writes it has alone."""
    out, copy = folder / "out", folder / "copy"

    def is_so():
        shutil.rmtree(copy, ignore_errors=True)
        copy.mkdir()
        for path in out.glob("cases.sqlite*"):
            shutil.copy(path, copy)
        return len(recorded(copy)) >= records

    return is_so


@pytest.mark.slow
def test_kill_9_loses_nothing_computes_nothing_twice_and_leaves_no_worker(long_study, tmp_path):
    reference = studies.sweep(long_study)
    (tmp_path / "study.yaml").write_text(dump(long_study))
    process = start(tmp_path, "--workers", "2")
    wait_for(started(tmp_path))
    family = psutil.Process(process.pid).children(recursive=True)
    assert len(family) >= 2
    process.kill()
    process.communicate(timeout=30)
    wait_for(lambda: not any(p.is_running() and p.status() != psutil.STATUS_ZOMBIE for p in family), 20.0)
    first = recorded(tmp_path / "out")
    assert 3 <= len(first) < 12
    seen = []
    again = studies.sweep(long_study, output=tmp_path / "out", progress=lambda *n: seen.append(n))
    assert seen[0] == (len(first), 12)
    assert len(seen) == 1 + 12 - len(first)
    every = recorded(tmp_path / "out")
    assert every[: len(first)] == first
    assert sorted(case for cases in every for case in cases) == list(range(12))
    same(again, reference)


@pytest.mark.slow
@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_stops_and_says_how_to_go_on(long_study, tmp_path, workers):
    (tmp_path / "study.yaml").write_text(dump(long_study))
    process = start(tmp_path, "--workers", workers)
    wait_for(started(tmp_path))
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    *estimate, last = err.splitlines()  # a slow machine shows an estimate of the time first
    assert last.startswith("evolvent: stopped; ")
    assert "of 12 cases are kept in out, and the same command continues from there" in err
    assert all(" cases of about " in line or line.startswith("evolvent: running cases: ") for line in estimate), err
    done = len(recorded(tmp_path / "out"))
    assert f"; {done} of 12" in err
    assert out == ""


@pytest.mark.slow
def test_a_worker_that_dies_is_replaced(long_study, tmp_path):
    """The bits are those of one process, and no worker is left."""
    reports, victims = [], []
    before = set(children())

    def progress(done, count):
        if done >= 2 and not victims:
            workers = [p for p in set(children()) - before if "spawn_main" in " ".join(p.cmdline())]
            victims.append(workers[0])
            workers[0].kill()

    long_study["set"]["output.every"] = "0.1 ms"
    long_study["over"]["spool.rate"]["points"] = 4
    found = studies.sweep(long_study, output=tmp_path / "s", workers=2, progress=progress, report=reports.append)
    assert victims
    assert (found.status == "success").all()
    assert any("a worker stopped" in sentence for sentence in reports)
    same(found, studies.sweep(long_study))
    same(found, studies.open(tmp_path / "s"))
    wait_for(lambda: not [p for p in set(children()) - before if "resource_tracker" not in " ".join(p.cmdline())], 20.0)


class _Deadly(pools.Pool):
    """A pool whose workers die of one case."""

    workers = 2

    def __init__(self):
        self.batches = []

    def submit(self, task):
        self.batches.append(tuple(task.numbers))
        future = concurrent.futures.Future()
        if 2 in task.numbers:
            future.set_exception(concurrent.futures.BrokenExecutor())
        else:
            future.set_result(compute(task))
        return future

    def close(self, *, at_once=False):
        """Nothing is open."""


def test_a_case_that_ends_its_process_is_given_up_alone(study, reference):
    asked = studies.read(study | {"batch": 2})
    evaluator = ev.Evaluator(runs_of(asked, "."), batch=2, one_thread=True)
    evaluator.pool = pool = _Deadly()
    evaluator.of(Points(asked), numbered=True)
    rows = evaluator.table()
    assert rows.cases == tuple(range(6))
    assert [c for c, s in zip(rows.cases, rows.status, strict=True) if s == "failed"] == [2]
    assert "died" in rows.reason[2]
    assert pool.batches.count((2,)) == 2
    assert rows.columns["body_rate_last"].values[3] == reference.body_rate_last.values.flat[3]


# ------------------------------------------------------------------------------------------------ a scheduler


def test_workers_of_a_scheduler(study, reference):
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0") as cluster:
        reports = []
        found = studies.sweep(study, scheduler=cluster.scheduler_address, workers=None, report=reports.append)
    same(found, reference)
    assert reports == []


def test_schedulers_and_workers_that_cannot_be_used(study, monkeypatch):
    with pytest.raises(InputError, match="workers is 0; it must be a whole number from 1"):
        studies.sweep(study, workers=0)
    with pytest.raises(InputError, match="both given"):
        studies.sweep(study, workers=2, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(InputError, match="cannot reach a Dask scheduler at 'nonsense://x'"):
        studies.sweep(study, scheduler="nonsense://x")


def test_without_its_packages_a_sweep_says_what_to_install(study, monkeypatch):
    import importlib.util

    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "zarr" else find(name))
    with pytest.raises(InputError, match=r"a sweep needs zarr; install them with: pip install 'evolvent\[sweep\]'"):
        studies.sweep(study)


# ------------------------------------------------------------------------------------------------ command, figures


@pytest.mark.slow
def test_the_command(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pathlib.Path("s.yaml").write_text(dump(study))
    done = CliRunner().invoke(command, ["s.yaml", "--figures", "f"], catch_exceptions=False)
    assert done.exit_code == 0
    assert done.stdout.splitlines() == [
        "evolvent study short: 6 cases, 6 run now",
        "results: short/results.zarr",
        "figures: 3 in f",
    ]
    assert {p.name for p in (tmp_path / "f").iterdir()} == {"body_rate_last.png", "blade_1_lag_max.png", "steps.png"}
    done = CliRunner().invoke(command, ["s.yaml"], catch_exceptions=False)
    assert "6 cases, 0 run now, 6 of them before" in done.stdout
    done = CliRunner().invoke(command, ["s.yaml", "--quiet"], catch_exceptions=False)
    assert done.output == ""
    assert isinstance(CliRunner().invoke(command, ["s.yml"]).exception, InputError)


def test_a_sweep_of_failures_fails(study, tmp_path, monkeypatch, replace_run):
    monkeypatch.chdir(tmp_path)
    replace_run(heliogyro, lambda case, go_on: 1 / 0)
    pathlib.Path("s.yaml").write_text(dump(study))
    done = CliRunner().invoke(command, ["s.yaml", "--workers", "1"])
    assert isinstance(done.exception, evolvent.RunFailed)
    assert "all 6 cases failed; the first: ZeroDivisionError" in str(done.exception)
    assert "failed: 6 of 6" in done.stdout


@pytest.mark.slow
def test_figures(study, reference, tmp_path, monkeypatch):
    found = draw.figures(reference)
    assert set(found) == {"body_rate_last", "blade_1_lag_max", "steps"}
    assert found["blade_1_lag_max"].axes[0].get_title(loc="left") == "at blade_1_node = 0"
    axes = found["body_rate_last"].axes
    assert (axes[0].get_xlabel(), axes[0].get_ylabel()) == ("spool.rate [rad/s]", "blade.nodes")
    assert axes[1].get_ylabel() == "body_rate_last [rad/s]"
    line = draw.figures(reference.isel({"blade.nodes": [0]}))["steps"].axes[0]
    assert line.get_xlabel() == "spool.rate [rad/s]"
    np.testing.assert_array_equal(line.lines[0].get_ydata(), reference.steps.values[:, 0])
    study["over"] = {"solver.method": ["dopri5"], "blade.rotate_velocity": [True, False], **study["over"]}
    assert "steps" in draw.figures(studies.sweep(study))
    study["over"] = {"spool.rate": {"from": 3, "to": 4}, "blade.nodes": {"from": 3, "to": 5}}
    marks = draw.figures(studies.sweep(study | {"sample": "monte-carlo", "samples": 5}))["steps"]
    assert [axis.get_xlabel() for axis in marks.axes] == ["spool.rate [rad/s]", "blade.nodes"]
    from matplotlib.figure import Figure

    monkeypatch.setattr(heliogyro.SYSTEM, "study_figures", lambda dataset: {"own": Figure()}, raising=False)
    assert [os.path.basename(path) for path in draw.write(reference, tmp_path)] == ["own.png"]


def test_a_long_sweep_is_forecast(study, monkeypatch):
    monkeypatch.setattr(ev, "_MANY", 1)
    monkeypatch.setattr(ev, "_TASK", 0.0)
    monkeypatch.setattr(ev, "_LONG", 0.0)
    reports = []
    studies.sweep(study, report=reports.append)
    assert len(reports) == 1
    assert re.fullmatch(r"\d cases of about [\d.e-]+ s each: about [\d.e-]+ s on one core", reports[0])
    assert [ev._duration(s) for s in (12.3, 89.0, 114.0, 7300.0)] == ["12 s", "89 s", "1.9 min", "2 h"]


@pytest.mark.slow
def test_notebooks_show_a_sweep_in_short(whole, study, replace_run):
    """How cases ended, keys, ranges of results and a figure; reasons of failures; every text is escaped."""
    html = whole.ev._repr_html_()
    assert "6: 6 success" in html
    assert "3 values, 3 to 4 rad/s" in html
    low, high = float(whole.body_rate_last.min()), float(whole.body_rate_last.max())
    for word in ("body_rate_last [rad/s]", f">{low:.6g}<", f">{high:.6g}<", 'src="data:image/png;base64'):
        assert word in html
    assert "<img" not in whole.drop_vars("spool.rate").ev._repr_html_()
    assert "1 value, 3" in whole.isel({"blade.nodes": 0, "spool.rate": [0]}).ev._repr_html_()

    def run(case, go_on):
        if case.blade.nodes == 5:
            raise evolvent.RunFailed("<b>too long</b>", None)
        return go_on()

    replace_run(heliogyro, run)
    html = studies.sweep(study).ev._repr_html_()
    assert "6: 3 success, 3 failed" in html
    assert "<strong>Warning:</strong> 3 cases failed: &lt;b&gt;too long&lt;/b&gt;" in html
    with pytest.raises(InputError, match=r"'status' and 'reason'.*sweep"):
        whole[["steps"]].ev._repr_html_()
