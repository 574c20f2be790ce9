"""Built-in studies: files ``*.study.yaml`` beside their system."""

from __future__ import annotations

import functools
import pathlib

from evolvent import cases
from evolvent_base import packages
from evolvent_base.errors import InputError, nearest

_SUFFIX = ".study.yaml"


@functools.cache
def files() -> dict[str, pathlib.Path]:
    """Files of the built-in studies by name: ``inertia_stand/map.study.yaml`` is ``inertia-stand-map``."""
    found = {
        f"{path.parent.name}-{path.name.removesuffix(_SUFFIX)}".replace("_", "-"): path
        for path in cases.files()
        if path.name.endswith(_SUFFIX)
    }
    return dict(sorted(found.items()))


def built_in() -> dict[str, str]:
    """Built-in studies, name -> what it is (the first line of its file)."""
    first = {name: path.read_text(encoding="utf-8").partition("\n")[0] for name, path in files().items()}
    return {name: line.lstrip("# ").strip() for name, line in first.items()}


def text(name: str) -> str:
    """A built-in study as the text that a user edits.

    Parameters
    ----------
    name : str, of the study

    Returns
    -------
    str, YAML

    Raises
    ------
    InputError
        If there is no such study.
    """
    if name not in files():
        missing = packages.lacking("study", name)
        raise InputError(missing or f"no study is called {name!r}; {nearest(name, files())}")
    return files()[name].read_text(encoding="utf-8")
