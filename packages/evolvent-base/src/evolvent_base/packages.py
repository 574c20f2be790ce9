"""The packages of evolvent: which are installed, what each of them offers, and what to say of one that is missing.

They are of one repository and one version. Each offers commands, systems and other things by entry points
(`evolvent_base.plugins`); `OFFERS` repeats the names that a user may ask for, so that a package that is missing can be
named.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import pathlib
from typing import Any, NamedTuple

from evolvent_base.errors import InputError


class Offer(NamedTuple):
    """What a package offers by name.

    Attributes
    ----------
    commands : names of commands
    systems : names of systems; the built-in cases and studies of a system begin with its name
    """

    commands: tuple[str, ...] = ()
    systems: tuple[str, ...] = ()


#: Packages by their names for pip.
OFFERS = {
    "evolvent": Offer(
        (
            "calibrate", "clearance", "design", "disperse", "equilibrium", "export", "info", "list", "margin", "modes",
            "parts", "plot", "reflector", "report", "run", "schema", "sensitivity", "show", "storage", "sweep",
        ),
        ("structure",),
    ),
    "evolvent-base": Offer(),
    "evolvent-cosim": Offer(("fmu",)),
    "evolvent-massprops": Offer(("identify", "plan"), ("inertia-stand",)),
    "evolvent-papers": Offer(
        ("claims", "design-drive", "figure", "permissible-torque", "validate"),
        ("film-blade", "heliogyro", "wire-booms", "wrapped-rib"),
    ),
    "evolvent-studio": Offer(("studio",)),
}  # fmt: skip
#: Their names for `import`.
NAMES = tuple(name.replace("-", "_") for name in OFFERS)


def is_own(module: str) -> bool:
    """Whether a module is one of evolvent's own packages."""
    return module.partition(".")[0] in NAMES


@functools.cache
def folders() -> dict[str, pathlib.Path]:
    """Folders of the sources of the packages that are installed, by their names for `import`."""
    found = {}
    for name in NAMES:
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.origin is not None:
            found[name] = pathlib.Path(spec.origin).parent
    return found


def lacking(kind: str, name: str) -> str:
    """A sentence on the package that offers something, where that is not installed; '' otherwise.

    Parameters
    ----------
    kind : "command", "system", "case" or "study"
    name : str
    """
    for package, offer in OFFERS.items():
        known = offer.commands if kind == "command" else offer.systems
        asked = name in known if kind in ("command", "system") else any(f"{name}-".startswith(f"{s}-") for s in known)
        if asked and package.replace("-", "_") not in folders():
            return f"the {kind} {name!r} is of the package {package}, which is not installed: {line(package)}"
    return ""


def line(package: str) -> str:
    """The line that installs a package."""
    return f"pip install {package}"


def module(name: str, what: str) -> Any:
    """A module of another of the packages.

    Parameters
    ----------
    name : str, of the module
    what : str, for the message: what needs the package

    Raises
    ------
    InputError
        If its package is not installed.
    """
    top = name.partition(".")[0]
    if top not in folders():
        package = top.replace("_", "-")
        raise InputError(f"{what} needs the package {package}, which is not installed: {line(package)}")
    return importlib.import_module(name)
