"""Bad input is one clear sentence, exit code 2, and nothing is written."""

from __future__ import annotations

import pathlib
import sys
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner

from evolvent import EvolventError, InputError
from evolvent_base import cli, signals
from evolvent_base.signals import Signals
from evolvent_massprops import description as schema, json_schema, load, mass_properties, recordings
from evolvent_massprops.commands.identify import identify
from evolvent_massprops.inertia import Body, linear_model
from massprops import rig

EXAMPLE = rig.EXAMPLES / "stand.yaml"


def refused(match: str, path: Any, changes: dict[str, Any] | None = None, content: Any = EXAMPLE) -> None:
    """MassProperties ends with one sentence."""
    with pytest.raises(InputError, match=match) as error:
        mass_properties(path, content, {**rig.SET, **(changes or {})})
    assert "\n" not in str(error.value)


@pytest.fixture
def knock(tmp_path: pathlib.Path) -> str:
    """A good recording."""
    return rig.write_csv(tmp_path / "a.csv", *rig.knock())


# ------------------------------------------------------------------------------------------------ signals


def test_too_few_samples(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock(samples=6)
    refused("6 samples; at least 8", rig.write_csv(tmp_path / "a.csv", t, x))
    t, x = rig.knock(samples=14)
    refused("order 3 asks too much of sensor 1", rig.write_csv(tmp_path / "a.csv", t, x), {"identification.order": 3})


def test_sampling_below_twice_the_highest_mode(tmp_path: pathlib.Path) -> None:
    slow = rig.write_csv(tmp_path / "a.csv", *rig.knock(rate=4.0, samples=200))
    refused(r"4 samples a second show nothing above 12.5664 rad/s, but the body's heave is expected at 13.96", slow)
    edge = rig.write_csv(tmp_path / "b.csv", *rig.knock(rate=6.0, samples=200))
    near = {"body.Ixx": "unknown near 3700", "body.Izz": "unknown near 44000"}
    refused(r"6 samples a second .* the body's highest mode is expected at 24\.\d+ rad/s; sample at 7\.", edge, near)


def test_dead_clipped_and_infinite_sensors(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    dead, clipped, infinite = x.copy(), x.copy(), x.copy()
    dead[:, 2] = 0.25
    refused(r"sensor 3 is constant \(0.25\): a dead sensor", rig.write_csv(tmp_path / "a.csv", t, dead))
    clipped[:, 1] = np.clip(x[:, 1], -0.004, 0.004)
    refused("sensor 2 is clipped", rig.write_csv(tmp_path / "b.csv", t, clipped))
    infinite[7, 0] = np.inf
    refused("sample 8 of 'sensor 1' is infinite", rig.write_csv(tmp_path / "c.csv", t, infinite))


def test_gaps_that_are_too_large_or_unwanted(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    x[:400, 3] = np.nan
    path = rig.write_csv(tmp_path / "a.csv", t, x)
    refused("sensor 4 lacks 400 of 612 samples, more than half", path)
    refused("sensor 4 lacks 400 of 612 samples, and signals.gaps is 'refuse'", path, {"signals.gaps": "refuse"})
    x[:] = np.nan
    refused("no numbers|holds no sample|no column of it holds", rig.write_csv(tmp_path / "b.csv", t, x))


def test_times(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    uneven = rig.write_csv(tmp_path / "a.csv", t + 0.003 * np.sin(t), x)
    refused("the time is not even, but esprit needs even times", uneven, {"identification.method": "esprit"})
    back = t.copy()
    back[100] = back[98]
    refused("the time does not rise at sample 101", rig.write_csv(tmp_path / "b.csv", back, x))
    path = rig.write_csv(tmp_path / "c.csv", t, x)
    refused("leave 0 of 612 samples, which run from 0 to 12.22 s", path, {"signals.start": "20 s"})
    refused("signals.end is 1 s; it must be after signals.start, 2 s", path, {"signals.start": 2, "signals.end": 1})
    refused("signals.time and signals.rate are both given", path, {"signals.time": "time", "signals.rate": 50})
    refused("signals.time is 'tme', .* did you mean 'time'", path, {"signals.time": "tme"})


@pytest.mark.parametrize(
    ("time", "said"),
    [
        (lambda t: 1e-300 * t, "2e-302 s apart, where 1e-12 s to .*check the unit of the time"),
        (lambda t: 1e300 * t, r"2e\+298 s apart, where 1e-12 s to"),
        (lambda t: 1e300 + t, r"all 612 samples have the same time"),
        (lambda t: 0.0 * t, "all 612 samples have the same time, 0 s"),
        (lambda t: np.where(t == t[5], np.nan, t), "1 of 612 times are empty or not finite, the first at sample 6"),
        (lambda t: np.where(t == t[5], np.inf, t), "sample 6 of 'time' is infinite"),
        (lambda t: np.where(t == t[-1], 1e300, t), r"1e\+300 s apart"),
        (lambda t: t[::-1], "does not rise at sample 2"),
    ],
)
def test_absurd_times(time: Any, said: str, tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    refused(said, rig.write_csv(tmp_path / "a.csv", time(t), x))


def test_an_absurd_clock(knock: str) -> None:
    refused("2e-22 s apart", knock, {"signals.clock": 1e-20})


@pytest.mark.parametrize("rate", [0.0, 1e300, np.inf])
def test_an_absurd_rate_of_a_file(rate: float) -> None:
    source = Signals.of(("a",), np.sin(np.arange(100.0))[:, None], ("mm",), rate, path="a.wav")
    content = {"stand": {"kind": "torsion", "stiffness": 0.35}, "body": {}, "signals": {}}
    with pytest.raises(InputError, match=r"the rate that 'a.wav' states is .* between 1e-12 and 1e\+12"):
        mass_properties(source, content)


def test_a_wrong_unit_of_time_is_named(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    fast = rig.write_csv(tmp_path / "a.csv", 1e-3 * t, x)
    refused("slowest mode found has 13868.* the body heaves at 13.96.*check the unit of the time", fast)
    slow = rig.write_csv(tmp_path / "b.csv", 1e3 * t, x)
    refused("0.05 samples a second show nothing above 0.157.* the body's heave is expected at 13.96", slow)


def with_words(path: pathlib.Path, head: str, *cells: str) -> Signals:
    """A recording of a knock with one more column, whose cells repeat."""
    first, *rows = pathlib.Path(rig.write_csv(path, *rig.knock())).read_text(encoding="utf-8").splitlines()
    more = [f"{row},{cells[k % len(cells)]}" for k, row in enumerate(rows)]
    path.write_text("\n".join([f"{first},{head}", *more]) + "\n", encoding="utf-8")
    return signals.read(path)


def named(*columns: str) -> schema.Signals:
    return schema.Signals.model_validate({"sensors": [{"column": column} for column in columns]})


def test_a_column_that_is_mostly_words_is_named(tmp_path: pathlib.Path) -> None:
    """Whether few or most of its cells are words; where the signals are named, other columns may hold anything."""
    source = with_words(tmp_path / "a.csv", "gauge (mm)", "1.5", "2.5", "over", "0.5")
    with pytest.raises(InputError, match=r"'gauge' of .* 153 of its 612 cells are words, the first in line 4"):
        recordings.read(source, schema.Signals())
    assert recordings.read(source, named("sensor 1", "sensor 2")).notes == ()
    source = with_words(tmp_path / "a.csv", "gauge (mm)", "1.5", "over", "over")
    what = "is no signal.*: 408 of its 612 cells are words, the first in line 3: 'over'"
    with pytest.raises(InputError, match=f"the column 'gauge' of .* {what}; correct it, or name the columns"):
        recordings.read(source, schema.Signals())
    with pytest.raises(InputError, match=f"the column 'gauge' of .* {what}"):
        recordings.read(source, named("sensor 1", "gauge"))
    assert recordings.read(source, named("sensor 1", "sensor 2")).notes == ()


def test_a_column_of_words_alone_is_left_out_with_a_note(tmp_path: pathlib.Path) -> None:
    source = with_words(tmp_path / "a.csv", "state", "ok", "over")
    assert source.names[1:] == tuple(f"sensor {k}" for k in (1, 2, 3, 4))
    assert recordings.read(source, schema.Signals()).notes == ("'state' is left out: no cell holds a number",)


def test_nothing_but_a_time_column(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time (s)\n" + "\n".join(f"{0.02 * k:.2f}" for k in range(600)), encoding="utf-8")
    stand = tmp_path / "wire.yaml"
    stand.write_text("stand: {kind: torsion, stiffness: 0.35 N m/rad}\nbody: {name: disc}\nsignals: {unit: mm}\n")
    monkeypatch.setattr(sys, "argv", ["evolvent", "identify", str(path), "--stand", str(stand)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    told = capsys.readouterr().err.strip()
    assert "holds no column of numbers but the time, 'time'" in told
    assert "\n" not in told


def test_columns_and_units(knock: str, tmp_path: pathlib.Path) -> None:
    refused("column is 'sensor1', which .* did you mean 'sensor 1'", knock, {"signals.sensors.0.column": "sensor1"})
    refused("column is 9, but .* has 5 columns", knock, {"signals.sensors.0.column": 9})
    refused("names the column 'sensor 2' twice", knock, {"signals.sensors.0.column": "sensor 2"})
    refused("signals.sensors.0.unit: 'mn' may be MN or mN; write one of them", knock, {"signals.sensors.0.unit": "mn"})
    bare = rig.write_csv(tmp_path / "b.csv", *rig.knock(), unit="")
    refused("states the unit of 'sensor 1'; give signals.unit or signals.sensors.0.unit", bare)
    refused("signals.unit: 'metre per secnd' is not a known unit", bare, {"signals.unit": "metre per secnd"})
    mixed = {"signals.unit": "m", "signals.sensors.2.unit": "V"}
    refused("sensor 3 is in V, sensor 1 in m; they must be of one kind", bare, mixed)
    refused("sensitivity is 'much'; it must be a reading", knock, {"signals.sensors.0.sensitivity": "much"})
    refused("sensitivity is '2 mm'; .* it must be in m per", knock, {"signals.sensors.0.sensitivity": "2 mm"})
    refused("noise of sensor 2 is not given", knock, {"signals.sensors.0.noise": "0.1 mm"})
    refused("noise is '1 V'; it must be a value", knock, {"signals.sensors.0.noise": "1 V"})


def test_columns_that_are_swapped_or_turned(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    swapped = rig.write_csv(tmp_path / "a.csv", t, x[:, [1, 0, 2, 3]])
    refused("is no motion of a rigid body: only .* check which column is which sensor", swapped)
    refused(
        "is no motion of a rigid body",
        rig.write_csv(tmp_path / "b.csv", t, x),
        {"signals.sensors.1.direction": [0, -1, 0]},
    )


@pytest.mark.slow
def test_a_rate_that_is_not_the_files(knock: str, tmp_path: pathlib.Path) -> None:
    refused("signals.rate is 50.5 Hz, but by the column 'time' .* has 50 Hz; leave", knock, {"signals.rate": "50.5 Hz"})
    mass_properties(knock, EXAMPLE, {**rig.SET, "signals.rate": "50.01 Hz"})
    t, x = rig.knock()
    bare = rig.write_csv(tmp_path / "b.csv", 1e3 * t, x).replace("time (s)", "time")
    path = pathlib.Path(bare)
    path.write_text(path.read_text().replace("time (s)", "time"))  # in ms, as nobody says
    found = mass_properties(path, EXAMPLE, {**rig.SET, "signals.rate": "50 Hz"})
    assert found["Ixx"] == pytest.approx(3703.0, rel=1e-3)


def test_a_sensitivity_in_the_wrong_unit(tmp_path: pathlib.Path) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock(), unit=" (mm)")
    said = "signals.sensors.0.sensitivity is '2 V/mm'; the column 'sensor 1' is in mm, so it must be in mm per"
    refused(said, path, {"signals.sensors.0.sensitivity": "2 V/mm"})


@pytest.mark.slow
def test_a_drift_and_a_late_release_are_named(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    drifting = rig.write_csv(tmp_path / "a.csv", t, x + 0.01 * t[:, None])
    refused("no mode is above the noise; .*; sensor 1 drifts by .*: set identification.detrend=linear", drifting)
    mass_properties(drifting, EXAMPLE, {**rig.THREE, "identification.detrend": "linear"})
    quiet = 1e-4 * np.random.default_rng(5).standard_normal((60, 4))
    late = rig.write_csv(tmp_path / "b.csv", np.arange(672) / rig.RATE, np.concatenate([quiet, x]))
    said = r"the samples are quiet until 1.2 s, where the swing seems to begin; set signals.start to it"
    refused(f"; {said}$", late)
    assert not mass_properties(late, EXAMPLE, {**rig.THREE, "signals.start": "1.2 s"}).warnings[1:]


def test_too_few_modes_are_counted(tmp_path: pathlib.Path) -> None:
    s, body = rig.stand(), Body(mass=15190.0, centre=(0.0, 0.0, 0.0), inertia=(3703.0, 43920.0, 43920.0))
    modes, t = linear_model(s, body).modes(), np.arange(400) / rig.RATE
    x = modes.motion(t, modes.release((0.0, -9806.65, 0.0), np.array([0.0, 0.0, 0.87])), s.points).T
    path = rig.write_csv(tmp_path / "a.csv", t, x + 1e-4 * np.random.default_rng(2).standard_normal(x.shape))
    with pytest.raises(InputError, match=r"Izz does not show in the data; only 2 of the 3 modes .* 13.96.*, 24.5[89]"):
        mass_properties(path, EXAMPLE)


@pytest.mark.slow
def test_frequencies_alone_list_all_pairs(knock: str) -> None:
    alone = {"identification.shapes": False}
    refused(r"6 pairs of Ixx and Izz give these frequencies \(.*370\d.* and 439\d\d", knock, alone)
    started = {"body.Ixx": "unknown near 3700", "body.Izz": "unknown near 44000"}
    assert mass_properties(knock, EXAMPLE, {**rig.SET, **alone, **started})["Ixx"] == pytest.approx(3703.0, rel=1e-3)


# ------------------------------------------------------------------------------------------------ stand and body


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stand.support": "standing"}, "the springs cannot hold the body: it .*; hang it, guide it"),
        ({"stand.stifness": 3}, "unknown key 'stand.stifness'; did you mean 'stand.stiffness'"),
        ({"stand.stiffness": "740 kg"}, "stand.stiffness is '740 kg'; it must be a stiffness .* something else"),
        ({"stand.stiffness": [1, 2, 3]}, "stand.stiffness has 3 values, but there are 4 springs"),
        ({"stand.kind": "spring"}, "stand.kind is 'spring'; did you mean 'springs'"),
        ({"stand.half_width": None}, "stand.half_width is missing"),
        ({"body.mass": "15190 +- 3 m"}, "body.mass is '15190 .- 3 m'; it must be a mass .* something else"),
        ({"body.colour": "red"}, "unknown key 'body.colour'"),
        ({"body.Ixx": 3703, "body.Izz": 43920}, "body has no unknown; write 'unknown'"),
        ({"signals.sensors": []}, "signals.sensors is missing"),
        ({"signals.sensors.0.point": 5}, r"signals.sensors.0.point is 5, but there are 4 springs"),
        ({"signals.sensors.0.point": [1, 2]}, "the number of a spring, or three lengths"),
        ({"signals.sensors.0.direction": "up"}, "vertical, x, y, z, or three numbers"),
        ({"uncertainty.method": "guess"}, "uncertainty.method is 'guess'; did you mean"),
        ({"uncertainty.coverage_factor": -1}, "uncertainty.coverage_factor is -1"),
        # what the data do not determine
        ({"body.Iyy": "unknown"}, "the data do not determine the unknowns: Iyy does not show in the data"),
        ({"body.mass": "unknown", "stand.common_factor": "unknown"}, "vibrations determine only their ratio"),
        ({"identification.order": 1, "identification.shapes": False}, "the data do not determine the unknowns"),
        # what an uncertainty leads to
        ({"body.mass": "15190 kg +- 200 %"}, r"the standard uncertainty of body.mass, 3.04e\+04 kg, leads to"),
        (
            {"stand.half_width": "0.87 m +- 20 cm", "uncertainty.method": "monte-carlo"},
            "the Monte Carlo draws inputs that no .* can have .* the widest is stand.half_width, 0.87 .- 0.2 m",
        ),
        # what no body has
        ({"body.Iyy": "10000"}, "inertia tensor with .* assumed that no body has: its largest principal moment"),
        ({"body.Ixz": "20000"}, "the search would begin at an inertia .* that no body has: its least principal"),
        ({"body.Ixz": "20000", "body.Ixx": "unknown near 30000"}, "no body has"),
    ],
)
def test_what_descriptions_refuse(knock: str, changes: dict[str, Any], said: str) -> None:
    refused(said, knock, changes)


def test_descriptions_that_are_none(knock: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "empty.yaml").write_text("")
    (tmp_path / "list.yaml").write_text("- 1\n")
    (tmp_path / "broken.yaml").write_text("stand: [1\n")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\xff\x00")
    refused("is empty", knock, content=tmp_path / "empty.yaml")
    refused("is no mapping", knock, content=tmp_path / "list.yaml")
    refused("broken.yaml', line 2|broken.yaml, line 2", knock, content=tmp_path / "broken.yaml")
    refused("it is not a text file", knock, content=tmp_path / "binary.yaml")
    refused("no such file", knock, content=tmp_path / "none.yaml")
    refused("stand is missing", knock, content={"body": {}})
    with pytest.raises(InputError, match="a stand is a file or a mapping, not int"):
        load(3)
    with pytest.raises(InputError, match="no signals are given"):
        mass_properties([], EXAMPLE)
    with pytest.raises(InputError, match="same bytes"):
        mass_properties([knock, knock], EXAMPLE)


def test_schemas() -> None:
    assert "stand" in json_schema("springs")["properties"]
    with pytest.raises(InputError, match="did you mean 'trifilar'"):
        json_schema("trifillar")


# ------------------------------------------------------------------------------------------------ command


def call(*arguments: str) -> Any:
    """The command as the command line calls it, errors of the package as its exit code 2."""

    @click.group()
    def group() -> None:
        pass

    group.add_command(identify)
    return CliRunner().invoke(group, ["identify", *arguments])


@pytest.mark.slow
@pytest.mark.usefixtures("outlined")
def test_the_command_prints_a_table_and_writes_one_page(knock: str, tmp_path: pathlib.Path) -> None:
    page = tmp_path / "report.html"
    sets = [word for key, value in rig.SET.items() for word in ("--set", f"{key}={value}")]
    done = call(knock, "--stand", str(EXAMPLE), "-o", str(page), *sets)
    assert done.exit_code == 0, done.output
    for word in ("mode 3", "Ixx", "Izz", "kg m²", "stand.half_width", f"certificate: {page}"):
        assert word in done.output
    text = page.read_text(encoding="utf-8")
    assert "http" not in text.replace("http://www.w3.org", "")
    assert "<script" not in text
    for word in (
        "SHA-256",
        "Uncertainty budget",
        "What these data do not determine",
        "taken as exact",
        "MAC",
        "whiteness",
    ):
        assert word in text
    assert text.count("<img") == text.count('src="data:image/') >= 5
    quiet = call(knock, "--stand", str(EXAMPLE), "--quiet", "--set", "identification.order=3", *sets)
    assert (quiet.exit_code, quiet.output) == (0, "")


@pytest.mark.slow
def test_nothing_is_written_where_the_data_do_not_support_it(knock: str, tmp_path: pathlib.Path) -> None:
    page = tmp_path / "report.html"
    for change in ("identification.method=prony", "body.Iyy=unknown", "body.Iyy=10000"):
        order = ["--set", "identification.order=3", "--set", change]
        done = call(knock, "--stand", str(EXAMPLE), "-o", str(page), *order)
        assert isinstance(done.exception, EvolventError), change
        assert not page.exists()
    done = call(knock, "--stand", str(EXAMPLE), "-o", str(tmp_path / "none" / "report.html"))
    assert "there is no folder" in str(done.exception)


@pytest.mark.slow
def test_methods_without_uncertainty_give_a_table_only(knock: str, tmp_path: pathlib.Path) -> None:
    changes = {**rig.SET, "identification.method": "esprit", "identification.order": 3}
    found = mass_properties(knock, EXAMPLE, changes)
    assert not found.has_uncertainties
    assert found["Ixx"] == pytest.approx(3703.0, rel=5e-3)
    with pytest.raises(InputError, match="'esprit', which gives no uncertainty; a certificate takes 'varpro'"):
        found.report(tmp_path / "report.html")


@pytest.mark.slow
def test_an_expected_page_is_the_same_each_time(knock: str, tmp_path: pathlib.Path) -> None:
    import datetime

    found = mass_properties(knock, EXAMPLE, rig.THREE)
    date = datetime.datetime(2026, 1, 2, 3, 4, tzinfo=datetime.UTC)
    pages = [pathlib.Path(found.report(tmp_path / f"{k}.html", date=date)).read_bytes() for k in range(2)]
    assert pages[0] == pages[1]
    assert b"2 January 2026, 03:04 UTC" in pages[0]
