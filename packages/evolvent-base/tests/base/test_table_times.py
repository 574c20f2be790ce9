"""Times of tables: units, stamps, clocks, dates, epochs, counters that wrap; what may mean two is refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from evolvent_base import tables
from evolvent_base.errors import InputError

COUNT = 80
SECONDS = np.arange(COUNT) * 0.05


def read(head: str, cell: Callable[[float], str], separator: str = ",") -> tables.TextTable:
    rows = "".join(f"{cell(t)}{separator}{k % 7}\n" for k, t in enumerate(SECONDS))
    return tables.read(f"{head}{separator}x\n{rows}".encode(), "rig.csv")


def clock(t: float, sign: str = ".", begin: float = 36000.0) -> str:
    t = round(begin + t, 3)
    return f"{int(t // 3600) % 24:02d}:{int(t % 3600 // 60):02d}:{t % 60:06.3f}".replace(".", sign)


def us(t: float) -> int:
    return round(t * 1e6)


#: Head, cell of a time from the first row, start that the file states, and a word of each note.
FORMS: dict[str, tuple[str, Callable[[float], str], float, tuple[str, ...]]] = {
    "s": ("time (s)", lambda t: f"{t - 2.0:.3f}", -2.0, ()),
    "no unit": ("time", lambda t: f"{t + 0.5:.3f}", 0.5, (tables.NO_UNIT,)),
    "ms": ("t / ms", lambda t: f"{1e3 * t:.0f}", 0.0, ()),
    "ms by name": ("time_ms", lambda t: f"{1e3 * t + 250:.0f}", 0.25, ()),
    "ms of a counter": ("millis", lambda t: f"{1e3 * t + 5000:.0f}", 5.0, ()),
    "us": ("Zeit in µs", lambda t: f"{us(t)}", 0.0, ()),
    "min": ("Elapsed time (min)", lambda t: f"{t / 60:.9f}", 0.0, ()),
    "hours": ("Laufzeit [h]", lambda t: f"{t / 3600:.12f}", 0.0, ()),
    "words": ("Time (milliseconds)", lambda t: f"{1e3 * t:.0f}", 0.0, ()),
    "ISO": ("timestamp", lambda t: f"2026-11-28T{clock(t)}", 0.0, ("first row, which has 2026-11-28T10:00:00.000",)),
    "ISO, blank, zone": ("time", lambda t: f"2026-11-28 {clock(t)}+01:00", 0.0, ("count from the first row",)),
    "ISO, Z": ("Time (UTC)", lambda t: f"2026-11-28T{clock(t)}Z", 0.0, ("count from the first row",)),
    "ISO without signs": ("time", lambda t: f"20261128T{clock(t).replace(':', '')}", 0.0, ("count from",)),
    "slashes": ("Date/Time", lambda t: f"2026/11/28 {clock(t)}", 0.0, ("count from the first row",)),
    "points": ("Zeit", lambda t: f"28.11.2026 {clock(t, ',')}", 0.0, ("count from the first row",)),
    "US": ("Date", lambda t: f"11/28/2026 {clock(t)} PM", 0.0, ("count from the first row",)),
    "name of the month": ("Time", lambda t: f"28-Nov-2026 {clock(t)}", 0.0, ("count from the first row",)),
    "day of the year": ("UTC", lambda t: f"2026-332T{clock(t)}", 0.0, ("count from the first row",)),
    "zone": ("time", lambda t: f"28 Nov 2026 {clock(t)} CET", 0.0, ("count from the first row",)),
    "clock": ("Uhrzeit", clock, 0.0, ("count from the first row",)),
    "clock, milliseconds behind a colon": ("time", lambda t: clock(t, ":"), 0.0, ("count from the first row",)),
    "clock over midnight": ("time", lambda t: clock(t, begin=86398.0), 0.0, ("count from the first row",)),
    "stamp over midnight": (
        "time",
        lambda t: f"{28 + (t >= 1.999)}.11.2026 {clock(t, begin=86398.0)}", 0.0, ("count from the first row",)),
    "clock of 12 hours": (
        "time", lambda t: clock(t if t < 1.999 else t - 43200.0, begin=46798.0), 0.0, ("count from the first row",)),
    "minutes and seconds": ("time", lambda t: clock(t)[3:], 0.0, ("count from the first row",)),
    "pandas": ("time", lambda t: f"0 days {clock(t)}000", 0.0, ("count from the first row",)),
    "MATLAB": ("Time", lambda t: f"{t:.5g} sec", 0.0, ()),
    "epoch in s": ("timestamp", lambda t: f"{1764324000 + t:.3f}", 0.0, ("counts s since 1970", "count from")),
    "epoch in ms": ("time", lambda t: f"{1764324000000 + 1e3 * t:.0f}", 0.0, ("counts ms since 1970", "count from")),
    "epoch in us": ("time", lambda t: f"{1764324000123456 + us(t)}", 0.0, ("counts us since 1970", "count from")),
    "epoch in ns": ("time", lambda t: f"{1764324000123456789 + 1000 * us(t)}", 0.0, ("counts ns", "count from")),
    "epoch in stated s": ("time (s)", lambda t: f"{1764324000 + t:.6f}", 0.0, ("count from the first row",)),
    "spreadsheet": ("time", lambda t: f"{45989.4166666667 + t / 86400:.10f}", 0.0, ("counts days", "count from")),
    "micros()": ("time (us)", lambda t: f"{(2**32 - 2000000 + us(t)) % 2**32}", 4292.967296, ("wraps at 2^32 once",)),
    "micros() in s": (
        "time (s)", lambda t: f"{(2**32 - 2000000 + us(t)) % 2**32 / 1e6:.6f}", 4292.967296, ("2^32 us",)),
    "millis()": ("time (ms)", lambda t: f"{(2**32 - 2000 + round(1e3 * t)) % 2**32}", 4294965.296, ("wraps at 2^32",)),
    "16 bit": ("millis", lambda t: f"{(65000 + round(1e3 * t)) % 2**16}", 65.0, ("wraps at 2^16 once",)),
    "16 bit, twice": ("micros", lambda t: f"{(65000 + us(t) // 40) % 2**16}", 0.065, ("wraps at 2^16 2 times",)),
    "signed": ("micros", lambda t: f"{(2**31 - 2000000 + us(t) + 2**31) % 2**32 - 2**31}", 2145.483648, ("2^32 once",)),
}  # fmt: skip


@pytest.mark.parametrize(
    ("form", "separator"), [(form, sign) for form in FORMS for sign in ",;" if sign not in FORMS[form][1](0.0)]
)
def test_forms(form: str, separator: str) -> None:
    """Times from the first row keep their digits, whatever their size."""
    head, cell, start, notes = FORMS[form]
    table = read(head, cell, separator)
    assert tables.time_of(table) == 0
    found = tables.seconds(table, 1)
    expected = np.array([us(t) // 40 for t in SECONDS]) / 1e6 if form == "16 bit, twice" else SECONDS
    np.testing.assert_allclose(found.seconds, expected, atol=9e-6 if form == "spreadsheet" else 6e-7)
    assert found.start == pytest.approx(start, rel=1e-12, abs=1e-12)
    assert len(found.notes) == len(notes)
    assert all(word in note for word, note in zip(notes, found.notes, strict=True))


def test_nanoseconds_since_1970_are_exact() -> None:
    rows = "".join(f"{1764324000123456789 + 7 * k},{k}\n" for k in range(50))
    found = tables.seconds(tables.read(f"time,x\n{rows}".encode(), "a.csv"), "time")
    np.testing.assert_allclose(found.seconds, 7e-9 * np.arange(50), rtol=1e-12)


@pytest.mark.parametrize("date", ["28.11.2026", "2026-11-28", "11/28/2026", "28/11/2026", "07/11/2026", "28.11.26"])
@pytest.mark.parametrize("over_midnight", [False, True])
def test_dates_beside_clocks(date: str, over_midnight: bool) -> None:
    """A date column is found by its name; day and month are told apart by the way in which time goes on."""
    after = {"28.11.2026": "29.11.2026", "2026-11-28": "2026-11-29", "11/28/2026": "11/29/2026",
             "28/11/2026": "29/11/2026", "07/11/2026": "08/11/2026", "28.11.26": "29.11.26"}[date]  # fmt: skip
    begin = 86398.0 if over_midnight else 36000.0
    rows = "".join(
        f"{after if over_midnight and t > 1.999 else date};{clock(t, begin=begin)};{k}\n" for k, t in enumerate(SECONDS)
    )
    table = tables.read(f"Date;Time;x\n{rows}".encode(), "a.csv")
    assert tables.time_of(table) == 1
    for column in ("Time", ["Date", "Time"], "Date"):
        found = tables.seconds(table, column)
        np.testing.assert_allclose(found.seconds, SECONDS, atol=1e-9)
        assert date in found.notes[0]


@pytest.mark.parametrize(
    ("names", "units", "expected"),
    [
        (("x", "time"), ("", ""), 1),
        (("Datum", "Uhrzeit", "Zeit"), ("", "", "s"), 2),
        (("Run 1: Time", "Run 1: x", "Run 2: Time"), ("s", "", "s"), 0),
        (("sample", "Elapsed Time"), ("", "s"), 1),
        (("Timestamp", "x"), ("", ""), 0),
        (("время", "x"), ("", ""), 0),
        (("x-axis", "1"), ("second", "V"), 0),
        (("Ts", "T"), ("s", ""), None),
        (("T", "x"), ("", ""), 0),
        (("T", "x"), ("degC", ""), None),
        (("rise time", "time constant", "time step"), ("s", "s", "s"), None),
        (("temp", "tension", "t0", "trial", "data"), ("",) * 5, None),
        (("time", "x"), ("mm", ""), None),
        (("x", "y"), ("s", ""), 0),
    ],
)
def test_names_of_the_time(names: tuple[str, ...], units: tuple[str, ...], expected: int | None) -> None:
    assert tables.find_time(names, units, lambda place: True) == expected


def test_t_that_does_not_rise_is_no_time() -> None:
    assert tables.find_time(("T", "x"), ("", ""), lambda place: False) is None
    assert tables.time_of(tables.read(b"T,x\n20.1,1\n20.0,2\n20.3,3\n", "a.csv")) is None
    assert tables.time_of(tables.read(b"time,timestamp,x\n5,1,1\n5,2,2\n5,3,3\n", "a.csv")) == 1
    assert tables.time_of(tables.read(b"2026-11-28T10:00:00Z,1\n2026-11-28T10:00:01Z,2\n", "a.csv")) == 0


@pytest.mark.parametrize(
    ("head", "cells", "said"),
    [
        ("time", ["10:05", "10:06", "10:07"], "may be hours and minutes, or minutes and seconds; name the form"),
        ("time", ["01/02/2026 10:00:00", "02/03/2026 10:00:00"], "begin with the day or with the month"),
        ("time (s)", ["0", "0", "0", "1", "1", "1", "2"], "too coarse: 4 of 7 rows .* state the rate instead"),
        ("time", ["10:00:00", "10:00:00", "10:00:00", "10:00:01"], "too coarse: 2 of 4"),
        (
            "time",
            ["45989.4166", "45989.4167", "45989.4168"],
            "days of a spreadsheet with 4 decimals, which resolve 8.6 s",
        ),
        ("time", ["10:00:00", "ten", "10:00:01"], "line 3 holds 'ten' in column 'time', where a time must be"),
        ("time", ["0.0", "x", "0.1"], "line 3 holds 'x' in column 'time', where a number must be"),
        ("time", ["2026-10-25 02:59:59 CEST", "2026-10-25 02:00:00 CET"], "line 3 holds '2026-10-25 02:00:00 CET'"),
        ("time (mm)", ["1", "2"], "has the unit 'mm'; a time is in s, ms"),
    ],
)
def test_what_may_mean_two_times_is_refused(head: str, cells: list[str], said: str) -> None:
    table = tables.read(f"{head},x\n{''.join(f'{cell},1{chr(10)}' for cell in cells)}".encode(), "a.csv")
    with pytest.raises(InputError, match=said):
        tables.seconds(table, 1)


@pytest.mark.parametrize("form", ["mm:ss", "hh:mm"])
def test_the_head_names_the_form_of_a_clock(form: str) -> None:
    table = tables.read(f"time ({form}),x\n10:05,1\n10:06,2\n10:07,3\n".encode(), "a.csv")
    step = 1.0 if form == "mm:ss" else 60.0
    np.testing.assert_allclose(tables.seconds(table, "time").seconds, step * np.arange(3))


@pytest.mark.parametrize("values", [(0, 50, 100, 20, 70), (0, 50, 100, 0, 50), (65500, 65520, 30000, 30020)])
def test_a_step_back_is_no_wrap(values: tuple[int, ...]) -> None:
    """A counter that wraps loses nearly its whole range."""
    table = tables.read(("time (ms),x\n" + "".join(f"{v},1\n" for v in values)).encode(), "a.csv")
    found = tables.seconds(table, "time")
    assert np.any(np.diff(found.seconds) < 0.0)
    assert "the time steps back in line" in found.notes[0]


def test_empty_times_stay_empty() -> None:
    table = tables.read(b"time (s),x\n,0\n1,1\n,2\n3,3\n", "a.csv")
    found = tables.seconds(table, "time")
    np.testing.assert_array_equal(found.seconds, [np.nan, 0.0, np.nan, 2.0])
    assert found.start == 1.0
