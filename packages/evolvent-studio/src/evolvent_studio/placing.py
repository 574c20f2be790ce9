"""Files that a case or study names, as paths that any process of the studio can open: all lie in the working folder."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Callable, Mapping
from typing import Any

from evolvent import cases
from evolvent.design.studies import measured
from evolvent_base import file_keys
from evolvent_base.errors import InputError
from evolvent_base.schema import Section

#: Endings of files with tables, and of all that hold signals.
TABLES = (".csv", ".tsv", ".txt")
SIGNALS = (*TABLES, ".tdms", ".uff", ".unv", ".mat", ".h5", ".hdf5", ".wav", ".nc")
_FILES = re.compile(rf"\.(ya?ml|{'|'.join(ending[1:] for ending in SIGNALS)})$", re.IGNORECASE)
#: A value of a case that can only be the path of a file: absolute, of a home or a parent folder, of a drive or network.
_PATH = re.compile(r"(/|~[\w.-]*/|\.\.?[/\\]|[A-Za-z]:[/\\]|\\\\).*|.*/\.\./.*", re.DOTALL)
#: Keys of a case that hold a text.
_TEXTS = ("title", "remarks")

Place = Callable[[str], pathlib.Path]


def source_file(source: str) -> str:
    """The file of a source "file:NAME" of a case or study, '' of another source."""
    kind, _, name = source.partition(":")
    return name if kind == "file" else ""


def placed(content: Any, place: Place) -> Any:
    """A case or study whose files are named by absolute paths.

    Keys that name files are those of the schema (`evolvent_base.file_keys`), also where a study sets or varies them.
    Other texts that can only be paths pass the same check.

    Parameters
    ----------
    place : function that finds a file of the working folder by its name, and refuses all others
    """
    if isinstance(content, Mapping):
        case = content.get("case", content)
        if isinstance(case, str) and case in cases.built_in():
            case = cases.content_of(case)
        if isinstance(case, Mapping):
            content = _by_schema(_kind_of(case), content, case, lambda name: str(place(name.strip())))
    return _checked(content, place)


def _kind_of(case: Mapping[Any, Any]) -> type[Section]:
    """The schema of a case; that of a structure where it names no system that is known."""
    try:
        return cases.system(str(case.get("system", "structure"))).Case
    except InputError:
        return cases.system("structure").Case


def _by_schema(
    kind: type[Section], content: Mapping[Any, Any], case: Mapping[Any, Any], change: Callable[[str], str]
) -> Mapping[Any, Any]:
    """A case, or a study with its case in it, whose keys that name files are changed."""
    if "case" not in content:
        found: Mapping[Any, Any] = file_keys.renamed(kind, case, change)
        return found

    def of_keys(given: Any) -> Any:
        """What a study says of keys of its case, as in ``set: {parts.hinge.torque: own.csv}``."""
        if isinstance(given, Mapping):
            return {
                key: file_keys.renamed(kind, of_keys(value), change, key, case) if isinstance(key, str) else value
                for key, value in given.items()
            }
        return [of_keys(one) for one in given] if isinstance(given, (list, tuple)) else given

    return {
        key: file_keys.renamed(kind, value, change) if key == "case" else of_keys(value)
        for key, value in content.items()
    }


def _checked(content: Any, place: Place) -> Any:
    """Content with saved runs and YAML files named by absolute paths; refuses paths outside the working folder."""
    if isinstance(content, Mapping):
        return {key: value if key in _TEXTS else _checked(value, place) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [_checked(value, place) for value in content]
    if isinstance(content, str):
        word = content.strip()
        drawn = measured.file_of(word)
        if drawn is not None:
            place(drawn[0])
        elif _FILES.search(word) or _PATH.fullmatch(word):
            path = place(word)
            is_read = word.endswith(".nc") or (word.endswith((".yaml", ".yml")) and path.is_file())
            return str(path) if is_read else content
    return content
