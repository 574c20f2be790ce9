"""What a study asks: a case, the keys that vary, and how their values are drawn; all checked before anything runs."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import math
import os
import pathlib
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args

import numpy as np
import yaml

from evolvent import cases, units
from evolvent.errors import InputError, nearest
from evolvent.studies.record import REDUCTIONS

_SYSTEMS = pathlib.Path(cases.__file__).parent / "systems"
#: How the name of a built-in study's file ends.
SUFFIX = ".study.yaml"
SAMPLES = ("grid", "list", "latin-hypercube", "monte-carlo")
_KEYS = ("study", "case", "set", "sample", "over", "samples", "seed", "keep", "batch")
#: Most cases that a study may have.
MOST_CASES = 10_000_000
#: Most cases that are planned before anything runs.
_CORNERS = 16


@dataclasses.dataclass(frozen=True, kw_only=True)
class Axis:
    """A key that varies.

    Attributes
    ----------
    key : str, dotted
    values : tuple, one for each point (grid) or for each case
    unit, what : str, of the key, as its schema says
    """

    key: str
    values: tuple[Any, ...]
    unit: str
    what: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class Study:
    """A checked study.

    Attributes
    ----------
    name : str
    content : dict, the case that varies
    fixed : dict, key -> value, what the study sets in every case
    system : str
    sample : str, one of `SAMPLES`
    axes : tuple of Axis
    seed : int
    seed_key : str, key of the case that takes a seed of its own in every case; '' for none
    seed_most : int, largest seed that it takes
    keep : tuple of str, what is kept of every run; empty for the default
    batch : int, cases a task; 0 for automatic
    text : str, the study as YAML that holds its whole case and can be swept again
    """

    name: str
    content: dict[str, Any]
    fixed: dict[str, Any]
    system: str
    sample: str
    axes: tuple[Axis, ...]
    seed: int
    seed_key: str
    seed_most: int
    keep: tuple[str, ...]
    batch: int
    text: str

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of points along every dimension of the results."""
        if self.sample == "grid":
            return tuple(len(axis.values) for axis in self.axes)
        return (len(self.axes[0].values),)

    @property
    def dims(self) -> tuple[str, ...]:
        """Dimensions that the cases span: the keys of a grid, else "case"."""
        return tuple(axis.key for axis in self.axes) if self.sample == "grid" else ("case",)

    @property
    def count(self) -> int:
        """Number of cases."""
        return math.prod(self.shape)

    def overrides(self, index: int) -> dict[str, Any]:
        """What case `index` changes, key -> value, with what all change."""
        places = np.unravel_index(index, self.shape)
        if self.sample != "grid":
            places = places * len(self.axes)
        found = self.fixed | {axis.key: axis.values[int(k)] for axis, k in zip(self.axes, places, strict=True)}
        if self.seed_key:
            found[self.seed_key] = self.case_seed(index)
        return found

    def case_seed(self, index: int) -> int:
        """The seed of case `index`: the same however the cases are spread over workers."""
        state = np.random.SeedSequence(self.seed, spawn_key=(index,)).generate_state(1, np.uint64)
        return int(state[0]) % (self.seed_most + 1)

    @functools.cached_property
    def digests(self) -> dict[str, str]:
        """Hash of the cases, and of what is kept; what a store is compared by."""
        asked = [self.content, self.fixed, self.sample, [(a.key, a.values) for a in self.axes]]
        return {
            "cases": _digest([*asked, self.seed_key, self.seed if self.seed_key else 0]),
            "kept variables": _digest(list(self.keep)),
        }


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


# ------------------------------------------------------------------------------------------------ built-in


@functools.cache
def _files() -> dict[str, pathlib.Path]:
    """Files of the built-in studies by name: ``inertia_stand/map.study.yaml`` is ``inertia-stand-map``."""
    found = {}
    for path in sorted(_SYSTEMS.rglob(f"*{SUFFIX}")):
        name = str(path.relative_to(_SYSTEMS))[: -len(SUFFIX)]
        found[re.sub(r"[\\/_]", "-", name)] = path
    return found


def built_in() -> dict[str, str]:
    """Built-in studies, name -> what it is (the first line of its file)."""
    first = {name: path.read_text(encoding="utf-8").partition("\n")[0] for name, path in _files().items()}
    return {name: line.lstrip("# ").strip() for name, line in first.items()}


def text(name: str) -> str:
    """A built-in study as the text that a user edits.

    Raises
    ------
    InputError
        If there is no such study.
    """
    if name not in _files():
        raise InputError(f"no study is called {name!r}; {nearest(name, _files())}")
    return _files()[name].read_text(encoding="utf-8")


# ------------------------------------------------------------------------------------------------ reading


def read(study: str | os.PathLike[str] | Mapping[str, Any]) -> Study:
    """A checked study.

    Parameters
    ----------
    study : str, path or mapping
        Name of a built-in study, a YAML file, or content.

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed. Every case has been checked against its schema.
    """
    content, folder = _content(study)
    for key in content:
        if key not in _KEYS:
            raise InputError(f"unknown key {key!r} in the study; {nearest(str(key), _KEYS)}")
    name = content.get("study", "study")
    if not isinstance(name, str) or not re.fullmatch(r"\w[\w.-]*", name):
        raise InputError(f"study is {name!r}; it must be a name of letters, digits, '-' and '_'")
    sample = content.get("sample", "grid")
    if sample not in SAMPLES:
        raise InputError(f"sample is {sample!r}; {nearest(str(sample), SAMPLES)}")
    random = sample in ("latin-hypercube", "monte-carlo")
    seed = _whole(content, "seed", 0, least=0, most=2**63 - 1)
    if random and "samples" not in content:
        raise InputError(f"samples is missing; sample: {sample} needs the number of cases, such as 100")
    if not random and "samples" in content:
        raise InputError(f"samples is given, but sample: {sample} takes the values that stand in 'over'")
    samples = _whole(content, "samples", 0, least=1, most=MOST_CASES)
    case = _case(content, folder)
    fixed = _section(content, "set")
    system = case.get("system")
    if not isinstance(system, str):
        raise InputError(f"the case's key 'system' is {system!r}; {nearest(str(system), cases.systems())}")
    module = cases.system(system)
    axes = _axes(_section(content, "over"), sample, module.Case, samples, seed)
    varied = {axis.key for axis in axes}
    seed_key, seed_most = _seed_key(module, varied | set(fixed))
    keep = _keep(content)
    batch = _whole(content, "batch", 0, least=1, most=MOST_CASES)
    found = Study(
        name=name,
        content=case,
        fixed=fixed,
        system=system,
        sample=sample,
        axes=axes,
        seed=seed,
        seed_key=seed_key,
        seed_most=seed_most,
        keep=keep,
        batch=batch,
        text=_text(content, case),
    )
    if found.count > MOST_CASES:
        raise InputError(f"the study has {found.count:.3g} cases; at most {MOST_CASES:.0e} are possible")
    return _checked(found, module)


def _content(study: Any) -> tuple[dict[str, Any], pathlib.Path]:
    """Content of a study, and the folder that its case file may stand in."""
    if isinstance(study, Mapping):
        return dict(study), pathlib.Path()
    if not isinstance(study, (str, os.PathLike)):
        raise InputError(f"a study is a name, a file or a mapping, not {type(study).__name__}")
    name = os.fspath(study)
    if name in _files():
        path, source = _files()[name], text(name)
    else:
        if not os.path.exists(name) and not re.search(r"[./\\]", name):
            raise InputError(f"no study is called {name!r}; {nearest(name, _files())}")
        path = pathlib.Path(name)
        source = _source(path)
    content = cases.parse_yaml(source, name)
    if not isinstance(content, dict):
        raise InputError(f"{name}: a study is a mapping of keys to values, this is not")
    return content, path.parent


def _source(path: pathlib.Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(f"cannot read {str(path)!r}: it is not a text file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot read {str(path)!r}: {reason.lower()}") from None


def _case(content: Mapping[str, Any], folder: pathlib.Path) -> dict[str, Any]:
    """Content of the study's case."""
    if "case" not in content:
        raise InputError(f"the study's key 'case' is missing; {nearest('', cases.built_in())}, or a file, or keys")
    case = content["case"]
    if isinstance(case, dict):
        return dict(case)
    if not isinstance(case, str):
        raise InputError(f"case is {case!r}; it must be the name of a built-in case, a file, or a case's keys")
    if case in cases.built_in() or not re.search(r"[./\\]", case):
        found = cases.parse_yaml(cases.text(case), case)
    else:
        path = (folder / case).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise InputError(f"case is {case!r}; a case file must stand in the folder of its study, or below")
        found = cases.parse_yaml(_source(path), case)
    if not isinstance(found, dict):
        raise InputError(f"{case}: a case is a mapping of keys to values, this is not")
    return found


def _section(content: Mapping[str, Any], key: str) -> dict[str, Any]:
    section = content.get(key) or {}
    if not isinstance(section, dict):
        raise InputError(f"{key} is {section!r}; it must be a mapping of keys of the case (blade.nodes) to values")
    return section


def _whole(content: Mapping[str, Any], key: str, default: int, *, least: int, most: int, where: str = "") -> int:
    value = content.get(key, default)
    if key in content and (isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most):
        raise InputError(f"{where}{key} is {value!r}; it must be a whole number from {least} to {most}")
    return int(value)


def _keep(content: Mapping[str, Any]) -> tuple[str, ...]:
    keep = content.get("keep") or []
    if not isinstance(keep, list) or not all(isinstance(name, str) for name in keep):
        raise InputError(f"keep is {keep!r}; it must be a list of variables, such as [body_rate.last]")
    for name in keep:
        _, dot, reduction = name.partition(".")
        if dot and reduction not in REDUCTIONS:
            raise InputError(f"keep holds {name!r}; after the dot, {nearest(reduction, REDUCTIONS)}")
    return tuple(dict.fromkeys(keep))


def _seed_key(module: Any, given: set[str]) -> tuple[str, int]:
    """Key that takes a seed in every case, and the largest one; ('', 0) if there is none or the study gives it."""
    key = getattr(module, "SEED_KEY", None)
    if key is None or key in given:
        return "", 0
    most = getattr(_annotation(module.Case, key)[0], "most", None)
    return key, min(int(most), 2**53) if most is not None else 2**53


def _text(content: Mapping[str, Any], case: Mapping[str, Any]) -> str:
    whole = {key: content[key] for key in _KEYS if key in content} | {"case": case}
    ordered = {key: whole[key] for key in _KEYS if key in whole}
    return yaml.safe_dump(ordered, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True)


# ------------------------------------------------------------------------------------------------ what varies


def _annotation(kind: Any, key: str) -> tuple[Any, str]:
    """What reads a key's value (`units.Quantity`, `units.Whole` or None), and what the key is.

    Raises
    ------
    InputError
        If the case has no such key.
    """
    path = [part for part in key.split(".") if not part.isdecimal()]
    known = cases.keys(kind)
    if ".".join(path) not in known:
        last = [k for k in known if k.rpartition(".")[2] == path[-1]] if path else []
        guess = f"did you mean {last[0]!r}?" if last else nearest(key, known)
        raise InputError(f"over: unknown key {key!r}; {guess}")
    field: Any = None
    sections = [kind]
    for part in path:
        owner = next(s for s in sections if part in s.model_fields)
        field = owner.model_fields[part]
        sections = list(_sections(field.annotation))
    readers = [m for m in _metadata(field) if isinstance(m, (units.Quantity, units.OneOrMore, units.Whole))]
    reader = readers[0] if readers else None
    if isinstance(reader, units.OneOrMore):
        reader = reader.quantity
    what = getattr(reader, "what", "").removeprefix("a ").removeprefix("an ")
    return reader, field.description or what or key


def _sections(annotation: Any) -> Iterator[type[cases.Section]]:
    """Sections that an annotation holds."""
    if isinstance(annotation, type) and issubclass(annotation, cases.Section):
        yield annotation
    for argument in get_args(annotation):
        yield from _sections(argument)


def _metadata(annotated: Any) -> Iterator[Any]:
    """All that stands beside the types of a field."""
    yield from getattr(annotated, "metadata", ())
    yield from getattr(annotated, "__metadata__", ())
    for inner in (getattr(annotated, "annotation", None), *getattr(annotated, "__args__", ())):
        if inner is not None:
            yield from _metadata(inner)


def _axes(over: Mapping[str, Any], sample: str, kind: Any, samples: int, seed: int) -> tuple[Axis, ...]:
    """The keys that vary, with their values."""
    if not over:
        raise InputError("over is missing; it must name the keys that vary, such as blade.nodes: [10, 20]")
    found = []
    drawn = _draws(sample, samples, len(over), seed)
    for k, (key, given) in enumerate(over.items()):
        reader, what = _annotation(kind, str(key))
        where = f"over.{key}"
        if drawn is not None:
            values = _spread(where, given, reader, drawn[:, k])
        elif isinstance(given, dict) and sample == "grid":
            values = _points(where, given, reader)
        elif isinstance(given, list) and given:
            values = given
        else:
            allowed = "a list of values, or {from, to, points}" if sample == "grid" else "a list of values"
            raise InputError(f"{where} is {_shown(given)}; with sample: {sample} it must be {allowed}")
        unit = getattr(reader, "unit", "")
        found.append(Axis(key=str(key), values=tuple(values), unit=unit, what=what))
    lengths = {axis.key: len(axis.values) for axis in found}
    if sample == "list" and len(set(lengths.values())) > 1:
        told = ", ".join(f"{key} has {n}" for key, n in lengths.items())
        raise InputError(f"the lists of 'over' must be equally long with sample: list, but {told}")
    return tuple(found)


def _shown(value: Any) -> str:
    shown = "empty" if value is None else repr(value)
    return shown if len(shown) <= 80 else shown[:77] + "..."


def _draws(sample: str, n: int, keys: int, seed: int) -> np.ndarray | None:
    """Numbers in (0, 1), one for each case and key; None where values are given."""
    if sample in ("grid", "list"):
        return None
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    drawn = rng.random((n, keys))
    if sample == "latin-hypercube":
        order = np.stack([rng.permutation(n) for _ in range(keys)], axis=1)
        drawn = (order + drawn) / n
    return np.clip(drawn, 2.0**-53, 1.0 - 2.0**-53)


def _fields(where: str, given: Mapping[str, Any], *allowed: Sequence[str]) -> None:
    """Refuse keys other than those of one of the `allowed` forms."""
    known = {key for form in allowed for key in form}
    for key in given:
        if key not in known:
            raise InputError(f"unknown key '{where}.{key}'; {nearest(str(key), known)}")


def _number(where: str, given: Mapping[str, Any], key: str, reader: Any) -> float:
    """A number of a range, in the SI unit of the swept key."""
    if key not in given:
        raise InputError(f"{where}.{key} is missing; a range has a 'from' and a 'to'")
    value, unit = given[key], getattr(reader, "unit", "")
    problem = "it is not a finite number"
    try:
        if not isinstance(value, bool) and isinstance(value, (int, float, str)):
            number = units.parse(value, unit) if isinstance(value, str) else float(value)
            if math.isfinite(number):
                return number
    except units.UnitError as error:
        problem = str(error)
    wanted = f"a number in {unit}, or with a unit of that kind" if unit else "a plain number"
    raise InputError(f"{where}.{key} is {_shown(value)}; it must be {wanted}; {problem}")


def _points(where: str, given: Mapping[str, Any], reader: Any) -> list[Any]:
    """Equally spaced points."""
    _fields(where, given, ("from", "to", "points", "spacing"))
    _numeric(where, reader)
    first, last = (_number(where, given, key, reader) for key in ("from", "to"))
    if "points" not in given:
        raise InputError(f"{where}.points is missing; it must be the number of points, such as 11")
    points = _whole(given, "points", 0, least=1, most=MOST_CASES, where=f"{where}.")
    spacing = given.get("spacing", "linear")
    if spacing not in ("linear", "log"):
        raise InputError(f"{where}.spacing is {spacing!r}; it must be 'linear' or 'log'")
    if spacing == "linear":
        values = np.linspace(first, last, points)
    elif first > 0.0 and last > 0.0:
        values = np.geomspace(first, last, points)
    else:
        raise InputError(f"{where}.spacing is 'log', but the range from {first:g} to {last:g} is not above zero")
    return [int(v) if isinstance(reader, units.Whole) and v.is_integer() else float(v) for v in values]


def _spread(where: str, given: Any, reader: Any, drawn: np.ndarray) -> list[Any]:
    """Values of a distribution at the numbers `drawn` from (0, 1)."""
    _numeric(where, reader)
    if not isinstance(given, dict) or not ({"mean", "std"} & set(given) or {"from", "to"} & set(given)):
        raise InputError(f"{where} is {_shown(given)}; it must be {{from, to}} (uniform) or {{mean, std}} (normal)")
    if {"mean", "std"} & set(given):
        from scipy.special import ndtri

        _fields(where, given, ("mean", "std"))
        mean, std = (_number(where, given, key, reader) for key in ("mean", "std"))
        if std < 0.0:
            raise InputError(f"{where}.std is {std:g}; it must not be below zero")
        values = mean + std * ndtri(drawn)
    else:
        _fields(where, given, ("from", "to"))
        first, last = (_number(where, given, key, reader) for key in ("from", "to"))
        if isinstance(reader, units.Whole):
            return [int(v) for v in np.floor(first + (last + 1.0 - first) * drawn)]
        values = first + (last - first) * drawn
    return [round(v) for v in values] if isinstance(reader, units.Whole) else [float(v) for v in values]


def _numeric(where: str, reader: Any) -> None:
    if reader is None:
        raise InputError(f"{where} takes words or lists, so it has no range; give a list of values")


# ------------------------------------------------------------------------------------------------ checking


def _checked(study: Study, module: Any) -> Study:
    """The study with its axes' values as the schema reads them; every case is validated.

    A study none of whose corners can be planned is refused; one that is refused later is recorded as failed.
    """
    read_values: list[list[Any]] = [[None] * len(axis.values) for axis in study.axes]
    for index in range(study.count):
        overrides = study.overrides(index)
        try:
            case = cases.load(study.content, overrides)
        except InputError as error:
            shown = ", ".join(f"{axis.key}: {_shown(overrides[axis.key])}" for axis in study.axes)
            raise InputError(f"case {index} of the study ({shown}): {error}") from None
        places = np.unravel_index(index, study.shape) * (1 if study.sample == "grid" else len(study.axes))
        for values, axis, k in zip(read_values, study.axes, places, strict=True):
            if values[int(k)] is None:
                values[int(k)] = _at(case, axis.key)
    axes = tuple(dataclasses.replace(a, values=tuple(v)) for a, v in zip(study.axes, read_values, strict=True))
    for axis in axes:
        if study.sample == "grid" and len(set(map(repr, axis.values))) < len(axis.values):
            raise InputError(f"over.{axis.key} holds a value twice; the points of a grid must differ")
    found = dataclasses.replace(study, axes=axes)
    refused = None
    for index in corners(found):
        try:
            module.plan(cases.load(found.content, found.overrides(index)))
        except InputError as error:
            refused = refused or error
        else:
            return found
    raise refused if refused is not None else InputError("the study has no cases")


def corners(study: Study) -> list[int]:
    """Indices of cases at the ends of the varied keys, a few of them."""
    found: list[int] = []
    if study.sample == "grid":
        ends = [sorted({0, n - 1}) for n in study.shape]
        for places in np.ndindex(*(min(len(e), 2) for e in ends[:4])):
            place = [ends[k][p] for k, p in enumerate(places)] + [0] * (len(ends) - len(places))
            found.append(int(np.ravel_multi_index(place, study.shape)))
    else:
        found = [0, study.count - 1]
        for axis in study.axes:
            if all(isinstance(v, (int, float)) for v in axis.values):
                found += [int(np.argmin(axis.values)), int(np.argmax(axis.values))]
    return list(dict.fromkeys(found))[:_CORNERS]


def _at(case: Any, key: str) -> Any:
    """Value of a dotted key of a checked case, as JSON can hold it."""
    place = case
    for part in key.split("."):
        place = place[int(part)] if isinstance(place, tuple) else getattr(place, part)
    if isinstance(place, cases.Section):
        return place.model_dump(mode="json")
    return list(place) if isinstance(place, tuple) else place
