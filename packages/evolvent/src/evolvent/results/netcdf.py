"""NetCDF-4 files of plain data, written and read by h5py alone: five times as fast as through h5netcdf, and the same.

A NetCDF-4 file is an HDF5 file. Every dimension is a "dimension scale": its coordinate, or an empty dataset with a name
that says so. Every variable is attached to the scales of its dimensions, which are numbered (``_Netcdf4Dimid``).
Sources: NetCDF-4 file format specification, Unidata; NetCDF Climate and Forecast (CF) metadata conventions 1.11.
"""

from __future__ import annotations

import io
from collections.abc import Container, Hashable
from typing import TYPE_CHECKING, Any, BinaryIO

import lazy_loader as lazy
import numpy as np
import xarray as xr
from xarray import conventions

if TYPE_CHECKING:
    import h5py
else:
    h5py = lazy.load("h5py")

#: The conventions that files follow: UDUNITS units, coordinates without missing values.
CONVENTIONS = {"Conventions": "CF-1.11"}
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


def is_plain(run: xr.DataTree | xr.Dataset, inherited: Container[Hashable] = ()) -> bool:
    """Whether `write` can write a run: plain values, no encoding of the user's, no groups in groups.

    A part may have a variable that is called as a dimension which it has `inherited` (the axis of a joint), but not one
    that is called as a dimension of its own.
    """
    if isinstance(run, xr.DataTree):
        if any(node.children for node in run.children.values()):
            return False
        root, *parts = datasets(run).values()
        return is_plain(root) and all(is_plain(part, root.dims) for part in parts)
    if run.encoding.get("unlimited_dims"):
        return False
    for name, variable in run.variables.items():
        asked = {key for key, value in variable.encoding.items() if value not in (None, False, 0)}
        clash = variable.ndim != 1 and name in run.dims and name not in inherited
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
    attributes: dict[Any, Any] = CONVENTIONS | run.attrs
    if is_plain(run):
        write(run, file, attributes)
        return file.getbuffer()
    stated = run.copy()
    stated.attrs = attributes
    if isinstance(stated, xr.DataTree):
        groups = {node.path: _unfilled(node.to_dataset(inherit=False)) for node in stated.subtree}
        stated.to_netcdf(file, engine="h5netcdf", encoding=groups)
    else:
        stated.to_netcdf(file, engine="h5netcdf", encoding=_unfilled(stated))
    return file.getbuffer()


def _complete(dataset: xr.Dataset) -> list[str]:
    """Coordinates without missing values: those of dimensions, and others that have none.

    CF allows no `_FillValue` of the first; xarray gives one to every variable of numbers with a point.
    """
    found = []
    for name, values in dataset.coords.items():
        if name in dataset.dims or (values.dtype.kind == "f" and not np.isnan(values.values).any()):
            found.append(str(name))
    return found


def _unfilled(dataset: xr.Dataset) -> dict[str, dict[str, None]]:
    """Encoding that gives complete coordinates no `_FillValue`."""
    return {name: {"_FillValue": None} for name in _complete(dataset)}


def write(run: xr.DataTree | xr.Dataset, file: BinaryIO, attributes: dict[Any, Any] | None = None) -> None:
    """Write a run that `is_plain`, with the `attributes` in place of those of its root.

    So that no caller copies the run to change them: a tree of some hundred parts takes a second to copy.
    """
    with h5py.File(file, "w", track_order=True) as opened:
        scales: dict[str, Any] = {}
        count = 0
        for name, dataset in datasets(run).items():
            if name:
                group = opened.create_group(name, track_order=True)
            else:
                group, dataset = opened, dataset.copy()
                dataset.attrs = dataset.attrs if attributes is None else attributes
            count = _write(group, dataset, scales, first=count)
        made_with = f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}".encode("ascii")
        opened.attrs["_NCProperties"] = np.array(made_with, dtype=h5py.string_dtype("ascii", len(made_with)))


def _write(file: Any, dataset: xr.Dataset, inherited: dict[str, Any], *, first: int) -> int:
    """Write a data set into a file or group; returns the number of dimensions so far.

    Parameters
    ----------
    inherited : scales of the root and their numbers, which the root itself adds
    first : number of the next dimension
    """
    variables, attributes = conventions.cf_encoder(*conventions.encode_dataset_coordinates(dataset))
    for name in _complete(dataset):
        variables[name].attrs.pop("_FillValue", None)
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
        _set(scale, "_Netcdf4Dimid", np.int32(first + k))
        scales[dimension] = scale, first + k
    for name, variable in variables.items():
        target = made[str(name)]
        if name not in own:
            for k, dimension in enumerate(variable.dims):
                h5py.h5ds.attach_scale(target.id, scales[str(dimension)][0].id, k)
        if variable.dims:
            ids = [scales[str(d)][1] for d in variable.dims]
            _set(target, "_Netcdf4Coordinates", np.array(ids, dtype=np.int32))
            if name not in own:
                _set(target, "_Netcdf4Dimid", np.int32(ids[0]))
        _add_attributes(target, variable.attrs, {"_FillValue": target.dtype})
    _add_attributes(file, attributes, {})
    if file.name == "/":
        inherited |= scales
    return first + len(own)


def _dataset(file: Any, name: str, variable: xr.Variable) -> Any:
    """The dataset with the values of a variable."""
    values = np.asarray(variable.values)
    if values.dtype.kind in "UO":
        values = values.astype(object)
        return file.create_dataset(name, data=values, dtype=h5py.string_dtype(), track_order=True)
    return file.create_dataset(name, data=values, fillvalue=variable.attrs.get("_FillValue"), track_order=True)


def _add_attributes(target: Any, attributes: Any, kinds: Any) -> None:
    """Attributes as NetCDF keeps them: a number is a list of one; `kinds` names types that are asked for."""
    for name, value in attributes.items():
        single = np.isscalar(value) and not isinstance(value, str)
        _set(target, name, np.atleast_1d(np.asarray(value, dtype=kinds.get(name))) if single else value)


def _set(target: Any, name: str, value: Any) -> None:
    """Add an attribute that is not there yet, which h5py's own way looks for first."""
    values = np.asarray(value, order="C")
    if values.dtype.kind in "UO":
        values = np.asarray(value, dtype=h5py.string_dtype())
    kind = h5py.h5t.py_create(values.dtype, logical=True)
    h5py.h5a.create(target.id, name.encode(), kind, h5py.h5s.create_simple(values.shape)).write(values)


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
    with h5py.File(file, "r") as opened:
        scales: dict[int, str] = {}
        root, groups = _read_group(h5py.h5g.open(opened.id, b"/"), scales)
        found = {}
        for name, group in groups.items():
            found[name], inside = _read_group(group, dict(scales))
            if inside:
                raise NotPlain
    if not found:
        return root
    tree = xr.DataTree(root)
    tree.children = {name: xr.DataTree(dataset) for name, dataset in found.items()}
    return tree


def _read_group(group: Any, scales: dict[int, str]) -> tuple[xr.Dataset, dict[str, Any]]:
    """Data set of a group, and the groups in it.

    `scales` are names of dimensions by their numbers, to which its own are added.
    """
    items = {name.decode(): h5py.h5o.open(group, name) for name in group}
    groups = {name: item for name, item in items.items() if isinstance(item, h5py.h5g.GroupID)}
    held = {name: (item, _attributes(item)) for name, item in items.items() if isinstance(item, h5py.h5d.DatasetID)}
    empty = set()
    for name, (item, (_, of_format)) in held.items():
        if h5py.h5ds.is_scale(item):
            scales[int(of_format["_Netcdf4Dimid"])] = name
            if h5py.h5ds.get_scale_name(item).startswith(_NO_VALUES):
                empty.add(name)
    attributes, _ = _attributes(group)
    coordinates = str(attributes.pop("coordinates", "")).split()
    variables = {}
    for name, (item, (own, of_format)) in held.items():
        if name not in empty:
            variables[name] = _variable(item, own, of_format, scales)
            coordinates += str(variables[name].attrs.pop("coordinates", "")).split()
    found = xr.Dataset(variables, attrs=attributes)
    return found.set_coords([name for name in coordinates if name in variables]), groups


def _variable(item: Any, attributes: dict[str, Any], of_format: dict[str, Any], scales: dict[int, str]) -> xr.Variable:
    """A variable with its values."""
    shape, kind = item.shape, item.dtype
    if shape is None or item.get_create_plist().get_layout() == h5py.h5d.CHUNKED or not kind.isnative:
        raise NotPlain
    if shape and not h5py.h5ds.is_scale(item) and of_format.get("DIMENSION_LIST") != (len(shape),):
        raise NotPlain  # other programs find the dimensions by this list
    dimensions = [scales[number] for number in of_format["_Netcdf4Coordinates"].tolist()] if shape else []
    if h5py.check_string_dtype(kind) is not None:
        if h5py.check_string_dtype(kind).length is not None:
            raise NotPlain
        values = np.asarray(h5py.Dataset(item).asstr()[()], dtype=str)
    else:
        values = np.empty(shape, dtype=kind)
        if values.size:
            item.read(h5py.h5s.ALL, h5py.h5s.ALL, values)
        if attributes.get("dtype") == "bool" and kind == np.int8:
            del attributes["dtype"]
            values = values.astype(bool)
        if kind.kind == "f" and np.isnan(attributes.get("_FillValue", 0.0)):
            del attributes["_FillValue"]
    if "_FillValue" in attributes or kind.kind not in "iufO" or not _DECODED.isdisjoint(attributes):
        raise NotPlain
    return xr.Variable(dimensions, values, attributes)


def _attributes(item: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Attributes of a group or variable as xarray gives them, and those of the format, of which lists are their shape.

    An attribute that is a list of one is its entry, texts are a list.
    """
    found: dict[str, Any] = {}
    of_format: dict[str, Any] = {}
    names: list[bytes] = []
    h5py.h5a.iterate(item, lambda name, *_: names.append(name), index_type=h5py.h5.INDEX_CRT_ORDER)
    for encoded in names:
        attribute, name = h5py.h5a.open(item, encoded), encoded.decode()
        if name not in _OF_FORMAT:
            found[name] = _plain(attribute)
        elif name in ("_Netcdf4Coordinates", "_Netcdf4Dimid"):
            of_format[name] = _entries(attribute)
        elif isinstance(attribute.get_type(), h5py.h5t.TypeVlenID):
            of_format[name] = attribute.shape
    return found, of_format


def _entries(attribute: Any) -> np.ndarray:
    """Entries of an attribute."""
    if attribute.shape is None:
        raise NotPlain
    values = np.zeros(attribute.shape, dtype=attribute.dtype)
    attribute.read(values)
    return values


def _plain(attribute: Any) -> Any:
    """An attribute as xarray gives it."""
    values = _entries(attribute)
    text = h5py.check_string_dtype(values.dtype)
    if text is not None and text.length is None:
        texts = [one.decode("utf-8", "surrogateescape") for one in values.flat]
        return texts if values.ndim and len(texts) != 1 else texts[0]
    if values.ndim == 0 and values.dtype.kind not in "iufc":
        raise NotPlain
    return values[()] if values.ndim == 0 else values[0] if len(values) == 1 else values
