"""Rows of kept variables: joined in any way, and through bytes, they are the same."""

import numpy as np
import pytest
import xarray as xr

from evolvent.design.evaluator import record
from evolvent_base.errors import EvolventError, InputError, RunFailed

ATTRS = {
    "title": "t",
    "system": "s",
    "status": "success",
    "statistics": '{"steps": 3, "step": null}',
    "wall_time_s": 1.0,
}


def run(nodes, **attrs):
    """A run with a profile over nodes."""
    time, node = np.arange(3.0), np.arange(1, nodes + 1)
    return xr.Dataset(
        {
            "lag": (("time", "node"), np.outer(time, node), {"units": "rad", "long_name": "lag", "slack": "x"}),
            "mass": ("node", 0.5 * node, {"units": "kg"}),
            "word": ((), "yes"),
            "pole": ((), 1.0 + 2.0j),
        },
        {"time": time, "node": ("node", node, {"long_name": "node"})},
        {**ATTRS, **attrs},
    )


def same(a, b):
    """Whether two tables are equal bit for bit."""
    assert (a.cases, a.status, a.reason) == (b.cases, b.status, b.reason)
    assert list(a.columns) == list(b.columns)
    for name, column in a.columns.items():
        other = b.columns[name]
        assert (column.dims, dict(column.attrs), column.first) == (other.dims, dict(other.attrs), other.first)
        assert column.values.dtype == other.values.dtype
        np.testing.assert_array_equal(column.values, other.values)
    assert list(a.coordinates) == list(b.coordinates)
    for dim, along in a.coordinates.items():
        np.testing.assert_array_equal(along.values, b.coordinates[dim].values)
        assert along.common == b.coordinates[dim].common


def outcomes(keep=()):
    runs = [run(2), ValueError("no\n way"), run(4), run(3, status="failed", message="broke"), run(1)]
    return [record.outcome(k, found, keep) for k, found in enumerate(runs)]


def test_what_is_kept_by_default():
    rows = record.table(outcomes())
    assert rows.status == ("success", "failed", "success", "failed", "success")
    assert rows.reason == ("", "ValueError: no way", "", "broke", "")
    assert list(rows.columns) == ["mass", "pole", "step", "steps", "word"]
    np.testing.assert_array_equal(rows.columns["steps"].values, [3.0, np.nan, 3.0, np.nan, 3.0])
    np.testing.assert_array_equal(rows.columns["mass"].values[:, 1], [1.0, np.nan, 1.0, np.nan, np.nan])
    assert rows.columns["word"].values.tolist() == ["yes", "", "yes", "", "yes"]
    assert rows.coordinates["node"].values.tolist() == [1, 2, 3, 4]
    assert rows.coordinates["node"].common


def test_what_is_kept_of_time():
    rows = record.table(outcomes(("lag.last", "lag.mean", "steps", "lag")))
    np.testing.assert_array_equal(rows.columns["lag_last"].values[0], [2.0, 4.0, np.nan, np.nan])
    np.testing.assert_array_equal(rows.columns["lag_mean"].values[0], [1.0, 2.0, np.nan, np.nan])
    assert rows.columns["lag_last"].attrs == {"units": "rad", "long_name": "lag, at the end"}
    assert rows.columns["lag"].values.shape == (5, 3, 4)
    assert set(rows.columns) == {"lag_last", "lag_mean", "steps", "lag"}


def test_the_split_does_not_show():
    ones = outcomes()
    whole = record.table(ones)
    for split in ([[0, 1], [2, 3, 4]], [[2, 3], [0, 1, 4]], [[4], [1], [0, 3], [2]]):
        parts = [record.table([ones[k] for k in part]) for part in split]
        same(record.join(parts), whole)
        same(record.join([record.decode(record.encode(part)) for part in parts]), whole)


def test_coordinates_that_differ_are_left_out():
    other = run(2).assign_coords(node=[5, 6])
    rows = record.table([record.outcome(0, run(3), ()), record.outcome(1, other, ())])
    assert not rows.coordinates["node"].common


def test_names_that_no_run_has():
    with pytest.raises(InputError, match=r"keep holds 'lga.last', which no run has; did you mean 'lag'\?"):
        record.check_kept(outcomes(("lga.last",)))
    with pytest.raises(InputError, match="'mass' has no time to reduce"):
        record.check_kept(outcomes(("mass.last",)))
    record.check_kept(outcomes(("lag.last",)))
    record.check_kept([record.outcome(0, RunFailed("broke"), ("lga",))])


def test_a_variable_of_two_shapes_is_an_error():
    other = run(2)
    other["mass"] = ((), 1.0)
    with pytest.raises(EvolventError, match="'mass' has the dimensions"):
        record.table([record.outcome(0, run(3), ()), record.outcome(1, other, ())])
