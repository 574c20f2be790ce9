"""NetCDF files that are written and read by h5py alone: as those of h5netcdf, in every attribute."""

import importlib.metadata

import h5py
import numpy as np
import pytest
import xarray as xr

from evolvent import results
from evolvent.results import netcdf

VERSION = tuple(int(n) for n in importlib.metadata.version("h5netcdf").split(".")[:2])


@pytest.fixture
def sample(rng):
    """A data set with all that a run may hold."""
    values = rng.normal(size=(7, 2, 3))
    values[2, 1] = np.nan
    units = {"units": "m", "long_name": "a length, µ"}
    data = {
        "position": (("time", "blade", "axis"), values, units),
        "released": (("time", "blade"), values[:, :, 0] > 0.0, {"units": "1"}),
        "count": (("time",), np.arange(7), {"scale_J": 0.5, "limits": [1.0, 2.0], "steps": 3}),
        "small": (("time",), np.arange(7, dtype=np.float32)),
        "end_hub": (("coordinate",), values[0, 0]),
        "single": ((), 3.5, {"units": "s"}),
        "word": ((), "heave"),
        "names": (("blade",), np.array(["a", "longer ü"])),
    }
    coordinates = {"time": ("time", 0.1 * np.arange(7), {"units": "s"}), "axis": ("axis", ["x", "y", "z"])}
    attributes = {"Conventions": "CF-1.11", "title": "a run", "wall_time_s": 0.25, "case": "a: 1\nb: ü\n", "samples": 7}
    return xr.Dataset(data, coordinates, attributes).assign_coords(station=("blade", [1.0, 2.0]))


def content(path) -> dict:
    """All that an HDF5 file holds: types, fill values, attributes, scales."""
    found = {}
    with h5py.File(path) as file:
        for name, item in {"/": file, **file}.items():
            attrs = {}
            for key, value in item.attrs.items():
                if key not in ("DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties"):
                    attrs[key] = (np.asarray(value).shape, np.asarray(value).dtype.kind, np.asarray(value).tolist())
            found[name] = {"attrs": {key: repr(value) for key, value in attrs.items()}}
            if name != "/":
                scales = [[scale.name for scale in dims.values()] for dims in item.dims]
                found[name] |= {"dtype": item.dtype, "shape": item.shape, "scales": scales}
                found[name] |= {"fill": repr(item.fillvalue), "scale": item.is_scale}
    return found


@pytest.mark.slow
def test_file_is_that_of_h5netcdf(sample, tmp_path):
    assert netcdf.is_plain(sample)
    netcdf.write(sample, str(tmp_path / "ours.nc"))
    complete = {name: {"_FillValue": None} for name in ("time", "station")}
    sample.to_netcdf(tmp_path / "theirs.nc", engine="h5netcdf", encoding=complete)
    if VERSION >= (1, 8):  # older ones write numbers as arrays of one, and fewer attributes of their own
        ours, theirs = content(tmp_path / "ours.nc"), content(tmp_path / "theirs.nc")
        assert set(ours) == set(theirs)
        for name in theirs:
            assert ours[name] == theirs[name], name
    read = [xr.load_dataset(tmp_path / name, engine="h5netcdf") for name in ("ours.nc", "theirs.nc")]
    xr.testing.assert_identical(*read)
    xr.testing.assert_identical(read[0], sample)
    assert list(read[0].variables) == list(read[1].variables)
    # what was read, whose texts are objects, can be written again
    results.save(read[0], tmp_path / "again.nc")
    again = xr.load_dataset(tmp_path / "again.nc", engine="h5netcdf")
    assert again.attrs.pop(results.DIGEST) == results.digest(sample)
    xr.testing.assert_identical(again, sample)


def test_what_is_not_plain_is_left_to_xarray(sample, tmp_path):
    packed = sample.copy()
    packed["position"].encoding = {"zlib": True, "complevel": 4}
    dated = sample.assign(day=("blade", np.array(["2026-01-01", "2026-01-02"], dtype="datetime64[ns]")))
    for k, dataset in enumerate((packed, dated)):
        assert not netcdf.is_plain(dataset)
        results.save(dataset, tmp_path / f"{k}.nc")
        read = xr.load_dataset(tmp_path / f"{k}.nc", engine="h5netcdf")
        assert read.sizes == dataset.sizes
    with h5py.File(tmp_path / "0.nc") as file:
        assert file["position"].compression == "gzip"


@pytest.mark.parametrize("dimension", ["time", "blade"])
def test_a_dimension_without_entries_is_plain(sample, dimension, tmp_path):
    empty = sample.isel({dimension: slice(0, 0)})
    assert netcdf.is_plain(empty)
    netcdf.write(empty, str(tmp_path / "empty.nc"))
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "empty.nc", engine="h5netcdf"), empty)
    with (tmp_path / "empty.nc").open("rb") as file:
        xr.testing.assert_identical(netcdf._read(file), empty)


@pytest.fixture
def tree(sample):
    """A run with a part, which has coordinates of its own."""
    part = sample[["position", "small", "names"]].rename_dims(axis="node").drop_vars(["axis", "station"])
    part = part.assign_attrs(kind="beam", texts=["a", "b"]).drop_vars("time").assign_coords(node=[1, 2, 3])
    return xr.DataTree(sample, children={"boom": xr.DataTree(part)})


def as_xarray_reads(path):
    """A run or data set with its values, read by xarray."""
    with xr.open_datatree(path, engine="h5netcdf", decode_times=False) as found:
        found.load()
    return found if found.children else found.to_dataset()


@pytest.mark.parametrize("kind", ["sample", "tree"])
def test_what_is_read_is_what_xarray_reads(request, kind, tmp_path, monkeypatch):
    run = request.getfixturevalue(kind)
    results.save(run, tmp_path / "run.nc")
    theirs = as_xarray_reads(tmp_path / "run.nc")
    monkeypatch.setattr(xr, "open_datatree", None)
    with (tmp_path / "run.nc").open("rb") as file:
        ours = netcdf.read(file)
    assert type(ours) is type(theirs)
    xr.testing.assert_identical(ours, theirs)
    for (name, one), other in zip(netcdf.datasets(ours).items(), netcdf.datasets(theirs).values(), strict=True):
        assert list(one.variables) == list(other.variables), name
        for held, found in ((one, other), *((one[key], other[key]) for key in one.variables)):
            assert list(held.attrs) == list(found.attrs)
            assert [type(value) for value in held.attrs.values()] == [type(value) for value in found.attrs.values()]
    assert ours.attrs.pop(results.DIGEST) == results.digest(run)
    assert netcdf.is_plain(ours)


def test_a_variable_called_as_a_dimension_of_the_whole_run_is_plain(tree, sample, tmp_path):
    """As the axis of a joint is; one that is called as a dimension of its own part is left to xarray."""
    joint = xr.DataTree(xr.Dataset({"axis": (("time", "axis"), np.ones((7, 3)), {"units": "1"})}))
    run = tree.assign({"elbow": joint})
    assert netcdf.is_plain(run)
    netcdf.write(run, str(tmp_path / "ours.nc"))
    run.to_netcdf(tmp_path / "theirs.nc", engine="h5netcdf")
    for name in ("ours.nc", "theirs.nc"):
        xr.testing.assert_identical(as_xarray_reads(tmp_path / name), run)
        with (tmp_path / name).open("rb") as file:
            xr.testing.assert_identical(netcdf._read(file), run)
    own = xr.DataTree(xr.Dataset({"node": (("time", "node"), np.ones((7, 2)))}))
    assert not netcdf.is_plain(tree.assign({"elbow": own}))
    assert not netcdf.is_plain(own)


@pytest.mark.slow
def test_what_was_not_written_here_is_read_by_xarray(tree, tmp_path):
    packed = tree.to_dataset()
    packed["position"].encoding = {"zlib": True, "complevel": 4}
    packed["small"].encoding = {"dtype": "int16", "scale_factor": 2.0, "_FillValue": -1}
    packed.to_netcdf(tmp_path / "packed.nc", engine="h5netcdf")
    deep = tree.copy()
    deep["boom/tip"] = xr.DataTree(xr.Dataset({"deflection": ("time", np.arange(7.0))}))
    deep.to_netcdf(tmp_path / "deep.nc", engine="h5netcdf")
    for path in (tmp_path / "packed.nc", tmp_path / "deep.nc"):
        with path.open("rb") as file:
            with pytest.raises(netcdf.NotPlain):
                netcdf._read(file)
            file.seek(0)
            xr.testing.assert_identical(netcdf.read(file), as_xarray_reads(path))
