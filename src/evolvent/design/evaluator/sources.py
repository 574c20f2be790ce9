"""What results of runs depend on beside their case: sources and versions of packages."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import pathlib
import platform

import evolvent
from evolvent import cases
from evolvent.base import file_keys, plugins
from evolvent.model import family
from evolvent.parts import registry

_PACKAGE = pathlib.Path(evolvent.__file__).parent
#: What the results of runs cannot depend on: pictures, the command, what is evaluated of them.
_NOT_SOURCES = (
    "studio/",
    "commands/",
    "view/",
    "analysis/accessor.py",
    "results/figures.py",
    "results/solids.py",
    "design/studies/draw.py",
    "design/studies/accessor.py",
    "design/dispersions/",
)


@functools.cache
def sources() -> str:
    """Hash of all sources that results depend on: of this package, and of packages that add systems and parts."""
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        name = path.relative_to(_PACKAGE).as_posix()
        if not name.startswith(_NOT_SOURCES):
            digest.update(name.encode() + b"\0" + path.read_bytes())
    for group in (cases.GROUP, registry.GROUP, family.GROUP):
        for point in plugins.entry_points(group):
            for label, path in plugins.files_of(point):
                digest.update(label.encode() + b"\0" + file_keys.digest(str(path)).encode())
    return digest.hexdigest()[:16]


def versions() -> dict[str, str]:
    """Versions of what computes; also of packages that add systems and parts."""
    found = {"evolvent": evolvent.__version__, "python": platform.python_version()}
    for group in (cases.GROUP, registry.GROUP, family.GROUP):
        added = [point.dist for point in plugins.entry_points(group) if point.dist is not None]
        found |= {package.name: package.version for package in added}
    return found | {name: importlib.metadata.version(name) for name in ("numpy", "scipy", "numba")}
