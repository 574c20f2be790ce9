"""A study that is being written: its case, the keys that vary, what is kept, and how many cases that makes."""

from __future__ import annotations

import dataclasses
import math
import os
import pathlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import yaml

from evolvent import cases
from evolvent.analysis.margins import kept_margins as kept, reels, shares
from evolvent.design import studies
from evolvent.design.studies import draws, measured
from evolvent.design.studies.study import corners
from evolvent.results import variables
from evolvent_base import schema
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import form, parts, reading
from evolvent_studio.folder import Folder
from evolvent_studio.placing import source_file

if TYPE_CHECKING:
    from evolvent.design.studies import Study

#: How the values of a key are given, by the study's key 'sample': name -> what it is.
WAYS = {
    "grid": {"values": "values", "range": "range"},
    "list": {"values": "values"},
    "latin-hypercube": {"uniform": "uniform", "normal": "normal", "text": "distribution"},
    "monte-carlo": {"uniform": "uniform", "normal": "normal", "text": "distribution"},
    **{sample: {"text": "distribution"} for sample in ("sobol", "saltelli", "corners")},
}
#: What the ways of sampling are called, and what they do.
SAMPLES = {
    "grid": "grid: all combinations",
    "list": "list: first values, second values, ...",
    "latin-hypercube": "Latin hypercube: spread random samples",
    "monte-carlo": "Monte Carlo: independent random samples",
}
#: The same of a dispersion.
DISPERSED = {
    "monte-carlo": "Monte Carlo: gives bounds",
    "latin-hypercube": "Latin hypercube: fewer samples",
    "sobol": "Sobol sequence",
    "saltelli": "Saltelli: indices of Sobol",
    "corners": "corners: ends of all ranges",
}
#: Ways of sampling that take a number of samples.
_COUNTED = ("latin-hypercube", "monte-carlo", "sobol", "saltelli")
#: Distribution of a key that is chosen.
FIRST_TEXT = "normal(nominal, 5%)"
#: Keys of a way's mapping.
FIELDS = {"range": ("from", "to", "points"), "uniform": ("from", "to"), "normal": ("mean", "std")}
#: A study and a dispersion to begin with, by the kind of job that runs them.
NEW_ONES = {"sweep": "study", "disperse": "dispersion"}
NEW = {
    "study": """\
study: boom-length
case: boom-slew
sample: grid
over:
  parts.boom.length: {from: 2 m, to: 4 m, points: 5}
keep: [hub.rate.z.last, boom.tip_deflection.y.min, boom.tip_deflection.y.max]
""",
    "dispersion": """\
study: boom-slew
case: boom-slew
sample: monte-carlo
samples: 59
over:
  parts.boom.length: normal(nominal, 1%)
keep: [hub.rate.z.last, boom.tip_deflection.y.max]
""",
}
#: The entry of the list of cases that stands for a case whose keys are in the study itself.
OWN_CASE = "own"
#: The one that stands for the case that is open.
OPEN_CASE = "open"


@dataclasses.dataclass
class StudyDraft:
    """The study in the form.

    Attributes
    ----------
    source : str, "new:study", "new:dispersion", "case:NAME" of a built-in study, "file:NAME", or '' of one opened from
        its results
    about : str
    content : dict, the study as a file holds it; its case file is named from the working folder on
    follows : bool, whether its case is the one that is open, saved or not
    """

    source: str
    about: str
    content: dict[str, Any]
    follows: bool = False


def opened(folder: Folder, source: str) -> StudyDraft:
    """A study for the form.

    Raises
    ------
    InputError
        If it cannot be read, or is no study.
    """
    kind, _, name = source.partition(":")
    if kind == "new":
        return StudyDraft(source, f"new {name}", dict(cases.parse_yaml(NEW[name], name)), follows=True)
    if kind == "case":
        return StudyDraft(source, studies.built_in()[name], dict(cases.parse_yaml(studies.text(name), name)))
    content = folder.content(name)
    folder.study(name)  # refuses files outside
    found = of_content(content, name)
    case = found.content.get("case")
    if isinstance(case, str) and _is_file(case):
        found.content["case"] = folder.name(folder.inside(str(pathlib.PurePosixPath(name).parent / case)))
    parent = pathlib.PurePosixPath(name).parent
    found.content["over"] = measured.renamed(found.content.get("over"), lambda file: os.fspath(parent / file))
    found.source = source
    return found


def of_content(content: Any, about: str) -> StudyDraft:
    """A study for the form from its content.

    Raises
    ------
    InputError
        If it is no study.
    """
    if not isinstance(content, Mapping) or "case" not in content:
        raise InputError(f"{about}: it holds no study; a study is a mapping with the keys 'case' and 'over'")
    return StudyDraft("", about, dict(content))


def _is_file(case: str) -> bool:
    return case not in cases.built_in() and case.endswith((".yaml", ".yml"))


def case_of(folder: Folder, draft: StudyDraft) -> dict[str, Any]:
    """The case of the study, with what the study sets.

    Raises
    ------
    InputError
        If there is none.
    """
    case, changes = draft.content.get("case"), draft.content.get("set") or {}
    if isinstance(case, str) and _is_file(case):
        case = folder.content(case)
    elif isinstance(case, str):
        case = cases.parse_yaml(cases.text(case), case)
    if not isinstance(case, Mapping):
        raise InputError("the study's case is no mapping of keys to values")
    return cases.content_of(case, changes if isinstance(changes, Mapping) else {})


def study_with_case(folder: Folder, draft: StudyDraft) -> dict[str, Any]:
    """The study with its case in it, as it is run.

    Raises
    ------
    InputError
        If its case cannot be read, or lies outside the working folder.
    """
    content, case = dict(draft.content), draft.content.get("case")
    if isinstance(case, str) and _is_file(case):
        content["case"] = folder.placed(folder.content(case), case)
    placed: dict[str, Any] = folder.placed(content, source_file(draft.source))
    return placed


def text(draft: StudyDraft, parent: pathlib.PurePosixPath | None = None) -> str:
    """The study as a file in the folder `parent` of the working folder holds it.

    Raises
    ------
    InputError
        If its case file does not lie in that folder or below.
    """
    content, case = dict(draft.content), draft.content.get("case")
    if isinstance(case, str) and _is_file(case) and parent is not None:
        try:
            content["case"] = os.fspath(pathlib.PurePosixPath(case).relative_to(parent))
        except ValueError:
            raise InputError(
                f"a study in {os.fspath(parent)!r} cannot name the case {case!r}; save it in the folder of its case"
            ) from None
    if parent is not None:

        def below(file: str) -> str:
            try:
                return os.fspath(pathlib.PurePosixPath(file).relative_to(parent))
            except ValueError:
                raise InputError(
                    f"a study in {os.fspath(parent)!r} cannot name the file {file!r}; save it in the folder of the file"
                ) from None

        content["over"] = measured.renamed(content.get("over"), below)
    return str(yaml.dump(content, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100))


class _Dumper(yaml.SafeDumper):
    """Mappings in block style, lists and the values of a key in one line."""


def _mapping(dumper: yaml.SafeDumper, value: Mapping[str, Any]) -> yaml.Node:
    short = len(value) < 5 and not any(isinstance(one, (dict, list)) for one in value.values())
    inner = short and {"from", "mean"} & set(value)
    return dumper.represent_mapping("tag:yaml.org,2002:map", value, flow_style=bool(inner))


def _sequence(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.Node:
    plain = not any(isinstance(one, (dict, list)) for one in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=plain)


_Dumper.add_representer(dict, _mapping)
_Dumper.add_representer(list, _sequence)


def read(folder: Folder, draft: StudyDraft) -> Study:
    """The checked study, with its case in it.

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    return studies.read(study_with_case(folder, draft), folder=folder.root)


# ------------------------------------------------------------------------------------------------ another case


def with_case(folder: Folder, draft: StudyDraft, case: Any) -> dict[str, Any]:
    """The content of a study of another case, without what only the one before has.

    Parameters
    ----------
    case : str or mapping, what the key `case` is from now on

    Raises
    ------
    InputError
        If the case cannot be read.
    """
    given = {**draft.content, "case": case}
    after = case_of(folder, StudyDraft("", "", {"case": case}))
    try:
        before = case_of(folder, StudyDraft("", "", {"case": draft.content.get("case")}))
    except (EvolventError, OSError):
        before = {}
    same = before.get("system") == after.get("system")
    stages = [str(one.get("name")) for one in _listed(given, "stages") if isinstance(one, Mapping)] if same else []

    def is_known(key: str) -> bool:
        stage, _, path = key.partition(".")
        return has_key(after, path if stage in stages else key)

    def known(section: Any) -> dict[str, Any]:
        found = section if isinstance(section, Mapping) else {}
        return {k: v for k, v in found.items() if k and all(is_known(one.strip()) for one in str(k).split(","))}

    over = known(given.get("over"))
    names = {key.strip() for keys_ in over for key in str(keys_).split(",")}
    pairs = [one for one in _listed(given, "correlation") if isinstance(one, list) and set(map(str, one[:2])) <= names]
    gone = {name for name, kind in _parts(before).items() if _parts(after).get(name) != kind}
    keep = [one for one in map(str, _listed(given, "keep")) if same and not any(one.startswith(f"{p}.") for p in gone)]
    changed = {"over": over or {"": []}, "set": known(given.get("set")), "keep": keep, "correlation": pairs}
    if not same:
        changed["stages"] = []
    found = {key: changed.get(key, value) for key, value in given.items()}
    return {key: value for key, value in found.items() if value or key not in changed}


def _listed(content: Mapping[str, Any], key: str) -> list[Any]:
    found = content.get(key)
    return found if isinstance(found, list) else []


def _parts(case: Mapping[str, Any]) -> dict[str, str]:
    """Names of the parts of a case and their kinds; none of a case without parts."""
    try:
        own = parts.key_of(cases.system(str(case.get("system", ""))).Case)
    except EvolventError:
        return {}
    inner = case.get(own) if own else None
    kinds = inner.items() if isinstance(inner, Mapping) else ()
    return {str(name): str(one.get("kind") if isinstance(one, Mapping) else "") for name, one in kinds}


# ------------------------------------------------------------------------------------------------ keys


def keys(case: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Keys of a case that may vary: dotted key -> unit of a plain number and help."""
    try:
        kind = cases.system(str(case.get("system", ""))).Case
    except EvolventError:
        return {}
    own = parts.key_of(kind)
    found = {
        field.key: (field.unit, field.help)
        for field in form.describe(kind, skip=("system", "title", own) if own else ("system", "title")).fields()
    }
    inner = case.get(own) if own else None
    for name, content in (inner if isinstance(inner, Mapping) else {}).items():
        part = parts.kind_of(content)
        if part is None:
            continue
        for field in form.describe(part, skip=("kind",), flat=True).fields():
            found[f"{own}.{name}.{field.key}"] = (field.unit, field.help)
    return found


def has_key(case: Mapping[str, Any], key: str) -> bool:
    """Whether a case has a dotted key, written or not."""
    try:
        schema.locate(cases.system(str(case.get("system", ""))).Case, key, case)
    except EvolventError:
        return False
    return True


def value_at(case: Any, key: str) -> Any:
    """The value of a dotted key of a case as it is written; None where it is left out."""
    for name in key.split("."):
        if isinstance(case, Mapping):
            case = case.get(name)
        elif isinstance(case, (list, tuple)) and name.isdecimal() and int(name) < len(case):
            case = case[int(name)]
        else:
            return None
    return case


# ------------------------------------------------------------------------------------------------ values of a key


def way_of(given: Any, sample: str) -> str:
    """How the values of a key are given."""
    ways = WAYS.get(sample, WAYS["grid"])
    if isinstance(given, str) and "text" in ways:
        return "text"
    if isinstance(given, Mapping):
        way = "normal" if {"mean", "std"} & set(given) else "range" if "range" in ways else "uniform"
        if way in ways:
            return way
    return next(iter(ways))


def changed_way(given: Any, way: str) -> Any:
    """Values of a key given in another way, from what can be taken over."""
    if way == "values":
        ends = [given[end] for end in ("from", "to", "mean") if end in given] if isinstance(given, Mapping) else given
        return ends if isinstance(ends, list) else []
    if way == "text":
        if isinstance(given, Mapping) and given:
            kind, names = ("normal", ("mean", "std")) if "mean" in given else ("uniform", ("from", "to"))
            return f"{kind}({', '.join(form.text_of(given.get(name, '')) for name in names)})"
        return given if isinstance(given, str) else FIRST_TEXT
    listed = given if isinstance(given, list) and given else []
    ends = dict(given) if isinstance(given, Mapping) else {}
    first = ends.get("from", ends.get("mean", listed[0] if listed else ""))
    last = ends.get("to", ends.get("mean", listed[-1] if listed else ""))
    if way == "normal":
        return {"mean": ends.get("mean", first), "std": ends.get("std", "")}
    if way == "range":
        kept = {"points": ends.get("points", 5)} | ({"spacing": ends["spacing"]} if "spacing" in ends else {})
        return {"from": first, "to": last, **kept}
    return {"from": first, "to": last}


def with_sample(content: Mapping[str, Any], sample: str) -> dict[str, Any]:
    """A study with another way of sampling; its values are taken over as far as they can be."""
    over = content.get("over") or {}
    changed = {key: given if _fits(given, sample) else changed_way(given, way_of(given, sample))
               for key, given in over.items()}  # fmt: skip
    found = {**content, "sample": sample, "over": changed}
    if sample not in _COUNTED:
        found.pop("samples", None)
    else:
        found.setdefault("samples", 100)
        if sample in ("sobol", "saltelli") and isinstance(found["samples"], int) and found["samples"] > 0:
            found["samples"] = 1 << (found["samples"] - 1).bit_length()  # a power of 2
    return found


def _fits(given: Any, sample: str) -> bool:
    """Whether values are given in a way that a sample takes."""
    if isinstance(given, (list, str)):
        return ("values" if isinstance(given, list) else "text") in WAYS[sample]
    way = "normal" if {"mean", "std"} & set(given) else "range" if "points" in given else "uniform"
    return way in WAYS[sample]


def written_values(values: Any) -> str:
    """A list of values as it is typed, without brackets."""
    return form.text_of(values if isinstance(values, list) else [values])[1:-1] if values not in (None, []) else ""


def count(content: Mapping[str, Any]) -> int | None:
    """Number of cases, as far as the content says; None where it does not."""
    over, sample = content.get("over"), content.get("sample", "grid")
    if not isinstance(over, Mapping) or not over:
        return None
    if sample in draws.DRAWN:
        samples = content.get("samples", 0)
        known = isinstance(samples, int) and not isinstance(samples, bool) and (samples > 0 or sample == "corners")
        many = sample == "corners" and len(over) > draws.MOST_CORNERS
        return draws.count(str(sample), samples, len(over)) if known and not many else None
    sizes = [len(g) if isinstance(g, list) else g.get("points") if isinstance(g, Mapping) else None
             for g in over.values()]  # fmt: skip
    known = [size for size in sizes if isinstance(size, int) and not isinstance(size, bool)]
    if len(known) < len(sizes):
        return None
    return math.prod(known) if sample == "grid" else known[0]


# ------------------------------------------------------------------------------------------------ results


def responses(folder: Folder, draft: StudyDraft) -> list[str]:
    """Names of results that a study may keep; the study is checked as it is before it runs.

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    study = read(folder, draft)
    module, run = cases.system(study.system), None
    found: list[str] = []
    if reading.elements(study.content) > reading.MOST_ELEMENTS:
        return found  # its names take as long as its start
    for index in corners(study):
        try:
            case = cases.load(study.content, study.overrides(index))
            plan = module.plan(case)
        except InputError:
            continue
        run = plan.start() if plan.start is not None else None
        if study.content.get("margin") and not study.stages:
            assembly = module.system(case).assemble()
            for name in shares.coordinate_names(assembly):
                found += [f"{name}.{kept.AT_REST}", f"{name}.{kept.IN_RUN}"]
            found += [f"{name}.{kept.IN_RUN}" for name in reels.names_of(assembly)]
        break
    if run is None:
        return found
    for name in variables.names(run, over_time=False):
        values = variables.get(run, name)
        inner = [f"{name}.{axis}" for axis in values["axis"].values] if "axis" in values.coords else [name]
        ends = ("last", "min", "max", "mean") if "time" in values.dims else ("",)
        found += [f"{one}.{end}" if end else one for one in inner for end in ends]
    names = [stage.name for stage in study.stages]
    return [f"{stage}.{name}" for stage in names for name in found] if names else found


def over_time(case: Any) -> list[str]:
    """Names of the variables over time of a case, each component of a vector by its axis.

    Raises
    ------
    InputError
        If the case cannot be planned.
    """
    loaded = cases.load(case)
    plan = cases.system(loaded.system).plan(loaded)
    if plan.start is None or reading.elements(case) > reading.MOST_ELEMENTS:
        return []
    run, found = plan.start(), []
    for name in variables.names(run):
        values = variables.get(run, name)
        found += [f"{name}.{axis}" for axis in values["axis"].values] if "axis" in values.coords else [name]
    return found


def block(value: Any) -> str:
    """A mapping or list of a study as it is typed."""
    return str(yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)).strip()
