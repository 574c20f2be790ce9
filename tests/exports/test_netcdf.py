"""Results files follow the CF conventions, and files of before are still read."""

import h5py
import numpy as np
import pytest
import xarray as xr

import cf
import evolvent
from evolvent import parts, results
from evolvent.results import DIGEST


@pytest.mark.parametrize("name", ["heliogyro", "stand", "rib", "failed"])
def test_runs_follow_the_conventions(files, name):
    assert cf.faults(files[name]) == []
    with h5py.File(files[name]) as file:
        assert "_FillValue" not in file["time"].attrs
        assert file.attrs["history"].startswith("20")
        assert file.attrs["source"] == f"evolvent {evolvent.__version__}"


def test_modes_follow_the_conventions(tmp_path):
    system = evolvent.System()
    system.add(parts.RigidBody(mass=2.0, shape={"box": (1.0, 0.1, 1.0)}), "door")
    system.add(parts.Spring(a=(1.0, 1.0, 0.0), b="door", stiffness=1.0, length=0.2), "spring")
    system.modes().save(tmp_path / "modes.nc")
    assert cf.faults(tmp_path / "modes.nc") == []


def test_faults_are_found(tmp_path):
    """The rules of these tests find what they are for."""
    found = xr.Dataset(
        {"axis": (("time", "axis"), np.ones((2, 3)), {"units": "kg^(1/2)"})}, {"time": ("time", [0.0, 0.0])}
    )
    found.to_netcdf(tmp_path / "bad.nc", engine="h5netcdf")
    text = "\n".join(cf.faults(tmp_path / "bad.nc"))
    for fault in ("Conventions is None", "title is None", "several dimensions", "_FillValue", "not monotonic", "kg^"):
        assert fault in text


def test_a_file_of_before_is_read(files, tmp_path):
    """Without conventions, with fill values of all coordinates: as xarray wrote it, and its digest holds."""
    run = results.open(files["rib"])
    before = run.copy()
    before.attrs = {k: v for k, v in run.attrs.items() if k not in ("Conventions", "source", "history")}
    before.attrs[DIGEST] = results.digest(before)
    before.to_netcdf(tmp_path / "before.nc", engine="h5netcdf")
    with h5py.File(tmp_path / "before.nc") as file:
        assert np.isnan(file["time"].attrs["_FillValue"])
    again = results.open_unaltered(tmp_path / "before.nc")
    assert np.array_equal(again.time.values, run.time.values)
    results.save(again, tmp_path / "now.nc")
    assert cf.faults(tmp_path / "now.nc") == ["/: source is None"]


def test_incomplete_coordinates_keep_their_fill_value(tmp_path):
    run = xr.Dataset({"x": ("time", [1.0, np.nan])}, {"time": [0.0, 1.0], "arc": ("time", [np.nan, 2.0])})
    results.save(run, tmp_path / "a.nc")
    packed = run.copy()
    packed["x"].encoding = {"zlib": True}
    results.save(packed, tmp_path / "b.nc")
    for name in ("a.nc", "b.nc"):
        with h5py.File(tmp_path / name) as file:
            assert ["_FillValue" in file[key].attrs for key in ("x", "arc", "time")] == [True, True, False]
            assert file.attrs["Conventions"] == "CF-1.11"
