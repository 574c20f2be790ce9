"""Tables in text files: one table in the dialects of programs and instruments; what no one can tell is refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from evolvent_base import tables
from evolvent_base.errors import InputError

ROWS = 40
TIME = np.arange(ROWS) / 20.0
LEFT = 5.0 * np.cos(8.0 * TIME) + 0.2
RIGHT = 3.0 * np.sin(8.0 * TIME) - 0.1


def points(value: float, digits: int = 4) -> str:
    return f"{value:.{digits}f}"


def commas(value: float, digits: int = 4) -> str:
    return points(value, digits).replace(".", ",")


def thousands(value: float, group: str, decimal: str) -> str:
    """A value times 1000 with two decimals and grouped digits."""
    return f"{1000.0 * value:_.2f}".replace(".", decimal).replace("_", group)


def text(
    head: str, separator: str = ",", cell: Callable[[float], str] = points, tail: str = "", end: str = "\n"
) -> str:
    rows = (separator.join(map(cell, row)) + tail for row in zip(TIME, LEFT, RIGHT, strict=True))
    return head + end.join(rows) + end


def lvm(head: str, decimal: str, *, x: bool, segments: int = 1, later: float = 0.0) -> str:
    """A file of LabVIEW, whose segments begin at 0 each."""
    found = (
        f"LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t{decimal}\nMulti_Headings\tYes\n"
        "X_Columns\tOne\nTime_Pref\tRelative\nDate\t2026/11/28\nTime\t23:59:59.5\n***End_of_Header***\t\n\t\n"
    )
    each = ROWS // segments
    for k in range(segments):
        begin = 86399.5 + k * (each / 20.0 + later)
        clock = f"{int(begin % 86400 // 3600):02d}:{int(begin % 3600 // 60):02d}:{begin % 60:09.6f}"
        found += (
            f"Channels\t2\t\t\nSamples\t{each}\t{each}\t\nDate\t2026/11/28\t2026/11/28\t\nTime\t{clock}\t{clock}\t\n"
            "Y_Unit_Label\tmm\tN\t\nX_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\nDelta_X\t0.05\t0.05\t\n"
            f"***End_of_Header***\t\t\t\n{head}\n"
        ).replace(".", decimal if k >= 0 and decimal == "," else ".")
        for i in range(each):
            cells = [points(i / 20.0) if x else "", points(LEFT[k * each + i]), points(RIGHT[k * each + i])]
            found += "\t".join(cells).replace(".", decimal) + ("\tfirst" if i == 0 else "") + "\n"
    return found


def tektronix() -> str:
    """Settings in the first columns beside the samples of one channel."""
    stated = ["Record Length,4.0e+01", "Sample Interval,5.0e-02", "Trigger Point,0", "", "", "", "Source,CH1",
              "Vertical Units,V", "Vertical Scale,1", "Horizontal Units,s", "Model Number,TDS 2014"]  # fmt: skip
    own = [*stated, *[""] * ROWS]
    rows = zip(own, TIME, LEFT, strict=False)
    return "".join(f"{one or ','},,{t:018.12f},{v:9.5f},\n" for one, t, v in rows)


#: Text -> units of the columns time, left, right.
DIALECTS: dict[str, tuple[str | bytes, tuple[str, str, str]]] = {
    "plain": (text("time,left,right\n"), ("", "", "")),
    "brackets": (text("time [s],left [mm],right (N)\n"), ("s", "mm", "N")),
    "semicolons": (text("time (s);left (mm);right (N)\n", ";", commas), ("s", "mm", "N")),
    "semicolons, points": (text("time;left;right\n", ";"), ("", "", "")),
    "tabs, commas": (text("time\tleft\tright\n", "\t", commas), ("", "", "")),
    "bars": (text("time|left|right\n", "|"), ("", "", "")),
    "blanks": (text("time   left right\n", "   "), ("", "", "")),
    "aligned": (text("     time     left    right\n", "", lambda v: f"{v:9.4f}"), ("", "", "")),
    "blanks behind commas": (text("time, left, right\n", ", "), ("", "", "")),
    "BOM": (text("\ufefftime,left,right\n"), ("", "", "")),
    "CR": (text("time,left,right\r", end="\r"), ("", "", "")),
    "CR LF": (text("time,left,right\r\n", end="\r\n"), ("", "", "")),
    "UTF-16": (text("time\tleft (µm)\tright\n", "\t").encode("utf-16"), ("", "µm", "")),
    "UTF-16 BE without BOM": (text("time\tleft\tright\n", "\t").encode("utf-16-be"), ("", "", "")),
    "UTF-16 LE without BOM": (text("time\tleft\tright\n", "\t").encode("utf-16-le"), ("", "", "")),
    "UTF-32": (text("time\tleft\tright\n", "\t").encode("utf-32"), ("", "", "")),
    "cp1252": (text("time;left (°);right (µm)\n", ";").encode("cp1252"), ("", "°", "µm")),
    "sep=": (text("sep=;\r\ntime;left;right\r\n", ";", commas, end="\r\n"), ("", "", "")),
    "quoted": (text('"time","left","right"\n', cell=lambda v: f'"{commas(v)}"'), ("", "", "")),
    "quoted heads": (text('"time, s","left, mm",right\n'), ("s", "mm", "")),
    "heads of two lines": (text('"time\n(s)","left\n(mm)",right\n'), ("s", "mm", "")),
    "a quote that is an inch": (text('5" rig\ntime,left,right\n'), ("", "", "")),
    "units row": (text("time,left,right\ns,mm,N\n"), ("s", "mm", "N")),
    "units row in brackets": (text("time,left,right\n[s],(mm),[N]\n"), ("s", "mm", "N")),
    "units row of words": (text("time,left,right\nseconds,millimetres,-\n"), ("seconds", "millimetres", "")),
    "unknown unit in a row": (text("time,left,right\ns,LSBs,mm\n"), ("s", "LSBs", "mm")),
    "second head": (text("time,left,right\nclock,IEPE,IEPE\n"), ("", "", "")),
    "types, then units": (text("time,left,right\nclock,IEPE,IEPE\ns,mm,N\n"), ("s", "mm", "N")),
    "ISO 80000": (text("time / s;left / mm;right / N\n", ";"), ("s", "mm", "N")),
    "ISO 80000 without blanks": (text("time/s;left/mm;right/N\n", ";"), ("s", "mm", "N")),
    "in": (text("time in s,left in mm,right in N\n"), ("s", "mm", "N")),
    "low lines": (text("time_s,left_mm,right_deg\n"), ("s", "mm", "deg")),
    "preamble": (text("Rate,20\nRange,10\nChannels,2\ntime,left,right\n"), ("", "", "")),
    "preamble as wide": (text("Rate,20,Hz\nRange,10,V\ntime,left,right\n"), ("", "", "")),
    "preamble of numbers": (text("0,0,0\n1,1,2\n2,4,8\ntime,left,right\n"), ("", "", "")),
    "comments": (text("# rig 3, 2026\n# by hand\ntime,left,right\n"), ("", "", "")),
    "comment as head": (text("# time left right\n", " "), ("", "", "")),
    "head of MATLAB": (text("% time left right\n", "\t").replace(" left ", "\tleft\t", 1), ("", "", "")),
    "names parted otherwise": (text("time, left, right\n", " "), ("", "", "")),
    "rule below the names": (text("time left right\n[s] [mm] [N]\n---- ---- ----\n", " "), ("s", "mm", "N")),
    "trailing separators": (text("time;left;right;\n", ";", commas, tail=";"), ("", "", "")),
    "trailing in rows": (text("time;left;right\n", ";", commas, tail=";"), ("", "", "")),
    "trailing in the head": (text("time;left;right;\n", ";", commas), ("", "", "")),
    "trailing lines of Excel": (text("time;left;right\n", ";", commas) + ";;\n;;\n", ("", "", "")),
    "comment column": (text("time,left,right,Comment\n"), ("", "", "")),
    "comments in some rows": (
        text("time,left,right,note\n").replace(f"{LEFT[7]:.4f},{RIGHT[7]:.4f}", f"{LEFT[7]:.4f},{RIGHT[7]:.4f},hit"),
        ("", "", ""),
    ),
    "words": (text("time,left,right,state\n", tail=",SIGNAL LOST"), ("", "", "")),
    "minus of typesetters": (text("time;left;right\n", ";").replace("-", "\u2212"), ("", "", "")),
    "exponents of Fortran": (text("time left right\n", " ", lambda v: f"{v:.8E}".replace("E", "D")), ("", "", "")),
    "units in the cells": (text("time,left,right\n", tail=" mm").replace(",", " s,").replace(
        "time s,left s", "time,left"), ("s", "s", "mm")),
    "Tektronix": (tektronix(), ("s", "V", "")),
    "Tektronix, names": (
        text("Model,DPO4034\nHorizontal Units,s\nSample Interval,0.05\nVertical Units,V,mV\nTIME,left,right\n"),
        ("s", "V", "mV"),
    ),
    "Rigol": (text("X,left,right,\nSecond,Volt,Volt,\n", tail=","), ("Second", "Volt", "Volt")),
    "Keysight": (text("x-axis,1,2\nsecond,Volt,Volt\n", cell=lambda v: f"{v:+.8E}"), ("second", "Volt", "Volt")),
    "phyphox": (
        text('"Time (s)","left (m/s^2)","right (m/s^2)"\n', cell=lambda v: f"{v:.9E}"),
        ("s", "m/s^2", "m/s^2"),
    ),
    "catman": (
        text(
            "T0 = 28.11.2026 10:00:00\t\t\nTime  1 - default sample rate\tleft\tright\n[s]\t[N]\t[mm]\n"
            "No. 1\tNo. 2\tNo. 3\n", "\t", commas),
        ("s", "N", "mm"),
    ),
    "Vernier, text": (
        text("Vernier Format 2\nx.cmbl 11/28/2026 10:00 .\nRun 1\nTime\tleft\tright\nt\tF\tx\ns\tN\tm\n\n", "\t"),
        ("s", "N", "m"),
    ),
    "Vernier": (text("Run 1: Time (s),Run 1: left (N),Run 1: right (m)\n"), ("s", "N", "m")),
    "PASCO": (text("Time (s) Run #1,left (N) Run #1,right (m) Run #1\n"), ("s", "N", "m")),
    "PicoScope": (text("Time,left,right\n(s),(mV),(V)\n\n"), ("s", "mV", "V")),
    "LVM": (lvm("X_Value\tleft\tright\tComment", ".", x=True), ("s", "mm", "N")),
    "LVM with commas": (lvm("X_Value\tleft\tright\tComment", ",", x=True), ("s", "mm", "N")),
    "serial port": ("Booting\nready\n" + text("t,left,right\n"), ("", "", "")),
    "serial plotter": (
        "".join(f"t:{t:.4f}\tleft:{a:.4f}\tright:{b:.4f}\n" for t, a, b in zip(TIME, LEFT, RIGHT, strict=True)),
        ("", "", ""),
    ),
    "thousands, US": (
        text("time,left,right\n", cell=lambda v: f'"{thousands(v, ",", ".")}"'), ("", "", "")),
    "thousands, German": (text("time;left;right\n", ";", lambda v: thousands(v, ".", ",")), ("", "", "")),
    "thousands, French": (text("time;left;right\n", ";", lambda v: thousands(v, "\u202f", ",")), ("", "", "")),
    "thousands, Swiss": (text("time;left;right\n", ";", lambda v: thousands(v, "'", ".")), ("", "", "")),
}  # fmt: skip


@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects(dialect: str) -> None:
    """Three columns, time first, or two where the instrument has one channel; their values are those written."""
    content, stated = DIALECTS[dialect]
    raw = content.encode() if isinstance(content, str) else content
    assert tables.is_text(raw)
    table = tables.read(raw, "rig.csv")
    time = tables.time_of(table)
    assert time == 0
    scale = 1000.0 if dialect.startswith("thousands") else 1.0
    count = 2 if dialect == "Tektronix" else 3
    assert table.rows == ROWS
    for place, values in enumerate((TIME, LEFT, RIGHT)[:count]):
        np.testing.assert_allclose(table.numbers(place + 1), scale * values, atol=scale * 6e-5)
    assert table.units[:count] == stated[:count]
    if dialect not in ("Keysight", "Tektronix"):
        assert [name.split(": ")[-1].removesuffix(" Run #1") for name in table.names[1:3]] == ["left", "right"]


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ('"","time","left"\n"1",0.0,1.5\n"2",0.1,2.5\n', ("column 1", "time", "left")),  # write.csv of R
        ('"time" "left"\n"1" 0.0 1.5\n"2" 0.1 2.5\n', ("column 1", "time", "left")),  # write.table of R
        (",time,left\n0,0.0,1.5\n1,0.1,2.5\n", ("column 1", "time", "left")),  # pandas with its index
        ("#,time,left\n1,0.0,1.5\n2,0.1,2.5\n", ("column 1", "time", "left")),
        ("time,,left\n0.0,,1.5\n0.1,,2.5\n", ("time", "column 2", "left")),
        ("0.0,1.5\n0.1,2.5\n", ("column 1", "column 2")),
        ("time,left,left\n0.0,1.5,3\n0.1,2.5,4\n", ("time", "left", "left (2)")),
        ("Elapsed Time    left\n  0.0   1.5\n  0.1   2.5\n", ("Elapsed Time", "left")),
        ("# rows: 2\n# columns: 2\n0.0 1.5\n0.1 2.5\n", ("column 1", "column 2")),  # a matrix of Octave
        ("; rate, 50,Hz\n; Headers, time,left\n0.0,1.5\n0.1,2.5\n", ("time", "left")),
        (
            '"#","Date Time, GMT+01:00","left, mm (S/N: 12)"\n1,11/28/26,1.5\n2,11/29/26,2.5\n',
            ("#", "Date Time, GMT+01:00", "left"),
        ),
        ("time,1,2\n0.0,1.5,3\n0.1,2.5,4\n", ("time", "1", "2")),
    ],
)
def test_names(content: str, names: tuple[str, ...]) -> None:
    table = tables.read(content.encode(), "a.csv")
    assert table.names == names
    np.testing.assert_array_equal(table.numbers("left" if "left" in names else 2), [1.5, 2.5])


@pytest.mark.parametrize(
    ("cells", "value"),
    [
        (("0.123", "2.500"), 0.123),  # a zero begins no group
        (("1.234,5", "2.500"), 1234.5),  # two signs
        (("1.234.567", "2.500"), 1234567.0),  # one sign twice
        (("1.2345", "2.500"), 1.2345),
        (("12,5", "2,500"), 12.5),
        (("1 234,5", "2,500"), 1234.5),
        (("1'234.5", "2.500"), 1234.5),
        (("1.234E+2", "2.500"), 123.4),
        (("1234", "2.500"), 1234.0),  # whole numbers above 999 without groups
        (
            ("1.500", "-998", "17", "45", "2.500"),
            1500.0,
        ),  # others below 1000, and zeros that decimals would not end with
        (("1,500", "-998", "17", "45", "2,500"), 1500.0),
        (("\u22121,5", "- 2,25"), -1.5),
        (("+1,5", "1,0d+1"), 1.5),
        (("inf", "2.5"), np.inf),
    ],
)
def test_decimal_signs(cells: tuple[str, ...], value: float) -> None:
    """What one cell shows holds for the column."""
    content = "n;x\n" + "".join(f"{k};{cell}\n" for k, cell in enumerate(cells))
    assert tables.read(content.encode(), "a.csv").numbers("x")[0] == value


@pytest.mark.parametrize("other", [("0,5", "7,25"), ("1.234,5", "17")])
def test_another_column_shows_the_decimal_sign(other: tuple[str, str]) -> None:
    content = f"a;x\n{other[0]};1.234\n{other[1]};2.345\n"
    table = tables.read(content.encode(), "a.csv")
    np.testing.assert_array_equal(table.numbers("x"), [1234.0, 2345.0])
    assert table.notes == ["the cells of 'x' are grouped by thousands: '1.234' is 1234"]


@pytest.mark.parametrize("separator", [";", "\t", "|", ""])
@pytest.mark.parametrize("sign", [".", ","])
def test_decimals_and_thousands_that_cannot_be_told_apart(separator: str, sign: str) -> None:
    rows = [("1", f"1{sign}234"), ("2", "-998"), ("3", f"2{sign}511")]
    content = "n;x\n" if separator else "x\n"
    content = content.replace(";", separator) + "".join(
        separator.join(row if separator else row[1:]) + "\n" for row in rows
    )
    table = tables.read(content.encode(), "a.csv")
    with pytest.raises(InputError, match=rf"line 2 holds '1{sign}234' in column 'x'.*groups thousands; write 1234, or"):
        table.numbers("x")
    if separator:
        np.testing.assert_array_equal(table.numbers("n"), [1.0, 2.0, 3.0])


def test_cells_of_both_signs_are_refused() -> None:
    table = tables.read(b"n;x\n1;1,5\n2;2.5\n", "a.csv")
    with pytest.raises(InputError, match=r"line 2 holds '1,5' and line 3 '2.5' in column 'x'; one column has one"):
        table.numbers("x")


@pytest.mark.parametrize("head", ["time,left\n", "time,left,right\n", ""])
def test_commas_that_part_cells_and_decimals(head: str) -> None:
    count = head.count(",") + 1 if head else 3
    rows = "".join(",".join(commas(v) for v in row[:count]) + "\n" for row in zip(TIME, LEFT, RIGHT, strict=True))
    with pytest.raises(InputError, match="cells cannot be told apart"):
        tables.read((head + rows).encode(), "a.csv")


def test_two_whole_numbers_or_one_with_a_decimal_comma() -> None:
    with pytest.raises(InputError, match="may part two columns of whole numbers, or be decimal signs of one"):
        tables.read(b"1877,6\n1373,2\n1690,7\n", "a.csv")
    for told in (b"a,b\n1877,6\n1373,2\n", b"1877,60\n1373,2\n", b"1877,6\n1373,-2\n", b"1877;6\n1373;2\n"):
        assert len(tables.read(told, "a.csv").names) == 2


@pytest.mark.parametrize("head", ["friction (N m)\n", ""])
def test_one_column_with_decimal_commas(head: str) -> None:
    table = tables.read(f"{head}0,031\n0,029\n".encode(), "a.csv")
    np.testing.assert_array_equal(table.numbers(1), [0.031, 0.029])


def test_only_the_wanted_columns_are_judged() -> None:
    table = tables.read(b"time,left,temp,state\n0,1.5,20,ok\n1,,ERR,ok\n2,NaN,inf,#N/A\n", "a.csv")
    np.testing.assert_array_equal(table.numbers("left"), [1.5, np.nan, np.nan])
    assert (table.is_numeric("left"), table.is_numeric("temp"), table.is_numeric("state")) == (True, False, False)
    assert table.words("state") == ["ok", "ok", "#N/A"]
    assert (table.line(0), table.is_empty("left")) == (2, False)
    with pytest.raises(InputError, match=r"line 3 holds 'ERR' in column 'temp', where a number must be"):
        table.numbers("temp")


def test_columns_are_found_by_name_head_and_number() -> None:
    table = tables.read(b"time_ms,force (N)\n0,1\n1,2\n", "a.csv")
    assert [table.index(one) for one in ("time", "time_ms", "force", "force (N)", 2)] == [0, 0, 1, 1, 1]
    with pytest.raises(InputError, match=r"signals.time is 'tme', which 'a.csv' does not hold; did you mean 'time'"):
        table.index("tme", "signals.time")
    with pytest.raises(InputError, match=r"column is 3, but 'a.csv' has 2 columns"):
        table.index(3)


@pytest.mark.parametrize(
    ("content", "rows", "note"),
    [
        ("t,x\n0,1\n1,2\nt,x\n0,3\n1,4\n", 4, "the head stands again in line 4"),
        (
            "t,x\n" + "0,1\n" * 20 + "\nmotor stopped\n",
            20,
            "1 line within or behind the table is no whole row.*line 23: 'motor",
        ),
        ("t,x,y\n" + "0,1,2\n" * 20 + "0,1\n" + "0,1,2\n" * 20, 40, "no whole row.*line 22: '0,1'"),
        ("t,x,y\n" + "0,1,2\n" * 20 + "0,1\n" * 15, 35, "15 rows of the file have fewer cells.*line 22"),
        ("t x y\n" + "0 1 2\n" * 20 + "0 1\n" + "0 1 2\n" * 20, 40, "no whole row.*line 22: '0 1'"),
        ("t,x,y\n" + "0,1,2\n" * 20 + "3,4\n", 20, "no whole row.*line 22: '3,4'"),
        ("t,x,y\n" + "0,1,2\n" * 9 + "\nf,a\n" + "1,2\n" * 5, 9, "holds 2 tables; the longest, from line 2 to line 10"),
        ("t,x\n0,1,2\n0.5,1,2\n", 2, "the head names 2 of 3 columns"),
    ],
)
def test_what_is_left_out_is_noted(content: str, rows: int, note: str) -> None:
    import re

    table = tables.read(content.encode(), "a.csv")
    assert table.rows == rows
    assert re.search(note, " ".join(table.notes))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "no table of numbers"),
        (b"only words\nand more\n", "no table of numbers"),
        (b"a,b\n", "no table of numbers"),
        (b"t,x\n0,1\n1,2\n2,3,4\n3,4\n", "line 4 has more cells than the 2 of the others"),
        (b"t,x\n0,1\n1,2\n2,3,4\n", "line 4 has more cells than the 2 of the others"),
        (bytes(range(256)), "not a text file"),
    ],
)
def test_what_is_no_table_is_refused(content: bytes, said: str) -> None:
    with pytest.raises(InputError, match=said):
        tables.read(content, "a.csv")


@pytest.mark.parametrize("decimal", [".", ","])
def test_segments_of_labview(decimal: str) -> None:
    """Those that begin where the one before ends follow one another, over midnight as well; others are left out."""
    head = "X_Value\tleft\tright\tComment"
    whole = tables.read(lvm(head, decimal, x=True, segments=2).encode(), "a.lvm")
    assert (whole.rows, whole.rate, tables.time_of(whole)) == (ROWS, 20.0, None)
    np.testing.assert_allclose(whole.numbers("left"), LEFT, atol=6e-5)
    assert whole.notes == ["the 2 segments of the file follow one another"]
    first = tables.read(lvm(head, decimal, x=True, segments=2, later=5.0).encode(), "a.lvm")
    assert (first.rows, first.units) == (ROWS // 2, ("s", "mm", "N", ""))
    assert "segments; those from number 2 on" in first.notes[0]
    assert whole.is_empty("X_Value")
    bare = tables.read(lvm(head, decimal, x=False).encode(), "a.lvm")
    assert (bare.rows, bare.rate, tables.time_of(bare)) == (ROWS, 20.0, None)


def test_labview_with_a_time_for_each_channel() -> None:
    head = (
        lvm("X_Value\tleft\tX_Value\tright\tComment", ".", x=True).partition("X_Value")[0].replace("mm\tN", "mm\t\tN")
    )
    rows = "".join(f"{t:.2f}\t{a:.4f}\t{t:.2f}\t{b:.4f}\t\n" for t, a, b in zip(TIME[:5], LEFT, RIGHT, strict=False))
    table = tables.read((head + "X_Value\tleft\tX_Value\tright\tComment\n" + rows).encode(), "a.lvm")
    assert table.names == ("X_Value", "left", "X_Value (2)", "right", "Comment")
    assert table.units == ("s", "mm", "s", "N", "")
    assert tables.time_columns(table.names, table.units) == [0, 2]


@pytest.mark.parametrize(
    ("head", "rate", "start"),
    [
        ("X,CH1,Start,Increment,\nSequence,Volt,-1.5e+00,5.0e-02\n", 20.0, -1.5),
        ("index,CH1,t0 =-1.5s,tInc = 0.05,\n", 20.0, -1.5),
        ("Sample Rate: 20 Hz\nX,CH1\n", 20.0, 0.0),
        ("Sampling interval (ms);50\nX,CH1\n", 20.0, 0.0),
        ("Sample Interval,0.05\nX,CH1\n", 20.0, 0.0),
        ("X,CH1\n", None, 0.0),
    ],
)
def test_rates_that_a_head_states(head: str, rate: float | None, start: float) -> None:
    content = head + "".join(f"{k},{v:.4f}{',,' * ('t' in head.split('CH1')[1])}\n" for k, v in enumerate(LEFT))
    table = tables.read(content.encode(), "a.csv")
    assert table.rate == (None if rate is None else pytest.approx(rate, rel=1e-12))
    assert table.start == start
    np.testing.assert_allclose(table.numbers("CH1"), LEFT, atol=6e-5)


def test_a_row_that_is_cut_off_stays_a_sample_where_no_times_are_stated() -> None:
    rows = "1.5,2.5\n" * 10 + "1.\n" + "1.5,2.5\n" * 10
    table = tables.read(f"left,right\n{rows}".encode(), "a.csv")
    assert (table.rows, table.line(10), table.line(11)) == (21, 12, 13)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(table.numbers("left"))), [10])
    assert table.notes[-1] == "rows cut off that stand for missing samples: 1"
    assert tables.read(f"time,right\n{rows}".encode(), "a.csv").rows == 20


def test_large_tables_are_read_in_parts() -> None:
    """Cells of later parts count as those of the first: an empty one, a word, another sign."""
    count = 40_000
    rows = [f"{k};{k / 7:.4f};{k};ok" for k in range(count)]
    rows[30_000] = "30000;;1.5;late"
    table = tables.read(("n;x;y;z\n" + "\n".join(rows).replace(".", ",")).encode(), "a.csv")
    expected = np.round(np.arange(count) / 7, 4)
    expected[30_000] = np.nan
    np.testing.assert_array_equal(table.numbers("x"), expected)
    assert table.numbers("y")[30_000] == 1.5
    assert table.rows == count
    assert table.words("z")[30_000] == "late"


def test_trailing_commas_are_no_columns_without_a_name() -> None:
    rows = "\n".join(f"{k},{1 + k / 10:.3f},{2 + k / 10:.3f},,," for k in range(30))
    table = tables.read(f"n,left,right\n{rows}\n".encode(), "rig.csv")
    assert table.numbers("left") == pytest.approx([1 + k / 10 for k in range(30)])
