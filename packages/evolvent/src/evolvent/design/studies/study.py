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
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.analysis.margins.kept_margins import others_of
from evolvent.analysis.system import System
from evolvent.design.evaluator.runs import files_of
from evolvent.design.studies import catalogue, draws, measured, stages as st
from evolvent.design.studies.axes import MOST_CASES, Axis, annotation, axes, value_at, whole_number
from evolvent.results.kept import ENDINGS, check_names, is_reduction, stored_name
from evolvent_base import packages, progress, safe_open, schema
from evolvent_base.errors import InputError, nearest

SAMPLES = ("grid", "list", *draws.DRAWN)
_KEYS = ("study", "case", "set", "stages", "sample", "over", "samples", "correlation", "seed", "keep", "batch")
#: Most cases that are planned before anything runs.
_CORNERS = 16
#: Cases of a grid that are all checked before it begins, and samples, whose others differ by drawn numbers alone.
_ALL, _DRAWN = 10_000, 100


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
    seed_key : str, key of the case that takes its own seed in every case; '' for none
    seed_most : int, largest seed that it takes
    keep : tuple of str, what is kept of every run; empty for the default
    batch : int, cases a task; 0 for automatic
    stages : tuple of Stage, runs of every case that follow one another; empty for one run
    start_key : str, key of the case that takes the run of the stage before
    files : dict, files that the cases read -> SHA-256 of their content
    tables : dict, the same of files in whose place the rows stand
    text : str, the study as YAML that holds its whole case and can be swept again
    limits : tuple of mapping, limits of the case whose values are kept, as the results hold them
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
    stages: tuple[st.Stage, ...] = ()
    start_key: str = ""
    files: Mapping[str, str] = dataclasses.field(default_factory=dict)
    tables: Mapping[str, str] = dataclasses.field(default_factory=dict)
    limits: tuple[Mapping[str, Any], ...] = ()

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

    def overrides(self, index: int, stage: str | None = None) -> dict[str, Any]:
        """What a case changes, with what all change.

        Parameters
        ----------
        index : int, of the case, from 0
        stage : str, name of a stage, the first if left out

        Returns
        -------
        dict, key -> value
        """
        places = np.unravel_index(index, self.shape)
        if self.sample != "grid":
            places = places * len(self.axes)
        own = next((one for one in self.stages if stage in (None, one.name)), st.Stage(name="", set={}))
        found = {**self.fixed, **own.set}
        for axis, k in zip(self.axes, places, strict=True):
            if axis.stage in ("", own.name):
                found[axis.path] = axis.written(int(k))
        if self.seed_key:
            found[self.seed_key] = self.case_seed(index)
        return found

    def case_seed(self, index: int) -> int:
        """The seed of a case: the same however the cases are spread over workers.

        Parameters
        ----------
        index : int, of the case, from 0

        Returns
        -------
        int
        """
        state = np.random.SeedSequence(self.seed, spawn_key=(index,)).generate_state(1, np.uint64)
        return int(state[0]) % (self.seed_most + 1)

    @functools.cached_property
    def digests(self) -> dict[str, str]:
        """Hash of the cases, and of what is kept; what a store is compared by."""
        asked: list[Any] = [self.content, self.fixed, self.sample, [(a.key, a.values) for a in self.axes]]
        asked += [[stage.name, dict(stage.set)] for stage in self.stages]
        return {
            "cases": _digest([*asked, self.seed_key, self.seed if self.seed_key else 0]),
            "kept variables": _digest(list(self.keep)),
            **{f"file {name!r}": digest for name, digest in {**self.tables, **self.files}.items()},
        }


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


# ------------------------------------------------------------------------------------------------ reading


def read(
    study: str | os.PathLike[str] | Mapping[str, Any], changes: Mapping[str, Any] | None = None, *,
    folder: str | os.PathLike[str] | None = None,
) -> Study:  # fmt: skip
    """A checked study.

    Parameters
    ----------
    study : str, path or mapping
        Name of a built-in study, a YAML file, or content. The case in a mapping may be a `System`.
    changes : mapping, optional
        Keys of the study that replace its own; those of ``set`` and ``over`` are added. Files of their distributions
        are named from the current folder on.
    folder : str, optional
        Folder that files which the study names must be in, or below; that of the study, of a mapping the current one.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed. Every case has been checked against its schema;
        of a grid of more than 10 000 cases every value, of more than 100 samples the smallest and largest value of
        every key, while others of its cases are checked when they are run.
    """
    content, own_folder = _content(study)
    folder = own_folder if folder is None else pathlib.Path(folder)
    changes = changes or {}
    tables = measured.Tables(folder, trusted=list(_section(changes, "over").values()))
    for key, value in changes.items():
        content[key] = {**_section(content, key), **value} if key in ("set", "over") else value
    for key in content:
        if key not in _KEYS:
            raise InputError(f"unknown key {key!r} in the study; {nearest(str(key), _KEYS)}")
    name = content.get("study", "study")
    if not isinstance(name, str) or not re.fullmatch(r"\w[\w.-]*", name):
        raise InputError(f"study is {schema.shown(name)}; it must be a name of letters, digits, '-' and '_'")
    sample = content.get("sample", "grid")
    if sample not in SAMPLES:
        raise InputError(f"sample is {schema.shown(sample)}; {nearest(str(sample), SAMPLES)}")
    random = sample in draws.DRAWN and sample != "corners"
    seed = whole_number(content, "seed", 0, least=0, most=2**63 - 1)
    if random and "samples" not in content:
        raise InputError(f"samples is missing; sample: {sample} needs the number of cases, such as 100")
    if not random and "samples" in content:
        takes = "the ends of all ranges" if sample == "corners" else "the values listed in 'over'"
        raise InputError(f"samples is given, but sample: {sample} takes {takes}")
    if "correlation" in content and sample not in draws.DRAWN:
        raise InputError(f"correlation is given, but sample: {sample} draws nothing; leave it out")
    samples = whole_number(content, "samples", 0, least=1, most=MOST_CASES)
    as_written = _case(content, folder)
    case = cases.in_place(as_written)
    fixed = {key: cases.value_in_place(case, key, one) for key, one in _section(content, "set").items()}
    if fixed:
        content["set"] = fixed
    system = case.get("system")
    if not isinstance(system, str):
        raise InputError(f"the case's key 'system' is {schema.shown(system)}; {nearest(str(system), cases.systems())}")
    module = cases.system(system)
    stages = tuple(
        dataclasses.replace(one, set={key: cases.value_in_place(case, key, value) for key, value in one.set.items()})
        for one in st.read(content)
    )
    names = [stage.name for stage in stages]
    start_key = st.start_key(stages, module, system, fixed)
    own = functools.cache(lambda: cases.load(case, fixed))
    varying = axes(
        _section(content, "over"),
        sample,
        module.Case,
        samples=samples,
        seed=seed,
        stages=names,
        content=cases.content_of(case, fixed),
        correlation=content.get("correlation"),
        nominal=lambda path: value_at(own(), path),
        tables=tables,
    )
    if sample in draws.DRAWN:
        content["over"] = tables.in_place(_section(content, "over"))
    varied = {axis.path for axis in varying}
    for axis in varying:
        if start_key and axis.path == start_key:
            raise InputError(
                f"over varies {axis.key!r}, but a stage starts from the end of the one before; leave it out"
            )
        for stage in stages:
            if axis.stage in ("", stage.name) and axis.path in stage.set:
                raise InputError(
                    f"over varies {axis.key!r}, which the stage {stage.name!r} sets; leave one of them out"
                )
    seed_key, seed_most = _seed_key(module, varied | set(fixed))
    keep = _kept_variables(content)
    st.check_keep(keep, stages)
    batch = whole_number(content, "batch", 0, least=1, most=MOST_CASES)
    found = Study(
        name=name,
        content=case,
        fixed=fixed,
        system=system,
        sample=sample,
        axes=varying,
        seed=seed,
        seed_key=seed_key,
        seed_most=seed_most,
        keep=keep,
        batch=batch,
        text=_text(content, case),
        stages=stages,
        start_key=start_key,
    )
    if found.count > MOST_CASES:
        raise InputError(f"the study has {found.count:.3g} cases; at most {MOST_CASES} are possible")
    found = _checked(found, module)
    return dataclasses.replace(
        found,
        files=_files_of(found),
        tables=cases.files_of(as_written),
    )


def _files_of(study: Study) -> dict[str, str]:
    """Files that any of the cases reads -> SHA-256 of what they hold."""
    changes: list[Mapping[str, Any]] = [stage.set for stage in study.stages]
    for axis in study.axes:
        words = {repr(one): one for one in axis.values if not isinstance(one, int | float | None)}
        changes += [{axis.path: one} for one in words.values()]
    return files_of(study.content, [{**study.fixed, **one} for one in ({}, *changes)])


def is_study(name: str) -> bool:
    """Whether a name is that of a built-in study, or of a file that holds one rather than a case."""
    if name in catalogue.files():
        return True
    if name in cases.built_in() or not os.path.isfile(name):
        return False
    content = cases.parse_yaml(safe_open.text(name), name)
    return isinstance(content, dict) and "case" in content and "system" not in content


def _content(study: Any) -> tuple[dict[str, Any], pathlib.Path]:
    """Content of a study, and the folder that its case file may stand in."""
    if isinstance(study, Mapping):
        given = study.get("case")
        own = {"case": cases.parse_yaml(given.to_yaml(), "the system")} if isinstance(given, System) else {}
        return _plain({**study, **own}), pathlib.Path()
    if not isinstance(study, (str, os.PathLike)):
        raise InputError(f"a study is a name, a file or a mapping, not {type(study).__name__}")
    name = os.fspath(study)
    if name in catalogue.files():
        path, source = catalogue.files()[name], catalogue.text(name)
    else:
        if not os.path.exists(name) and not re.search(r"[./\\]", name):
            missing = packages.lacking("study", name)
            raise InputError(missing or f"no study is called {schema.shown(name)}; {nearest(name, catalogue.files())}")
        path = pathlib.Path(name)
        source = safe_open.text(path)
    content = cases.parse_yaml(source, name)
    if not isinstance(content, dict):
        raise InputError(f"{name}: a study is a mapping of keys to values, this is not")
    return content, path.parent


def _plain(content: Any) -> Any:
    """Content with dicts, lists and Python's own numbers only, as YAML would give it."""
    if isinstance(content, Mapping):
        return {key: _plain(value) for key, value in content.items()}
    if isinstance(content, (list, tuple, np.ndarray)):
        return [_plain(value) for value in content]
    if isinstance(content, np.generic):
        return content.item()
    if content is None or isinstance(content, (bool, int, float, str)):
        return content
    raise InputError(f"the study holds {schema.shown(content)}; it may hold words, numbers, lists and mappings")


def _case(content: Mapping[str, Any], folder: pathlib.Path) -> dict[str, Any]:
    """Content of the study's case."""
    if "case" not in content:
        raise InputError(f"the study's key 'case' is missing; {nearest('', cases.built_in())}, or a file, or keys")
    case = content["case"]
    if isinstance(case, dict):
        return cases.with_system(dict(case))
    if not isinstance(case, str):
        raise InputError(
            f"case is {schema.shown(case)}; it must be the name of a built-in case, a file, or a case's keys"
        )
    if case in cases.built_in() or not re.search(r"[./\\]", case):
        found = cases.parse_yaml(cases.text(case), case)
    else:
        path = (folder / case).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise InputError(f"case is {schema.shown(case)}; a case file must be in the folder of its study, or below")
        found = cases.parse_yaml(safe_open.text(path), case)
    if not isinstance(found, dict):
        raise InputError(f"{case}: a case is a mapping of keys to values, this is not")
    return cases.with_system(found)


def _section(content: Mapping[str, Any], key: str) -> dict[str, Any]:
    section = content.get(key) or {}
    if not isinstance(section, dict):
        raise InputError(
            f"{key} is {schema.shown(section)}; it must be a mapping of keys of the case (blade.nodes) to values"
        )
    return section


def _kept_variables(content: Mapping[str, Any]) -> tuple[str, ...]:
    keep = content.get("keep") or []
    if not isinstance(keep, list) or not all(isinstance(name, str) for name in keep):
        raise InputError(f"keep is {schema.shown(keep)}; it must be a list of variables, such as [body_rate.last]")
    stored: dict[str, str] = {}
    for name in keep:
        other = stored.setdefault(stored_name(name), name)
        if other != name:
            raise InputError(
                f"keep holds {other!r} and {name!r}, which would both be in the results as {stored_name(name)!r}"
            )
    return tuple(stored.values())


def _check_reductions(keep: Sequence[str], stages: Sequence[str]) -> None:
    """Refuse what follows the dot of a name, of a system whose variables have none."""
    for name in keep:
        first, dot, reduction = name.partition(".")
        if first in stages:
            _, dot, reduction = reduction.partition(".")
        if dot and not is_reduction(reduction):
            raise InputError(f"keep holds {schema.shown(name)}; after the dot, {nearest(reduction, ENDINGS)}")


def _seed_key(module: Any, given: set[str]) -> tuple[str, int]:
    """Key that takes a seed in every case, and the largest one; ('', 0) if there is none or the study gives it."""
    key = module.seed_key
    if not key or key in given:
        return "", 0
    most = getattr(annotation(module.Case, key)[0], "most", None)
    return key, min(int(most), 2**53) if most is not None else 2**53


def _text(content: Mapping[str, Any], case: Mapping[str, Any]) -> str:
    everything = {key: content[key] for key in _KEYS if key in content} | {"case": case}
    ordered = {key: everything[key] for key in _KEYS if key in everything}
    return cases.dump(ordered)


# ------------------------------------------------------------------------------------------------ checking


def _checked(study: Study, module: Any) -> Study:
    """The study with its axes' values as the schema reads them; every case is validated, of a large grid every value.

    A study none of whose corners can be planned is refused, as is one that keeps variables which its runs will not
    have; a case that is refused later is recorded as failed.
    """
    read_values: list[list[Any]] = [[None] * len(axis.values) for axis in study.axes]
    for index in progress.track(_checked_cases(study), "checking the cases"):
        places = np.unravel_index(index, study.shape) * (1 if study.sample == "grid" else len(study.axes))
        for name, case in _loaded(study, index, module):
            for values, axis, k in zip(read_values, study.axes, places, strict=True):
                if values[int(k)] is None and axis.stage in ("", name):
                    values[int(k)] = value_at(case, axis.path)
    axes = tuple(
        dataclasses.replace(a, values=tuple(given if v is None else v for v, given in zip(own, a.values, strict=True)))
        for a, own in zip(study.axes, read_values, strict=True)
    )
    for axis in axes:
        if study.sample == "grid" and len(set(map(repr, axis.values))) < len(axis.values):
            raise InputError(f"over.{axis.key} holds a value twice; the points of a grid must differ")
    found = dataclasses.replace(study, axes=axes)
    plan = first_plan(found, keep=() if found.stages else found.keep)
    if plan.start is None:
        _check_reductions(found.keep, [stage.name for stage in found.stages])
    elif found.stages:
        st.check_names(found.keep, found.stages, plan.start())
    else:
        check_names(others_of(found.keep), plan.start())
    return found


def first_plan(study: Study, keep: Sequence[str] = ()) -> cases.CasePlan:
    """The plan of the first case at the ends of the varied keys that has one.

    Raises
    ------
    InputError
        If none has one.
    """
    refused = None
    for index in corners(study):
        try:
            case = cases.load(study.content, study.overrides(index))
            return cases.system(case.system).plan(case, keep=keep)
        except InputError as error:
            refused = refused or error
    raise refused if refused is not None else InputError("the study has no cases")


def _checked_cases(study: Study) -> Sequence[int]:
    """Indices of the cases that are checked before any is run: all, or of many those along the edges.

    Of a large grid these hold every value of every key, of drawn values the smallest and the largest of every key.
    """
    if study.sample in draws.DRAWN:
        return sorted(corners(study, most=study.count)) if study.count > _DRAWN else range(study.count)
    if study.sample != "grid" or study.count <= _ALL:
        return range(study.count)
    edges = [study.count - 1]
    for k, size in enumerate(study.shape):
        step = math.prod(study.shape[k + 1 :])
        edges += range(0, size * step, step)
    return sorted(set(edges))


def _loaded(study: Study, index: int, module: Any) -> Iterator[tuple[str, Any]]:
    """Name of every stage of a case and the checked case there; '' without stages."""
    before = None
    for stage in study.stages or (None,):
        overrides = study.overrides(index, stage.name if stage else None)
        if before is not None:
            overrides[study.start_key] = st.UNKNOWN
        try:
            case = cases.load(study.content, overrides)
            if before is not None:
                module.check_follows(before, case)
        except InputError as error:
            places = np.unravel_index(index, study.shape) * (1 if study.sample == "grid" else len(study.axes))
            varied = zip(study.axes, places, strict=True)
            where = ", ".join(f"{axis.key}: {schema.shown(axis.values[int(k)])}" for axis, k in varied)
            at = f", stage {stage.name!r}" if stage else ""
            message = str(error).replace(f"the run {st.UNKNOWN!r}", "the stage before it")
            raise InputError(f"case {index} of the study ({where}){at}: {message}") from None
        yield (stage.name if stage else ""), case
        before = case


def corners(study: Study, most: int = _CORNERS) -> list[int]:
    """Indices of cases at the ends of the varied keys, at most so many of them."""
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
    return list(dict.fromkeys(found))[:most]
