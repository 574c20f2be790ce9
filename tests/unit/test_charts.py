"""Charts of studies: a map states the values of its cells, with ticks at the values that were run."""

import numpy as np
import xarray as xr

from evolvent.design.studies import draw


def dataset(count):
    values = np.arange(2.0 * count).reshape(count, 2)
    return xr.Dataset(
        {"peak": (("stiffness", "damping"), values, {"units": "N", "long_name": "peak"})},
        {
            "stiffness": ("stiffness", np.geomspace(1.0, 4.0, count), {"units": "N/m"}),
            "damping": ("damping", [0.1, 0.3], {"units": "N s/m"}),
        },
        {"keys": '["stiffness", "damping"]', "sample": "grid"},
    )


def test_a_map_has_values_in_its_cells_and_ticks_at_what_was_run():
    ((panel,),) = [one.panels for one in draw.described(dataset(3))]
    assert panel.x_names == {1.0: "1", 2.0: "2", 4.0: "4"}
    assert panel.y_names == {0.1: "0.1", 0.3: "0.3"}
    places = [(x, y) for x in (1.0, 2.0, 4.0) for y in (0.1, 0.3)]
    assert [(note.at, note.text) for note in panel.notes] == [(at, str(k)) for k, at in enumerate(places)]


def test_a_map_of_many_cells_has_colours_alone():
    ((panel,),) = [one.panels for one in draw.described(dataset(20))]
    assert not panel.notes
    assert panel.x_names is None
    assert panel.y_names == {0.1: "0.1", 0.3: "0.3"}
