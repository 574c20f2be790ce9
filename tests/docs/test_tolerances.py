"""The page on tolerances: defaults are those of the code, and the stated errors are those of runs.

The table has the largest error over all samples, relative to the largest value, at the default tolerance and
at a tenth of it, against a run with a thousandth of it. A stated number is an upper bound and at most three times the
error.
"""

from __future__ import annotations

import functools
import pathlib
import re
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import cases, parts
from evolvent.solvers.static import static
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import plan as implicit

PAGE = (pathlib.Path(__file__).parents[2] / "docs" / "guide" / "tolerances.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (.+?) \| `([a-z0-9-]+)` \| `([^`]+)` \| (\S+) \| (\S+) \|$", PAGE, flags=re.MULTILINE)


def boom() -> ev.System:
    """The boom of the guide's first twelve lines."""
    guide = (pathlib.Path(__file__).parents[2] / "docs" / "guide" / "model-your-own.md").read_text(encoding="utf-8")
    program = re.findall(r"^```python\n(.*?)^```", guide, flags=re.DOTALL | re.MULTILINE)[0]
    names: dict[str, Any] = {}
    exec(program.partition("run = ")[0], names)
    return names["craft"]


def ball() -> ev.System:
    """A ball that slides on a floor and then rolls."""
    alley = ev.System(gravity=(0, 0, -9.81))
    sphere, floor = parts.Sphere(radius=0.1), parts.Plane(normal=(0, 0, 1))
    alley.add(parts.RigidBody(mass=1, shape=sphere, position=(0, 0, 0.1), velocity=(1, 0, 0)), "ball")
    law = {"stiffness": 1e5, "damping": 1, "friction": 0.3, "bristle_stiffness": 1e5, "bristle_damping": 300}
    alley.add(parts.Contact(a="ball", b=(0, 0, 0), shape=floor, **law), "floor")
    return alley


SYSTEMS = {
    "chain of masses": (lambda: ev.load("hanging-chain"), None),
    "solar array": (lambda: ev.load("solar-array"), 40.0),
    "boom after a slew": (boom, 20.0),
    "ball on a floor": (ball, 0.5),
}


def default(method: str) -> float:
    """Tolerance of a method where none is given."""
    return implicit.METHODS[method].tolerance if method in implicit.METHODS else 1e-8


@functools.cache
def run(system: str, share: float) -> Any:
    """A run with a share of the default tolerance."""
    build, until = SYSTEMS[system]
    built = build()
    options = {"fine": False} | ({} if until is None else {"until": until})
    method = next(row[1] for row in ROWS if row[0].startswith(system))
    if share == 1.0:
        return built.simulate(**options)
    return built.simulate(tolerance=share * default(method), **options)


@pytest.mark.slow
@pytest.mark.digits
@pytest.mark.parametrize(
    ("what", "method", "name", "stated", "tenth"), ROWS, ids=[f"{row[0]}-{row[2]}" for row in ROWS]
)
def test_the_errors_of_the_page(what: str, method: str, name: str, stated: str, tenth: str) -> None:
    exact = run(what, 1e-3).ev.get(name).values
    errors = []
    for share, text in ((1.0, stated), (0.1, tenth)):
        found = run(what, share)
        assert found.attrs["method"] == method
        error = 100.0 * float(np.nanmax(np.abs(found.ev.get(name).values - exact)) / np.nanmax(np.abs(exact)))
        assert float(text) / 3.0 < error < float(text), f"{text} % is stated, {error:.3g} % found"
        errors.append(error)
    if method in implicit.METHODS:  # "a fourth to a sixth"
        assert 3.5 < errors[0] / errors[1] < 6.5


def test_the_defaults_of_the_page() -> None:
    """Each method's tolerance, as the code has it; every system of this file has a row."""
    stated = dict(re.findall(r"^\| `([a-z0-9-]+)` \| (\S+) \| ", PAGE, flags=re.MULTILINE))
    expected = {name: method.tolerance for name, method in implicit.METHODS.items()}
    expected["dopri5"] = explicit_plan.plan.__kwdefaults__["rtol"]
    expected["equilibrium"] = static.solve_static.__kwdefaults__["tolerance"]
    assert {name: float(value) for name, value in stated.items() if name in expected} == expected
    assert {row[0] for row in ROWS} == SYSTEMS.keys()
    for name in ("wrapped-rib", "wire-booms"):
        assert f"`{name}` {cases.load(name).solver.tolerance:g}" in PAGE
