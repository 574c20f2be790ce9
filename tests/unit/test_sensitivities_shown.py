"""Sensitivities as an answer: what is printed, drawn, shown in a notebook and written."""

import pathlib

import numpy as np
import pytest
import xarray as xr

from evolvent.analysis.sensitivity_results import Sensitivities
from evolvent_base.errors import InputError


def made(result=(2.0, 0.0), **attrs):
    """Two values by three keys; relative changes of a value that is zero are none."""
    derivative = np.array([[1.0, -4.0, 0.5], [1.0, 0.0, 2.0]])
    at = np.array([1.0, 2.0, 3.0])
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = derivative * at / np.array(result)[:, None]
    both = ("value", "key")
    return Sensitivities(xr.Dataset(
        {"derivative": (both, derivative), "relative": (both, relative), "result": ("value", list(result)),
         "at": ("key", at)},
        {"value": ["flap.angle.last", "flap.angle.max"], "key": ["parts.flap.mass", "parts.flap.inertia", "gravity.2"],
         "value_unit": ("value", ["rad", "rad"]), "key_unit": ("key", ["kg", "kg m2", "m/s2"]),
         "unit": (both, [["rad/kg", "rad/(kg m2)", "rad/(m/s2)"]] * 2)},
        {"method": "energy-momentum"} | attrs,
    ))  # fmt: skip


def test_printed_and_in_a_notebook():
    found = made(warning="the derivative is wrong", integration="errors are estimated")
    lines = str(found).splitlines()
    assert lines[0] == "Sensitivities, by energy-momentum"
    assert lines[2].split() == ["flap.angle.last", "parts.flap.mass", "1", "rad/kg", "0.5", "-"]
    assert lines[-3:] == ["errors are estimated", "", "warning: the derivative is wrong"]
    page = found._repr_html_()
    assert "rad/(kg m2)" in page
    assert "data:image/png" in page
    assert repr(found) == "<Sensitivities: 2 values by 3 keys, energy-momentum>"


def test_bars_of_values_that_are_not_zero(tmp_path):
    (figure,) = made().figures()
    (panel,) = figure.panels
    assert panel.title == "flap.angle.last"
    assert list(panel.y_names.values()) == ["flap.inertia", "gravity.2", "flap.mass"]  # the strongest on top
    assert [line.x[1] for line in panel.lines] == [-4.0, 0.75, 0.5]
    path = made().plot(str(tmp_path / "bars.png"))
    assert pathlib.Path(path).read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match="the sensitivities have no figure"):
        made(result=(0.0, 0.0)).plot()


def test_files(tmp_path):
    found = made()
    text = pathlib.Path(found.save(tmp_path / "s.csv")).read_text()
    assert text.splitlines()[0] == "value,key,derivative,unit,relative,error"
    with xr.open_dataset(found.save(tmp_path / "s.nc"), engine="h5netcdf") as kept:
        assert kept.derivative.values.tolist() == found.dataset.derivative.values.tolist()
        assert kept.unit.values[0].tolist() == ["rad/kg", "rad/(kg m2)", "rad/(m/s2)"]
    with pytest.raises(InputError, match=r"sensitivities are written as \.csv, \.nc"):
        found.save(tmp_path / "s.json")
