"""The tree of a run: variables that are made when one is first asked for, and the same tree as if they were there."""

from __future__ import annotations

import copy
import pickle
import re

import pytest
import xarray as xr

from evolvent import System, parts
from evolvent.results import observe, tree

#: What xarray numbers the elements of a page by.
IDENTITY = re.compile("[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")


def run() -> xr.DataTree:
    """A point mass on a spring, and an event, which has no results."""
    system = System()
    bob = system.add(parts.Point(mass=1.0, position=(1.1, 0.0, 0.0)), name="bob")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b=bob, length=1.0, stiffness=100.0), name="spring")
    system.add(parts.Event(law="x - 2.0", variables={"x": "bob.position.x"}), name="far")
    return system.simulate(until=0.1, every=0.05)


@pytest.fixture
def observed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the parts whose results were made, in order."""
    made: list[str] = []
    for family in ("points", "springs"):
        real = observe.observers()[family]
        wrapped = lambda view, name, real=real: made.append(name) or real(view, name)  # noqa: E731
        monkeypatch.setitem(observe.observers(), family, wrapped)
    return made


def test_variables_of_a_part_are_made_when_one_is_asked_for(observed):
    found = run()
    assert (found.attrs["status"], list(found.children), observed) == ("success", ["bob", "spring"], [])
    assert found["bob"]["position"].sizes == {"time": 3, "axis": 3}
    assert found["bob"]["speed"].sizes["time"] == found.sizes["time"] == 3
    assert observed == ["bob"]
    assert type(found["bob"]) is type(found) is xr.DataTree
    assert repr(found)
    assert observed == ["bob", "spring"]


def test_groups_inherit_coordinates_before_the_root_is_made() -> None:
    found, whole = run(), run()
    assert whole.attrs["status"] == "success"
    xr.testing.assert_identical(found["bob"]["position"], whole["bob"]["position"])
    assert list(found["bob"].coords) == list(whole["bob"].coords)
    assert isinstance(found, tree._Later)  # whose energies and attributes are not made yet
    xr.testing.assert_identical(found.to_dataset().drop_attrs(), whole.to_dataset().drop_attrs())
    assert list(found.coords) == list(whole.coords)


def test_a_part_without_variables_is_an_empty_group() -> None:
    """A reel that no thread uses."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "hub")
    system.add(parts.Reel(body="hub", centre=(0.1, 0.0, 0.0), radius=0.05, drive=parts.ConstantDrive(rate=0.0)), "reel")
    found = system.simulate(until=0.1, every=0.05)
    assert not found["reel"].data_vars
    assert repr(found)


@pytest.mark.parametrize(
    "same",
    [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one)), lambda one: one.isel(time=slice(None)),
     lambda one: one.map_over_datasets(lambda dataset: dataset), xr.DataTree.copy],
    ids=["copy", "deepcopy", "pickle", "isel", "map", "own"],
)  # fmt: skip
def test_a_tree_that_waits_is_the_tree_that_was_made_at_once(same, monkeypatch):
    found = same(run())
    monkeypatch.setattr(tree, "_CAN_WAIT", False)
    at_once = run()
    assert {type(node) for node in found.subtree} == {xr.DataTree}
    for attributes in (found.attrs, at_once.attrs):
        for key in ("date", "history", "wall_time_s", "compile_time_s"):
            attributes.pop(key)
    assert found.identical(at_once)
    pages = [IDENTITY.sub("", one._repr_html_()) for one in (found, at_once)]
    assert pages[0] == pages[1]


def test_a_part_of_a_tree_that_waits_can_be_pickled_and_cut_off():
    group = pickle.loads(pickle.dumps(run()["spring"]))
    assert "force" in group.data_vars
    alone = run()
    part = alone["spring"]
    part.orphan()
    assert list(alone.children) == ["bob"]
    assert "force" in part.data_vars
    alone["more"] = xr.DataTree(xr.Dataset({"a": 1.0}))
    assert list(alone.children) == ["bob", "more"]
    del alone["bob"]
    assert list(alone.children) == ["more"]


def test_what_is_set_on_a_tree_that_waits_stays() -> None:
    """Attributes and encoding of the root and of a part, before and after the others are made."""
    found = run()
    found.attrs = {"mine": 1}
    found.encoding = {"unlimited_dims": {"time"}}
    found["bob"].attrs = {"mine": 2}
    assert found["energy_kinetic"].sizes == {"time": 3}
    assert found["bob"]["speed"].sizes == {"time": 3}
    assert (found.attrs, found["bob"].attrs) == ({"mine": 1}, {"mine": 2})
    assert found.encoding == {"unlimited_dims": {"time"}}
    assert type(found) is xr.DataTree
