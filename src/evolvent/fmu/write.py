"""Packing an FMU: the case, what the wrapper starts, what a reader needs to know."""

from __future__ import annotations

import html
import importlib.metadata
import json
import math
import os
import pathlib
import re
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from typing import Any

from evolvent import __version__, cases
from evolvent.errors import InputError, nearest
from evolvent.results import writing

#: Files in the FMU's folder of resources.
CASE, MODEL = "case.yaml", "model.json"
#: The library, and the module of the FMU that its wrapper starts.
LIBRARY, SCRIPT = "pythonfmu3", "evolvent_model"
_SOURCE = '''\
"""What the FMU's wrapper starts; the case and its bodies lie beside this file."""

import sys

from pythonfmu3 import Fmi3Slave

try:
    from evolvent.fmu.instance import Instance
except ImportError as error:
    raise ImportError(f"this FMU needs a Python with evolvent {version}; {{sys.prefix}} has none ({{error}})") from None


class Model(Instance, Fmi3Slave):
    """The case as a model for co-simulation."""
'''
_PAGE = """\
<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{name}</title></head><body>
<h1>{name}</h1>
<p>{description}</p>
<p>Inputs are held over a step: NAME.force (N) at the body's origin, NAME.torque (N m). Outputs: NAME.position (m),
NAME.velocity (m/s), NAME.quaternion (body to inertial, scalar first), NAME.rate (rad/s), NAME.structure_force (N) and
NAME.structure_torque (N m, about the body's origin). All are in inertial axes. Bodies: {bodies}; with inputs:
{inputs}.</p>
<p>The case begins where the simulation begins, whatever the time is then. It can be stepped for {until:.9g} s.</p>
<pre>{case}</pre>
<p>The wrapper is PythonFMU3, under the MIT licence: <a href="licenses/{library}.txt">its text</a>.</p>
</body></html>
"""


def write(
    case: Any,
    path: str | os.PathLike[str],
    *,
    overrides: Mapping[str, Any] | None = None,
    bodies: Sequence[str] | None = None,
    until: float | None = None,
) -> str:
    """Write a case as an FMU 3.0 for co-simulation; returns what was written.

    Parameters
    ----------
    case, overrides : as of `evolvent.run`
    path : str or path
    bodies : names, of those that have inputs and outputs; None: all
    until : float, s, the end of the time that may be stepped through; None: that of the case's run

    Raises
    ------
    InputError
        If the library is missing, the case or a body cannot be used, or the file cannot be written.
    """
    builder = _library()
    from evolvent.stepping import movable, of_case

    loaded = cases.load(case, overrides)
    system, _, end = of_case(loaded, until)
    if not (math.isfinite(end) and end > 0.0):
        raise InputError(f"until is {end!r} s; it must be a finite time above 0")
    known = movable(system)
    names = list(known) if bodies is None else list(bodies)
    for k, body in enumerate(names):
        if body not in known:
            raise InputError(f"bodies name {body!r}, which is no body; {nearest(body, known)}")
        if body in names[:k]:
            raise InputError(f"bodies name {body!r} twice; name it once")
    name, moved = _identifier(path), [body for body in names if known[body]]
    model: dict[str, Any] = {
        "name": name,
        "description": f"{loaded.system}, stepped by evolvent {__version__}; the machine that runs it needs a Python 3 "
        f"with that package, found first on its PATH",
        "version": __version__,
        "bodies": names,
        "inputs": moved,
        "until": end,
        "every": float(loaded.output.every),
        **_start(loaded),
    }
    with tempfile.TemporaryDirectory(prefix="evolvent-fmu-") as temporary, writing(path) as target:
        folder = pathlib.Path(temporary)
        _fill(folder, model, cases.to_yaml(loaded))
        script = folder / f"{SCRIPT}.py"
        made = builder.build_FMU(
            script_file=script,
            dest=folder / "made",
            project_files=[p for p in folder.iterdir() if p.is_file() and p != script],
            documentation_folder=folder / "documentation",
        )
        shutil.copyfile(made, target)
    inputs = ", ".join(moved) or "none"
    return f"{os.fspath(path)}: bodies {', '.join(names)}; inputs on {inputs}; to be stepped for {end:.6g} s"


def _library() -> Any:
    try:
        from pythonfmu3 import FmuBuilder
    except ImportError:
        raise InputError(f"an FMU needs the package {LIBRARY}; pip install 'evolvent[fmu]' brings it") from None
    return FmuBuilder


def _identifier(path: str | os.PathLike[str]) -> str:
    """Name of the model after its file, such as a compiler allows."""
    name = re.sub(r"\W", "_", pathlib.Path(path).stem, flags=re.ASCII)
    return name if re.match(r"[A-Za-z_]", name) else f"model_{name}"


def _start(case: Any) -> dict[str, str]:
    """Key and file of a saved run that the case starts from, if it does."""
    key = getattr(cases.system(case.system), "START_KEY", "")
    value = getattr(case, key, "")
    return {"start_key": key, "start": value} if os.path.isfile(value) else {}


def _fill(folder: pathlib.Path, model: dict[str, Any], case: str) -> None:
    """Write what the FMU holds."""
    (folder / f"{SCRIPT}.py").write_text(_SOURCE.format(version=__version__), encoding="utf-8")
    (folder / CASE).write_text(case, encoding="utf-8")
    if "start" in model:
        kept = f"start{pathlib.Path(model['start']).suffix}"
        shutil.copyfile(model["start"], folder / kept)
        model = model | {"start": kept}
    (folder / MODEL).write_text(json.dumps(model, indent=2), encoding="utf-8")
    documentation = folder / "documentation"
    (documentation / "licenses").mkdir(parents=True)
    page = _PAGE.format(
        name=html.escape(model["name"]),
        description=html.escape(model["description"]),
        bodies=html.escape(", ".join(model["bodies"])),
        inputs=html.escape(", ".join(model["inputs"]) or "none"),
        until=model["until"],
        case=html.escape(case),
        library=LIBRARY,
    )
    (documentation / "index.html").write_text(page, encoding="utf-8")
    licence = next((f for f in importlib.metadata.files(LIBRARY) or () if f.name == "LICENSE"), None)
    if licence is not None:
        shutil.copyfile(str(licence.locate()), documentation / "licenses" / f"{LIBRARY}.txt")
