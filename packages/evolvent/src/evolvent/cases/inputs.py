"""Files that a case names: rows of tables in their place, and digests of all files, under which results are kept."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from evolvent.cases.catalogue import system, systems
from evolvent_base import file_keys
from evolvent_base.errors import InputError

#: Attribute of a run: files that it read and digests of what they held, in JSON.
FILES = "files"


def in_place(content: Mapping[str, Any]) -> dict[str, Any]:
    """Content of a case with rows in the place of the files of its tables."""
    kind = _kind(content)
    return dict(content) if kind is None else file_keys.in_place(kind, content)


def value_in_place(content: Mapping[str, Any], key: str, value: Any) -> Any:
    """Value that a dotted key of a case is set to, with rows in the place of files."""
    kind = _kind(content)
    return value if kind is None else file_keys.value_in_place(kind, key, value, content)


def files_of(content: Mapping[str, Any]) -> dict[str, str]:
    """Files that a case names -> SHA-256 of what they hold, '' of one that cannot be read.

    Results that are kept must be kept under these as well: a name says nothing of what a file holds.
    """
    kind = _kind(content)
    return {} if kind is None else {path: file_keys.digest(path) for path in file_keys.paths(kind, content)}


def files_of_case(case: Any) -> dict[str, str]:
    """The same of a checked case, or of parts by name, whose tables are in place."""
    sections = case.values() if isinstance(case, Mapping) else [case]
    return {path: file_keys.digest(path) for one in sections for path in file_keys.paths_of(one)}


def files_of_run(run: Any) -> dict[str, str]:
    """Files that a run read -> SHA-256 of what they held."""
    try:
        found = json.loads(str(run.attrs.get(FILES, "{}")))
    except (ValueError, RecursionError):
        return {}
    return {path: str(one) for path, one in found.items()} if isinstance(found, dict) else {}


def check_files_of_run(run: Any) -> None:
    """Refuse to run a run's case again where its files are no longer those that it read.

    Raises
    ------
    InputError
    """
    for path, before in files_of_run(run).items():
        if file_keys.digest(path) != before:
            raise InputError(f"the file {path!r} is not the one that the run read; run the case again")


def check_files(files: Mapping[str, str]) -> None:
    """Refuse results of files that are no longer those of which digests were taken.

    Raises
    ------
    InputError
    """
    for path, before in files.items():
        if file_keys.digest(path) != before:
            raise InputError(
                f"the file {path!r} was changed while runs read it; start again, so that all results are those of one "
                f"file"
            )


def _kind(content: Mapping[str, Any]) -> Any:
    name = content.get("system")
    return system(name).Case if isinstance(name, str) and name in systems() else None
