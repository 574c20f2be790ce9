"""Variables of a run by their full names: 'hub.rate', 'boom.tip.velocity', 'boom[5].position.y', 'energy_defect'."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Hashable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from evolvent.assembly.references import FROM_TIP
from evolvent.model.family import EXTREMES
from evolvent.results.observe.variables import Variable
from evolvent_base.errors import InputError, nearest

_NAME = re.compile(
    r"(?P<part>[^.\[\]]+)(?:\[(?P<node>\d+)\]|\.(?P<end>root|tip)(?=\.))?"
    r"(?:\.(?P<variable>\w+))?(?:\.(?P<axis>[A-Za-z]|magnitude))?"
)
_NUMBERED = re.compile(r"(?P<variable>\w+)\[(?P<number>\d+)\]")
#: Dimensions that mean the same in every group.
SHARED = ("time", "axis", "quaternion")
#: Values with dimensions: of a data set, alone, or of a part.
Values = TypeVar("Values", xr.DataArray, xr.Variable, Variable)
_AXES = {"axis": "xyz", "quaternion": "wxyz"}
#: Attribute beside `EXTREMES` with the samples that they belong to: how many, and the least and largest of each entry.
OF_SAMPLES = "extremes_of_samples"
#: Share within which these are the same, of a file in single precision as well.
_SAME = 1e-6
#: What stands in place of a component for the length of a vector.
MAGNITUDE = "magnitude"


def names(run: xr.DataTree | xr.Dataset, *, over_time: bool = True) -> list[str]:
    """Full names of all numeric variables, those of the root first.

    Parameters
    ----------
    run : xarray.DataTree or Dataset
    over_time : bool, whether only those that have the dimension `time` are listed
    """

    def listed(dataset: xr.Dataset, before: str) -> Iterator[str]:
        for name, variable in dataset.data_vars.items():
            if variable.dtype.kind in "biuf" and ("time" in variable.dims or not over_time):
                yield before + str(name)

    found = list(listed(root_dataset(run), ""))
    for part in parts(run):
        found += listed(group_of(run, part), f"{part}.")
    return found


def parts(run: xr.DataTree | xr.Dataset) -> list[str]:
    """Names of the parts that a run has results of."""
    return [str(name) for name in run.children] if isinstance(run, xr.DataTree) else []


def get(run: xr.DataTree | xr.Dataset, name: str) -> xr.DataArray:
    """A variable by its full name.

    Parameters
    ----------
    name : str
        'hub.rate' of a part, 'energy' of the root, 'hub.rate.z' a component, 'hub.rate.magnitude' the length of a
        vector, 'boom[5].position' at a node,
        'boom.tip.velocity' at the tip of a beam or thread, 'boom.root.slope' at the root of a beam; of the root
        'sensor_displacement[2]' that of the sensor 2 (of a dimension without coordinates the index, from 0).

    Raises
    ------
    InputError
        If there is none; the sentence names the nearest one.
    """
    root = root_dataset(run)
    if name in root.variables:
        return root[name]
    match = _NAME.fullmatch(name)
    numbered = _NUMBERED.fullmatch(name)
    if numbered is not None and numbered["variable"] in root.variables:
        return _numbered(root[numbered["variable"]], int(numbered["number"]), name)
    if match is None:
        raise InputError(f"no variable is called {name!r}; {nearest(name, names(run, over_time=False))}")
    part, variable = match["part"], match["variable"]
    full = f"{part}.{variable}"
    if full in root.variables:  # of `flat`
        return entry(root[full], match, name, _texts(root[full]))
    if part in root.variables and variable in (*"xyzw", MAGNITUDE) and match["axis"] is None:  # a component of the root
        return _component(root[part], name, variable)
    if part not in parts(run):
        raise InputError(f"no variable is called {name!r}; {nearest(name, names(run, over_time=False))}")
    group = group_of(run, part, inherit=True)
    if variable is None:
        own = [k.partition(".")[2] for k in names(run, over_time=False) if k.startswith(f"{part}.")]
        raise InputError(f"{name!r} is a part; give one of its variables: {', '.join(own)}")
    if variable not in group.variables:
        raise InputError(f"no variable is called {name!r}; {nearest(full, names(run, over_time=False))}")
    return entry(group[variable], match, name, _texts(group[variable]))


@functools.lru_cache(maxsize=1024)
def matched(name: str) -> re.Match[str] | None:
    """Words of the full name of a part's variable: part, node, end, variable and axis; None of what is none."""
    return _NAME.fullmatch(name)


def _texts(found: xr.DataArray) -> dict[Hashable, str]:
    """What the coordinates of a variable's dimensions are."""
    return {dim: str(found.coords[dim].attrs.get("long_name", "")) for dim in found.dims if dim in found.coords}


def _numbered(found: xr.DataArray, number: int, name: str) -> xr.DataArray:
    """Values of a variable of the root at a label of its other dimension, or at an index where it has no labels."""
    dimension = next((d for d in found.dims if d not in SHARED), None)
    if dimension is None:
        raise InputError(f"{name!r}: {found.name} has one value at a time; leave [{number}] out")
    labels = found[dimension].values
    place = np.flatnonzero(labels == number)
    if place.size != 1:
        raise InputError(f"{name!r}: {found.name} has no {number}; it has {', '.join(map(str, labels[:20]))}")
    return found.isel({dimension: int(place[0])})


def entry(found: Values, match: re.Match[str], name: str, texts: Mapping[Hashable, str]) -> Values:
    """What a name means of a part's variable: all of it, or its values at a node, or a component.

    Parameters
    ----------
    match : of `matched`
    texts : what the coordinates of its dimensions are
    """
    if match["node"] is not None:
        dimension = next((d for d in found.dims if d not in SHARED), None)
        number = int(match["node"])
        if dimension is None or number >= found.sizes[dimension]:
            count = "none" if dimension is None else f"{found.sizes[dimension]}, counted from 0"
            raise InputError(f"{name!r}: {match['part']}.{match['variable']} has no {number}; it has {count}")
        found = _isel(found, {dimension: number})
    elif match["end"] is not None:
        found = _isel(found, _end(found, match, texts))
    return found if match["axis"] is None else _component(found, name, match["axis"])


def _isel(found: Values, chosen: Mapping[Hashable, int]) -> Values:
    """The entries at indices of dimensions other than time, with their extremes."""
    own = found.isel(chosen)
    if isinstance(found, Variable) or (extremes := extremes_of(found)) is None:
        return own
    at: list[Any] = [chosen.get(dim, slice(None)) for dim in found.dims if dim != "time"]
    return with_extremes(own, extremes[:, *at])


def extremes_of(found: xr.DataArray | xr.Variable | Variable) -> np.ndarray | None:
    """Least and largest values over all steps of a variable, (2, ...), with its dimensions other than time.

    None if they are not known, as of a part of the samples, or of what is computed from the variable.
    """
    if isinstance(found, Variable):
        return found.extremes
    if "time" not in found.dims or not {EXTREMES, OF_SAMPLES} <= found.attrs.keys():
        return None
    noted, samples = (np.asarray(found.attrs[key]) for key in (EXTREMES, OF_SAMPLES))
    shape = tuple(size for dim, size in found.sizes.items() if dim != "time")
    count = 2 * math.prod(shape)
    if {noted.dtype.kind, samples.dtype.kind} - {"f", "i"} or (noted.size, samples.size) != (count, count + 1):
        return None
    same = np.allclose(samples, _samples_of(found), rtol=_SAME, atol=0.0, equal_nan=True)
    return np.reshape(noted, (2, *shape)) if same else None


def _samples_of(found: xr.DataArray | xr.Variable) -> np.ndarray:
    """`OF_SAMPLES` of a variable over time."""
    own = found.transpose("time", ...).values
    if not len(own):
        return np.zeros(1)
    least, largest = np.fmin.reduce(own, axis=0), np.fmax.reduce(own, axis=0)
    return np.concatenate([[len(own)], np.ravel(least), np.ravel(largest)])


def with_extremes(found: Values, extremes: np.ndarray) -> Values:
    """A variable over time with its least and largest values over all steps, as of `extremes_of`."""
    if isinstance(found, Variable):
        return found._replace(extremes=extremes)
    found = found.copy(deep=False)
    found.attrs = {**found.attrs, EXTREMES: np.ravel(extremes), OF_SAMPLES: _samples_of(found)}
    return found


def at_samples(of: xr.Dataset, samples: np.ndarray) -> xr.Dataset:
    """Variables at some of their samples, whose extremes are still those over all steps."""
    found = of.isel(time=samples, missing_dims="ignore")
    noted = ((name, extremes_of(values)) for name, values in of.data_vars.items())
    return found.assign({name: with_extremes(found[name], own) for name, own in noted if own is not None})


def without_extremes(found: Values) -> Values:
    """A variable without the attribute `extremes`, which does not hold after an operation on it."""
    if not isinstance(found, Variable) and EXTREMES in found.attrs:
        found.attrs = {name: value for name, value in found.attrs.items() if name not in (EXTREMES, OF_SAMPLES)}
    return found


def _end(found: Values, match: re.Match[str], texts: Mapping[Hashable, str]) -> dict[Hashable, int]:
    """Dimension and number of the node at an end of a beam or thread; the nodes of a thread count from its tip."""
    dimension = next((d for d in found.dims if str(d).rpartition(".")[2] == "node"), None)
    if dimension is None:
        raise InputError(
            f"'{match['part']}.{match['variable']}' has no values at nodes, so none at '{match['part']}.{match['end']}'"
        )
    if texts.get(dimension) == FROM_TIP:
        if match["end"] == "root":
            raise InputError(
                f"{match['part']!r} is a thread, which has no root; give a node, counted from 0 at the tip"
            )
        return {dimension: 0}
    return {dimension: 0 if match["end"] == "root" else -1}


def _component(found: Values, name: str, axis: str) -> Values:
    if axis == MAGNITUDE and "axis" in found.dims:
        return without_extremes(found.reduce(np.linalg.norm, "axis", keep_attrs=True))
    for dimension, letters in _AXES.items():
        if dimension in found.dims and axis in letters:
            return _isel(found, {dimension: letters.index(axis)})
    known = [letter for dimension, letters in _AXES.items() if dimension in found.dims for letter in letters]
    known += [MAGNITUDE] if "axis" in found.dims else []
    allowed = f"known: {', '.join(known)}" if known else "it has no components"
    raise InputError(f"{name!r}: the variable has no component {axis!r}; {allowed}")


def group_of(run: xr.DataTree | xr.Dataset, part: str, *, inherit: bool = False) -> xr.Dataset:
    """Variables of a part; with `inherit`, the coordinates of the root as well."""
    assert isinstance(run, xr.DataTree)
    return run.children[part].to_dataset(inherit=inherit)


def root_dataset(run: xr.DataTree | xr.Dataset) -> xr.Dataset:
    """Variables of the root of a run; of a data set, itself."""
    return run.to_dataset() if isinstance(run, xr.DataTree) else run


@functools.lru_cache(maxsize=1024)
def owner(name: str) -> str:
    """The word before the first dot or bracket of a full name: the part, or a variable of the root."""
    return re.split(r"[.\[]", name, maxsplit=1)[0]


def values(found: xr.DataArray) -> np.ndarray:
    """Values over time: (nt, k), components and entries in columns."""
    array = found.transpose("time", ...).values
    return np.asarray(array.reshape(array.shape[0], -1), dtype=float)


def numbered(
    shapes: Mapping[str, tuple[tuple[str, ...], tuple[int, ...]]], coordinates: Mapping[str, str]
) -> xr.Dataset:
    """A data set like that of `flat` whose values count the entries at a sample, so that `get` finds entries by name.

    Parameters
    ----------
    shapes : mapping, full name -> (dimensions, shape)
    coordinates : mapping, full name of a dimension -> long name
    """
    data = {}
    for name, (dims, shape) in shapes.items():
        inner = shape[1:] if dims[:1] == ("time",) else shape
        count = np.arange(math.prod(inner)).reshape(inner)
        data[name] = xr.Variable(dims, np.broadcast_to(count, shape))
    sizes = {dim: size for dims, shape in shapes.values() for dim, size in zip(dims, shape, strict=True)}
    own = {
        dim: xr.Variable((dim,), np.arange(sizes[dim]), {"long_name": text})
        for dim, text in coordinates.items()
        if dim in sizes
    }
    return xr.Dataset(data, own)


def flat(run: xr.DataTree | xr.Dataset) -> xr.Dataset:
    """All variables of a run in one data set, by their full names; dimensions of a part's own carry its name.

    Parameters
    ----------
    run : xarray.DataTree or Dataset; a Dataset is returned as it is

    Examples
    --------
    >>> flat(run)["boom.deflection"].dims  # doctest: +SKIP
    ('time', 'boom.node', 'axis')
    """
    if not isinstance(run, xr.DataTree):
        return run
    found = run.to_dataset()
    data: dict[str, xr.Variable] = {}
    for part in parts(run):
        group = group_of(run, part)
        for name, variable in group.variables.items():
            if name in SHARED:
                continue
            dims = tuple(d if d in SHARED else f"{part}.{d}" for d in variable.dims)
            data[f"{part}.{name}"] = xr.Variable(dims, variable.values, variable.attrs)
    found = found.assign(data)
    found.attrs = dict(run.attrs)
    return found
