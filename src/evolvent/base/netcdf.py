"""NetCDF-4 files of plain data, written and read by h5py alone: five times as fast as through h5netcdf, and the same.

A NetCDF-4 file is an HDF5 file. Every dimension is a "dimension scale": its coordinate, or an empty dataset with a name
that says so. Every variable is attached to the scales of its dimensions, which are numbered (``_Netcdf4Dimid``).
Source: NetCDF-4 file format specification, Unidata.
"""

from __future__ import annotations

import io
from typing import Any, BinaryIO

import numpy as np
import xarray as xr
from xarray import conventions

#: Kinds of values that `write` knows: truth values, numbers and texts.
_KINDS = "biufU"
#: What xarray notes on variables that it has read, and that says nothing of how to write them.
_IDLE = {"source", "original_shape", "dtype", "_FillValue", "contiguous"}
#: Attributes of the format itself, which are none of a variable.
_OF_FORMAT = {
    "CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "_Netcdf4Coordinates", "_Netcdf4Dimid",
    "_nc3_strict",
}  # fmt: skip
#: Attributes that say how values are decoded, of which `read` knows none but a `_FillValue` that is not a number.
_DECODED = {"_Encoding", "_Unsigned", "add_offset", "dtype", "grid_mapping", "missing_value", "scale_factor"}
#: How the title of a dimension without values begins.
_NO_VALUES = b"This is a netCDF dimension but not a netCDF variable"


class NotPlain(Exception):
    """A file holds what `write` does not write."""


def is_plain(run: xr.DataTree | xr.Dataset) -> bool:
    """Whether `write` can write a run: plain values, no encoding of the user's, no groups in groups."""
    if isinstance(run, xr.DataTree):
        if any(node.children for node in run.children.values()):
            return False
        return all(map(is_plain, datasets(run).values()))
    if run.encoding.get("unlimited_dims"):
        return False
    for name, variable in run.variables.items():
        asked = {key for key, value in variable.encoding.items() if value not in (None, False, 0)}
        clash = variable.ndim != 1 and name in run.dims
        if variable.dtype.kind not in _KINDS or asked - _IDLE or clash:
            return False
    return True


def datasets(run: xr.DataTree | xr.Dataset) -> dict[str, xr.Dataset]:
    """Data sets of the root ('') and of all groups, without what they inherit."""
    if not isinstance(run, xr.DataTree):
        return {"": run}
    return {"": run.to_dataset()} | {name: node.to_dataset(inherit=False) for name, node in run.children.items()}


def image(run: xr.DataTree | xr.Dataset) -> memoryview:
    """A run or data set as the bytes of a NetCDF file.

    It is made in memory, where no write fails: HDF5 keeps a file open that it could not write, and ends the process
    with a fault as it tries again.
    """
    file = io.BytesIO()
    if is_plain(run):
        write(run, file)
    else:
        run.to_netcdf(file, engine="h5netcdf")
    return file.getbuffer()


def write(run: xr.DataTree | xr.Dataset, file: BinaryIO) -> None:
    """Write a run that `is_plain`."""
    import h5py

    with h5py.File(file, "w", track_order=True) as opened:
        scales: dict[str, Any] = {}
        count = 0
        for name, dataset in datasets(run).items():
            group = opened.create_group(name, track_order=True) if name else opened
            count = _write(group, dataset, scales, first=count)
        made_with = f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}".encode("ascii")
        opened.attrs["_NCProperties"] = np.array(made_with, dtype=h5py.string_dtype("ascii", len(made_with)))


def _write(file: Any, dataset: xr.Dataset, inherited: dict[str, Any], *, first: int) -> int:
    """Write a data set into a file or group; returns the number of dimensions so far.

    Parameters
    ----------
    inherited : scales of the root, which the root itself adds
    first : number of the next dimension
    """
    variables, attributes = conventions.cf_encoder(*conventions.encode_dataset_coordinates(dataset))
    made = {str(name): _dataset(file, str(name), variable) for name, variable in variables.items()}
    scales = dict(inherited)
    own = [str(d) for d in dataset.sizes if str(d) not in inherited]
    for k, dimension in enumerate(own):
        size = dataset.sizes[dimension]
        scale, title = made.get(dimension), dimension
        if scale is None:
            scale = file.create_dataset(title, shape=(size,), dtype=">f4", track_order=True)
            title = f"This is a netCDF dimension but not a netCDF variable.{size:10}"
        scale.make_scale(title)
        scale.attrs["_Netcdf4Dimid"] = np.int32(first + k)
        scales[dimension] = scale
    numbers = {name: scale.attrs["_Netcdf4Dimid"] for name, scale in scales.items()}
    for name, variable in variables.items():
        target = made[str(name)]
        if name not in own:
            for k, dimension in enumerate(variable.dims):
                target.dims[k].attach_scale(scales[str(dimension)])
        if variable.dims:
            ids = [numbers[str(d)] for d in variable.dims]
            target.attrs["_Netcdf4Coordinates"] = np.array(ids, dtype=np.int32)
            target.attrs["_Netcdf4Dimid"] = np.int32(ids[0])
        _add_attributes(target, variable.attrs, {"_FillValue": target.dtype})
    _add_attributes(file, attributes, {})
    if file.name == "/":
        inherited |= scales
    return first + len(own)


def _dataset(file: Any, name: str, variable: xr.Variable) -> Any:
    """The dataset with the values of a variable."""
    import h5py

    values = np.asarray(variable.values)
    if values.dtype.kind in "UO":
        values = values.astype(object)
        return file.create_dataset(name, data=values, dtype=h5py.string_dtype(), track_order=True)
    return file.create_dataset(name, data=values, fillvalue=variable.attrs.get("_FillValue"), track_order=True)


def _add_attributes(target: Any, attributes: Any, kinds: Any) -> None:
    """Attributes as NetCDF keeps them: a number is a list of one; `kinds` names types that are asked for."""
    for name, value in attributes.items():
        single = np.isscalar(value) and not isinstance(value, str)
        target.attrs[name] = np.atleast_1d(np.asarray(value, dtype=kinds.get(name))) if single else value


def read(file: BinaryIO) -> xr.DataTree | xr.Dataset:
    """A run or data set from a NetCDF file, with its values; a Dataset where there are no groups.

    A file that is not as `write` writes it is read by xarray. Times are not decoded.

    Parameters
    ----------
    file : open for reading bytes
    """
    try:
        return _read(file)
    except Exception:  # noqa: BLE001  (whatever is wrong with a file, xarray says it)
        file.seek(0)
    with xr.open_datatree(file, engine="h5netcdf", decode_times=False) as tree:
        found = tree.load()
        return found if found.children else found.to_dataset()


def _read(file: BinaryIO) -> xr.DataTree | xr.Dataset:
    """As `read`.

    Raises
    ------
    NotPlain
        If the file is not as `write` writes it; of a damaged one, any exception.
    """
    import h5py

    with h5py.File(file, "r") as opened:
        scales: dict[int, str] = {}
        root = _read_group(opened, scales)
        groups = {name: item for name, item in opened.items() if isinstance(item, h5py.Group)}
        found = {name: _read_group(group, dict(scales)) for name, group in groups.items()}
        if any(isinstance(item, h5py.Group) for group in groups.values() for item in group.values()):
            raise NotPlain
    if not found:
        return root
    tree = xr.DataTree(root)
    tree.children = {name: xr.DataTree(dataset) for name, dataset in found.items()}
    return tree


def _read_group(group: Any, scales: dict[int, str]) -> xr.Dataset:
    """Data set of a group; `scales` are names of dimensions by their numbers, to which its own are added."""
    from h5py import Dataset, h5ds

    items = {name: item for name, item in group.items() if isinstance(item, Dataset)}
    empty = set()
    for name, item in items.items():
        if h5ds.is_scale(item.id):
            scales[int(item.attrs["_Netcdf4Dimid"])] = name
            if h5ds.get_scale_name(item.id).startswith(_NO_VALUES):
                empty.add(name)
    attributes = _attributes(group)
    coordinates = str(attributes.pop("coordinates", "")).split()
    variables = {}
    for name, item in items.items():
        if name not in empty:
            variables[name] = _variable(item, scales)
            coordinates += str(variables[name].attrs.pop("coordinates", "")).split()
    return xr.Dataset(variables, attrs=attributes).set_coords([name for name in coordinates if name in variables])


def _variable(item: Any, scales: dict[int, str]) -> xr.Variable:
    """A variable with its values."""
    import h5py
    from h5py import h5a, h5ds, h5t

    if item.shape and not h5ds.is_scale(item.id):  # other programs find the dimensions by this list
        listed = h5a.open(item.id, b"DIMENSION_LIST")
        if listed.shape != (item.ndim,) or not isinstance(listed.get_type(), h5t.TypeVlenID):
            raise NotPlain
    dimensions = [scales[number] for number in item.attrs["_Netcdf4Coordinates"].tolist()] if item.shape else []
    attributes, kind = _attributes(item), item.dtype
    if item.chunks is not None or not kind.isnative:
        raise NotPlain
    if h5py.check_string_dtype(kind) is not None:
        if h5py.check_string_dtype(kind).length is not None:
            raise NotPlain
        values = np.asarray(item.asstr()[()], dtype=str)
    else:
        values = np.asarray(item[()])
        if attributes.get("dtype") == "bool" and kind == np.int8:
            del attributes["dtype"]
            values = values.astype(bool)
        if kind.kind == "f" and np.isnan(attributes.get("_FillValue", 0.0)):
            del attributes["_FillValue"]
    if "_FillValue" in attributes or kind.kind not in "iufO" or not _DECODED.isdisjoint(attributes):
        raise NotPlain
    return xr.Variable(dimensions, values, attributes)


def _attributes(item: Any) -> dict[str, Any]:
    """Attributes of a group or variable as xarray gives them: a list of one is its entry, texts are a list."""
    found = {}
    for name in item.attrs:
        if name not in _OF_FORMAT:
            value = item.attrs[name]
            if isinstance(value, np.ndarray):
                if value.dtype.kind == "O":
                    value = value.tolist()
                if len(value) == 1:
                    value = value[0]
            elif not isinstance(value, (str, np.number)):
                raise NotPlain
            found[name] = value
    return found
