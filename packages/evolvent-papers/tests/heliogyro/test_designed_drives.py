"""Designed drives of spools: bounds are kept by other models and meshes, and what cannot be met is reported."""

from __future__ import annotations

import math
import pathlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import evolvent
from book import Book
from evolvent import cases, closed_forms as cf
from evolvent_base.cli import commands
from evolvent_base.errors import InputError, RunFailed
from evolvent_papers import drives
from evolvent_papers.drives import answer, motion, search
from evolvent_papers.drives.bounds import Bounds, task
from evolvent_papers.heliogyro import derived

#: A short blade of few nodes: 80 cm are paid out in 23 s.
SHORT: dict[str, Any] = {"blade.length": 1.0, "blade.nodes": 3, "spool.start_length": 0.2}
DEG = math.pi / 180.0


@pytest.fixture(scope="module")
def short() -> drives.Design:
    """A design without errors of inertia and spin, by few evaluations."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "ROUNDS", (4, 2))
        return drives.design("heliogyro", {"error": 0.0, "residual_swing": "1 deg", "time": "32 s"}, SHORT)


@pytest.mark.slow
def test_a_design_meets_its_bounds_where_the_constant_rate_does_not(short: drives.Design) -> None:
    assert short.missed() == []
    assert short.constant.measures().residual_swing > 5.0 * DEG
    assert short.nominal.measures().residual_swing <= 1.0 * DEG
    assert short.nominal.deployed[-1] == pytest.approx(1.0, rel=2e-6)
    assert short.end == 32.0
    assert task(short.task.case, Bounds()).bounds.time == pytest.approx(1.1 * 80.0 / 3.5, rel=1e-5)
    assert short.answer().warnings == []


@pytest.mark.slow
def test_the_case_of_a_design_runs_with_springs(short: drives.Design) -> None:
    """The case as it is written: springs under RK4 in place of links of fixed length."""
    run = evolvent.run(short.content)
    after = run.time.values >= short.end
    assert float(np.degrees(np.abs(run.tip_lag.values[after]).max())) < 1.05
    assert float(run.deployed_length[-1, 0]) == pytest.approx(1.0, rel=2e-6)


def test_reeling_in_is_paying_out_backwards() -> None:
    """Without dissipation: the mirrored lag at mirrored times, up to what the stop left of it.

    One link has no releases, which are no reversible events.
    """
    link: dict[str, Any] = {"blade.nodes": 1, "blade.length": 1.0}
    out = task(cases.load("heliogyro", link | {"spool.start_length": 0.2}), Bounds(error=0.0, time="30 s"))
    found = search.DriveSearch(out)
    table = found.table(found.start())
    one = motion.run(out, table, end=30.0)
    last = {"spool.start_length": 1.0, "body.rate": float(one.body_rate[one.ended][0]), "spool.rate": -3.5}
    back = task(cases.load("heliogyro", link | last), Bounds(error=0.0, time="30 s", length="0.2 m"))
    assert back.rate == -3.5
    reverse = [[30.0 - t, -rate] for t, rate in reversed(table)]
    other = motion.run(back, reverse, end=30.0)
    left = one.measures().residual_swing
    mirrored = -np.interp(30.0 - other.time, one.time, one.lag)
    before = (other.time > 1.0) & (other.time < 25.0)
    assert np.abs(other.lag - mirrored)[before].max() < 4.0 * left
    assert other.deployed[other.ended][-1] == pytest.approx(0.2, rel=1e-4)


@pytest.mark.slow
def test_the_steady_lag_is_that_of_the_hub(book: Book) -> None:
    """In the middle of a deployment, where the start has died out, at the spool."""
    t = task(cases.load("heliogyro", {}), Bounds())
    assert math.sin(t.steady_lag) == pytest.approx(2.0 * 0.035 / (0.05 * 6.0), rel=1e-12)
    given = {"blade.segments": "inextensible", "solver.method": "dopri5", "blade.nodes": 40, "solver.duration": "60 s"}
    run = evolvent.run("heliogyro", given)
    hub = derived.hub_lag([run["blade-1"].to_dataset().variables], 1)[:, 0]
    middle = run.time.values > 30.0
    book(
        "Threads, reels, tethers", "Lag at the hub of a free body in steady pay-out, mean from 30 to 60 s",
        reference="sin d = 2 v J / (H L0)", source="closed_forms.payout_lag",
        error=abs(float(hub[middle].mean()) / t.steady_lag - 1.0), allowed=0.03,
    )  # fmt: skip
    rotor = cf.Rotor(0.004, 0.05, 2, 0.0, 1.0)
    assert math.isnan(cf.payout_lag(rotor, 0.2, 0.024))


def test_the_first_drive_of_the_search_cancels_most_of_the_swing() -> None:
    """Half the rate for half a period of the closed form."""
    t = task(cases.load("heliogyro", SHORT), Bounds(error=0.0))
    first = search.DriveSearch(t)
    found = motion.run(t, first.table(first.start()), end=first.end)
    constant = motion.run(t, motion.constant_table(t), end=t.constant_time)
    assert found.measures().residual_swing < 0.3 * constant.measures().residual_swing
    assert found.deployed[-1] == pytest.approx(1.0, rel=2e-6)


@pytest.mark.slow
def test_what_is_missed_is_reported(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A time in which it cannot be done: exit code 1, the nearest drive is written."""
    monkeypatch.setattr(search, "ROUNDS", (1,))
    monkeypatch.setattr(search, "MOST_FURTHER", 0)
    file, picture, bounds = tmp_path / "drive.yaml", tmp_path / "drive.png", tmp_path / "bounds.yaml"
    bounds.write_text("residual_swing: 0.01 deg\nerror: 0.1\n")
    options = [f"--set={key}={value}" for key, value in SHORT.items()]
    options += ["--time", "24s", "--bounds", str(bounds), "-o", str(file), "--figure", str(picture)]
    found = CliRunner().invoke(commands, ["design-drive", "heliogyro", *options], standalone_mode=False)
    assert isinstance(found.exception, RunFailed), found.output
    assert "bounds are not met" in str(found.exception)
    assert "above 0.01" in str(found.exception)
    assert "worst corner" in found.output
    assert picture.stat().st_size > 0
    content = yaml.safe_load(file.read_text())
    assert content["spool"]["table"][0][0] == "0.0 s"
    assert cases.load(content).solver.duration > 24.0


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["inertia-stand"], "'inertia-stand'"),
        (["heliogyro", "--peak-lag", "-1deg"], "peak_lag is '-1deg'; it must be an angle above 0"),
        (["heliogyro", "--tension", "0 mN"], "tension is '0 mN'; it must be a force above 0"),
        (["heliogyro", "--spool-torque", "-2 mN m"], "spool_torque is '-2 mN m'; it must be a torque above 0"),
        (["heliogyro", "--tension", "3 m"], "tension is '3 m'"),
        (["heliogyro", "--time", "0s"], "time is '0s'"),
        (["heliogyro", "--time", "1 ms"], "a hundredth to a hundred times the time of the constant rate"),
        (["heliogyro", "--time", "1e25s"], "a hundredth to a hundred times the time of the constant rate"),
        (["heliogyro", "--error", "0.95"], "error is '0.95'; it must be a plain number of 0 or above and below 0.9"),
        (["heliogyro", "--length", "6m"], "it must be at most blade.length, 5 m"),
        (["heliogyro", "--length", "1m", "--set", "spool.start_length=1"], "as spool.start_length"),
        (["heliogyro", "--set", "spool.rate=16"], "there is no steady lag"),
        (["heliogyro", "--set", "spool.rate=0"], "spool.rate is 0"),
        (["heliogyro", "--set", "spool.rate=[3.5, 3.4]"], "one rate for all blades"),
        (["heliogyro", "--set", "spool.rate=null"], "spool.rate is missing"),
        (["heliogyro", "--bounds", "missing.yaml"], "missing.yaml"),
    ],
)
def test_bounds_that_cannot_be_used_are_refused(options: list[str], sentence: str) -> None:
    found = CliRunner().invoke(commands, ["design-drive", *options], standalone_mode=False)
    assert isinstance(found.exception, InputError), found.exception
    assert sentence in str(found.exception)


def test_bounds_come_from_one_file() -> None:
    files = ["--bounds", "one.yaml", "--bounds", "two.yaml"]
    found = CliRunner().invoke(commands, ["design-drive", "heliogyro", *files], standalone_mode=False)
    assert "--bounds is given 2 times, as 'one.yaml', 'two.yaml'" in str(found.exception)


def test_the_case_is_no_output(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text("system: heliogyro\n")
    found = CliRunner().invoke(commands, ["design-drive", str(file), "-o", str(file)], standalone_mode=False)
    assert "is the case file itself; name another, such as 'drive.yaml'" in str(found.exception)


def test_the_built_in_drive_is_of_the_built_in_case() -> None:
    """The case beside the drive, and its end: 1.1 times that of the constant rate, then two periods of the lag."""
    designed = cases.load("heliogyro-designed")
    asked = task(cases.load("heliogyro", {}), Bounds())
    end = designed.spool.table[-1][0]
    assert end == pytest.approx(asked.bounds.time, abs=1e-6)
    duration = {"solver.duration": round(end + 2.0 * asked.period(5.0), 3)}
    assert designed == cases.load("heliogyro", motion.table_keys(designed.spool.table) | duration)
    assert asked.corners == [(0.9, 0.9), (0.9, 1.1), (1.1, 0.9), (1.1, 1.1)]


@pytest.mark.slow
@pytest.mark.parametrize("nodes", [20, 40, 80])
def test_the_built_in_drive_keeps_its_bounds_at_tip_and_spool_on_finer_meshes(nodes: int) -> None:
    """With springs: the row `thread-designed-drive`."""
    asked = task(cases.load("heliogyro", {}), Bounds())
    table = cases.load("heliogyro-designed").spool.table
    found = motion.run(asked, table, end=table[-1][0], nodes=nodes)
    assert found.time[-1] - found.end == pytest.approx(2.0 * asked.period(5.0))
    of = found.measures()
    assert of.peak_lag < 1.02 * asked.steady_lag
    assert of.tip_swing < 0.2 * DEG
    assert of.spool_swing < 0.2 * DEG
    assert of.residual_swing == max(of.tip_swing, of.spool_swing)


def test_the_lag_at_the_spool_is_that_of_the_last_segment() -> None:
    """From positions of the nodes: at the spool of one link it is the tip's; of more, of the line from Q to the last.

    Where less than a tenth of the last segment is out, it is that of the segment before.
    """
    one = task(cases.load("heliogyro", SHORT | {"blade.nodes": 1}), Bounds(error=0.0))
    found = motion.run(one, motion.constant_table(one), end=one.constant_time)
    assert np.array_equal(found.spool_lag, found.lag)
    lags = np.array([[0.1, np.nan, np.nan], [0.1, 0.2, np.nan], [0.1, 0.2, np.nan], [0.1, 0.2, 0.3]])
    blade = {
        name: SimpleNamespace(values=values)
        for name, values in (
            ("signed_lag", lags), ("released", np.isfinite(lags).astype(float)),
            ("deployed_length", np.array([0.5, 1.05, 1.5, 2.09])),
        )
    }  # fmt: skip
    assert motion._spool_lag(blade, 1.0).tolist() == [0.1, 0.1, 0.2, 0.2]


def test_a_swing_at_the_spool_alone_misses_the_bound() -> None:
    """The tip keeps it, with one of the models the spool does not."""
    asked = task(cases.load("heliogyro", SHORT), Bounds(error=0.0))
    ones = np.ones(4)
    still = motion.Motion(
        np.arange(4.0), 1e-3 * ones, 1e-3 * ones, 1e-3 * ones, ones, ones, end=1.0, radius=0.01, segment=0.3, failed=""
    )
    swinging = still._replace(spool_lag=np.array([1.0, 1e-3, -5e-3, 1e-3]))
    found = drives.Design(asked, [], 1.0, still, still, {"6 links": swinging}, {}, 0)
    assert found.missed() == [("spool_swing", 5e-3, 0.2 * DEG)]
    assert found.largest.residual_swing == 5e-3
    assert answer.text(found).startswith("residual swing at the spool 0.2865 deg, 0.086 above 0.2")
    assert not found.nominal.measures().residual_swing > 0.2 * DEG


@pytest.mark.slow
def test_other_models_are_finer_meshes_and_the_case_s_springs() -> None:
    """Links where the case has links; springs stiffer than needed are checked at 1e4 N/m, and lag as links do."""
    asked = task(cases.load("heliogyro", SHORT | {"blade.stiffness": 1e7}), Bounds(error=0.0))
    first = search.DriveSearch(asked)
    table = first.table(first.start())
    found = motion.others(asked, table, end=first.end)
    assert list(found) == ["6 links", "12 links", "3 springs", "6 springs"]
    links = motion.run(asked, table, end=first.end)
    assert found["3 springs"].measures().tip_swing == pytest.approx(links.measures().tip_swing, rel=0.05)
    rigid = task(
        cases.load("heliogyro", SHORT | {"blade.segments": "inextensible", "solver.method": "dopri5"}), Bounds()
    )
    assert list(motion.others(rigid, table, end=first.end)) == ["6 links", "12 links"]
    film = {"blade.young_modulus": "1 GPa", "blade.thickness": "5 um", "blade.width": "1 cm"}
    soft = task(cases.load("heliogyro", SHORT | film), Bounds())
    assert motion.run(soft, table, end=first.end, springs=True).failed == ""


@pytest.mark.parametrize(("missed", "checks"), [(0, 1), (2, 3), (99, 1 + search.MOST_FURTHER)])
def test_rounds_go_on_while_a_bound_is_missed(missed: int, checks: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a sum of squares that falls slowly: the drive is checked after the first rounds and after each other."""
    seen: list[float] = []

    class Checked:
        def missed(self) -> list[int]:
            return [0] * (missed - len(seen) + 1 if len(seen) <= missed else 0)

    def verified(_: search.DriveSearch, table: list[list[float]]) -> Checked:
        seen.append(table[3][1])
        return Checked()

    monkeypatch.setattr(search, "ROUNDS", (2, 2))
    monkeypatch.setattr(search.DriveSearch, "residuals", lambda _, x: (x - 0.5) ** 3)
    monkeypatch.setattr(search.DriveSearch, "verified", verified)
    drives.design("heliogyro", {"error": 0.0}, SHORT)
    assert len(seen) == checks
    assert len(set(seen)) == checks


def test_an_unknown_bound_names_the_nearest(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "bounds.yaml"
    file.write_text("peak_lagg: 14 deg\n")
    found = CliRunner().invoke(commands, ["design-drive", "heliogyro", "--bounds", str(file)], standalone_mode=False)
    assert isinstance(found.exception, InputError)
    assert "peak_lag" in str(found.exception)
