"""What packages/*/pyproject.toml state, together: what the root project is made of."""

from __future__ import annotations

import pathlib
import re
import tomllib
from typing import Any

ROOT = pathlib.Path(__file__).resolve().parents[1]
#: The package whose dependencies are large and that most users do without: an extra of the root project.
OPTIONAL = "evolvent-studio"


def projects() -> dict[str, dict[str, Any]]:
    """The section `project` of each package, by its name."""
    found = {}
    for path in sorted((ROOT / "packages").glob("*/pyproject.toml")):
        project = tomllib.loads(path.read_text(encoding="utf-8"))["project"]
        found[project["name"]] = project
    return found


def is_own(requirement: str) -> bool:
    """Whether a requirement is one of these packages."""
    return re.split(r"[\[<>=~!; ]", requirement)[0] in projects()


def merged(own: dict[str, list[str]]) -> dict[str, Any]:
    """Dependencies, extras, scripts and entry points of all packages.

    Parameters
    ----------
    own : extras of the root project itself
    """
    dependencies: dict[str, None] = {}
    extras: dict[str, list[str]] = {name: list(several) for name, several in own.items()}
    scripts: dict[str, str] = {}
    points: dict[str, dict[str, str]] = {}
    for name, project in projects().items():
        needed = [one for one in project["dependencies"] if not is_own(one)]
        if name == OPTIONAL:
            extras[name.rpartition("-")[2]] = ["evolvent[sweep]", *needed]
        else:
            dependencies |= dict.fromkeys(needed)
        for extra, several in project.get("optional-dependencies", {}).items():
            kept = [one for one in several if not is_own(one)]
            if kept:
                extras.setdefault(extra, []).extend(kept)
        scripts |= project.get("scripts", {})
        for group, entries in project.get("entry-points", {}).items():
            points.setdefault(group, {}).update(entries)
    return {
        "dependencies": sorted(dependencies),
        "optional-dependencies": extras,
        "scripts": scripts,
        "entry-points": points,
    }


def root() -> dict[str, Any]:
    """The section `project` of the root project, with what the packages state."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    own: dict[str, list[str]] = settings["tool"]["hatch"]["metadata"]["hooks"]["custom"]["extras"]
    return settings["project"] | merged(own)
