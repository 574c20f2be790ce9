"""Full names of variables: of parts, components, nodes, ends of beams and threads."""

import numpy as np
import pytest
import xarray as xr

from evolvent import InputError
from evolvent.assembly.references import FROM_TIP, OF_THE_RUN, check_name
from evolvent.results import variables

TIME, NODES = 3, 4


def dataset(first: float, long_name: str) -> xr.Dataset:
    """Positions of nodes over time, and one value without nodes."""
    x = first + np.arange(TIME * NODES * 3, dtype=float).reshape(TIME, NODES, 3)
    data = {
        "position": (("time", "node", "axis"), x, {"units": "m"}),
        "energy_elastic": (("time",), x[:, 0, 0], {"units": "J"}),
    }
    return xr.Dataset(data, {"node": ("node", np.arange(NODES), {"long_name": long_name})})


@pytest.fixture
def run() -> xr.DataTree:
    root = xr.Dataset({"energy": ("time", np.zeros(TIME))}, {"time": np.arange(TIME), "axis": list("xyz")})
    groups = {"boom": dataset(0.0, "node, 0 at the root"), "blade": dataset(100.0, FROM_TIP)}
    return xr.DataTree.from_dict({"/": root, **groups})


def test_ends_of_beams_and_threads(run):
    boom, blade = run["boom"].position, run["blade"].position
    for tree in (run, variables.flat(run)):
        for name, wanted in {
            "boom.root.position": boom[:, 0],
            "boom.tip.position": boom[:, -1],
            "boom.tip.position.y": boom[:, -1, 1],
            "boom[2].position.z": boom[:, 2, 2],
            "boom[2].position.magnitude": np.sqrt((boom[:, 2] ** 2).sum("axis")),
            "blade.tip.position": blade[:, 0],
        }.items():
            np.testing.assert_array_equal(variables.get(tree, name).values, wanted.values, err_msg=name)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("boom.tip.positon", "no variable is called 'boom.tip.positon'; did you mean 'boom.position'?"),
        ("boom.tip.energy_elastic", "'boom.energy_elastic' has no values at nodes, so none at 'boom.tip'"),
        ("blade.root.position", "'blade' is a thread, which has no root"),
        ("boom[4].position", "has no 4; it has 4, counted from 0"),
        ("bom.tip.position", "no variable is called 'bom.tip.position'"),
    ],
)
def test_a_name_that_is_none_is_refused(run, name, words):
    with pytest.raises(InputError) as refused:
        variables.get(run, name)
    assert words in str(refused.value)


@pytest.mark.parametrize("name", sorted(OF_THE_RUN))
def test_no_part_takes_the_name_of_a_result_of_the_run(name):
    with pytest.raises(InputError, match="a result of the whole run"):
        check_name(name)
