"""Texts that would keep a reader busy for minutes: each is read or refused within seconds of processor time."""

from __future__ import annotations

import pathlib
from collections.abc import Callable
from typing import Any

import pytest

from evolvent import cases
from evolvent.assembly import expressions
from evolvent.parts.base import PointReferences, Reference
from evolvent_base import signals, units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section
from evolvent_base.tables import distinct
from security import mutations

#: Processor time of one text, s; the readers that this guards against took from 19 s to hours.
LIMIT = 10.0

UNITS = {
    "blanks": "1 m" + " " * 60_000 + "x",
    "blanks behind": "1 m" + " " * 60_000,
    "factors": "1 " + "*".join(["m"] * 2000),
    "tower": "1 9**9**9*m",
    "raised tower": "1 9⁹⁹⁹⁹⁹⁹⁹⁹ m",
    "tower in brackets": "1 ((((10^99)^9)^9)^9)^9 m",
    "product above": "1 10^(9*9*9*9*9*9*9*9*9) m",
}
YAML = {
    "plain values": f"a: [{'1,' * 240_000}]",
    "aliases": f"a: &a 1\nb: [{'*a,' * 240_000}]",
    "merge keys": f"a: &a {{x: 1}}\nb: {{<<: [{'*a,' * 240_000}]}}",
    "brackets": "[" * 100_000,
    "braces": "{a: " * 100_000,
    "dashes": "- " * 100_000,
}


@pytest.fixture(scope="module", autouse=True)
def _units_library() -> None:
    units.parse("1 ft", "m")


@pytest.mark.parametrize("name", UNITS)
def test_units_are_read_in_linear_time(name: str) -> None:
    with mutations.limited(LIMIT):
        if name == "blanks behind":
            assert units.parse(UNITS[name], "m") == 1.0
            return
        with pytest.raises(units.UnitError) as error:
            units.parse(UNITS[name], "m")
    assert len(str(error.value)) < 200


@pytest.mark.parametrize("text", ["1 m^2", "1 m²", "1 m**2", "1 (m)^2", "1 m^0.5 m^1.5", "1 m squared"])
def test_exponents_of_units_stay_readable(text: str) -> None:
    assert units.parse(text, "m^2") == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", YAML)
def test_yaml_is_refused_before_it_is_built(name: str) -> None:
    with mutations.limited(LIMIT), pytest.raises(InputError, match=r"more than (200000 values|100 levels deep)|nested"):
        cases.parse_yaml(YAML[name], "text")


def test_tags_of_the_library_are_refused() -> None:
    with pytest.raises(InputError, match=r"text.*: this is not YAML|not supported"):
        cases.parse_yaml("a: !!timestamp x", "text")


@pytest.mark.slow
def test_yaml_of_many_values_is_read() -> None:
    with mutations.limited(LIMIT):
        assert len(cases.parse_yaml(f"a: [{'1,' * 100_000}]", "text")["a"]) == 100_000


@pytest.mark.parametrize("tail", ["x", "", "-1 x", "\r\n" * 10])
def test_a_file_that_begins_like_uff(tail: str, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.uff"
    path.write_bytes(b"    -1" + b"\n" * 100_000 + tail.encode())
    with mutations.limited(LIMIT), pytest.raises(InputError, match=r"cannot read"):
        signals.read(path)


@pytest.mark.slow
def test_equal_names_of_columns_are_numbered(tmp_path: pathlib.Path) -> None:
    with mutations.limited(LIMIT):
        found = distinct(["x"] * 20_000 + ["x (3)", ""])
    assert found[:3] == ["x", "x (2)", "x (3)"]
    assert found[-2:] == ["x (3) (2)", "column 20002"]
    assert len(set(found)) == len(found)
    path = tmp_path / "a.csv"
    path.write_text(",".join(["a (mm)"] * 2000) + "\n" + (",".join(["1.5"] * 2000) + "\n") * 3)
    with mutations.limited(LIMIT):
        read = signals.read(path)
    assert read.names[:2] == ("a", "a (2)")
    assert set(read.units) == {"mm"}


@pytest.mark.parametrize(
    ("title", "unit"),
    [("a (mm)", "mm"), ("a [N m]", "N m"), ("a(b)(c)", "c"), ("a (", ""), ("(x)", ""), ("a (b]", "b")],
)
def test_units_in_titles(title: str, unit: str, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{title},other\n1,2\n2,3\n3,4\n")
    assert signals.read(path).units[0] == unit


def test_titles_of_many_brackets(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("(" * 50_000 + " " * 50_000 + "x,b\n1,2\n2,3\n3,4\n")
    with mutations.limited(LIMIT):
        assert signals.read(path).names[1] == "b"


@pytest.mark.slow
def test_long_lines_before_the_numbers(tmp_path: pathlib.Path) -> None:
    """The separator is found from each line once, not once for each line that stands before it."""
    path = tmp_path / "a.csv"
    path.write_text(("1;" * 4000 + "x y,z\n" + "1 " * 9 + "\n") * 110)
    with mutations.limited(LIMIT), pytest.raises(InputError, match=r"no table of numbers"):
        signals.read(path)


# ------------------------------------------------------------------------------------------------ tracebacks


@pytest.mark.parametrize("text", ["max()", "min()", "x + max()", "max(x)"])
def test_functions_without_arguments_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"takes two or more arguments"):
        expressions.compile_expression(text, ["x"])


class _Joined(Section):
    """A section with references and lists of both kinds."""

    at: PointReferences = ()
    inertia: units.InertiaTensor = 1.0
    axis: units.Direction = (0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    "values",
    [
        {"at": {"hub": 1, "boom": 2}},
        {"at": [{"hub": 1, "boom": 2}]},
        {"at": [{"hub": 1, "boom": 2, "tip": 3}]},
        {"at": [[["hub"], [0, 0, 1]]]},
        {"inertia": [[1, 2, [3]], [1, 2, 3], [1, 2, "3 kg m^2"]]},
        {"inertia": [[[1]], [[1]], [["1 kg m^2"]]]},
        {"inertia": [[], [], ["1 kg m^2"]]},
        {"inertia": {"1": 1, "2": 2, "3": 3}},
        {"axis": {"0": 1, "1": 2, "2": 3}},
        {"axis": [10**400, 1, "2 m"]},
    ],
)
def test_mappings_and_nested_lists_where_lists_must_be(values: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"must be"):
        _Joined(**values)


def test_a_mapping_is_no_list_of_names() -> None:
    read: Callable[[Any], Any] = Reference(what="bodies", several=True).read
    assert read(["hub", "boom"]) == ("hub", "boom")
    with pytest.raises(ValueError, match=r"a list of names"):
        read({"hub": 1, "boom": 2})
