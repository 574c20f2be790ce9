"""What results of runs depend on beside their case: sources and versions of packages."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import platform

from evolvent import cases
from evolvent.model import registry as family_registry
from evolvent.parts import registry
from evolvent_base import __version__, file_keys, packages, plugins

#: What the results of runs cannot depend on: pictures, the command, what is evaluated of them.
_NOT_SOURCES = (
    "evolvent_studio/",
    "evolvent_cosim/",
    "evolvent/commands/",
    "evolvent/view/",
    "evolvent_base/cli.py",
    "evolvent_base/pages.py",
    "evolvent_base/plots.py",
    "evolvent_base/style.py",
    "evolvent_base/ticks.py",
    "evolvent_base/layout.py",
    "evolvent/analysis/accessor.py",
    "evolvent_base/figures.py",
    "evolvent/results/solids.py",
    "evolvent/design/studies/draw.py",
    "evolvent/design/studies/accessor.py",
    "evolvent/design/dispersions/",
    "evolvent_massprops/commands/",
    "evolvent_papers/commands/",
    "evolvent_papers/papers/",
    "evolvent_papers/laboratory/",
)


@functools.cache
def sources() -> str:
    """Hash of all sources that results depend on: of evolvent, and of packages outside that add systems and parts."""
    digest = hashlib.sha256()
    for package, folder in packages.folders().items():
        for path in sorted(folder.rglob("*.py")):
            name = f"{package}/{path.relative_to(folder).as_posix()}"
            if not name.startswith(_NOT_SOURCES):
                digest.update(name.encode() + b"\0" + path.read_bytes())
    for group in (cases.GROUP, registry.GROUP, family_registry.GROUP):
        for point in plugins.outside(group):
            for label, path in plugins.files_of(point):
                digest.update(label.encode() + b"\0" + file_keys.digest(str(path)).encode())
    return digest.hexdigest()[:16]


def versions() -> dict[str, str]:
    """Versions of what computes; also of packages outside that add systems and parts."""
    found = {"evolvent": __version__, "python": platform.python_version()}
    for group in (cases.GROUP, registry.GROUP, family_registry.GROUP):
        added = [point.dist for point in plugins.outside(group) if point.dist is not None]
        found |= {package.name: package.version for package in added}
    return found | {name: importlib.metadata.version(name) for name in ("numpy", "scipy", "numba")}
