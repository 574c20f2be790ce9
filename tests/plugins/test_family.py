"""A family of records from outside the package: one module with record, ends, part and what is observed."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import evolvent

#: The module: record, ends and kinds of the family, its part, and what is added to the results of its records.
MODULE = '''
"""A brake between two bodies that both turn about one axis."""

from typing import Annotated, Literal

import numpy as np

from evolvent_base import units
from evolvent.kernels.ends import of_bodies
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts, Switches
from evolvent.parts.base import BodyName, Part


class Brake(Part):
    """A brake between two bodies.

    Parameters
    ----------
    a, b : str
        The bodies.
    """

    kind: Literal["brake"] = "brake"
    a: BodyName
    b: BodyName

    def write(self, builder, name):
        """Write one record."""
        own = {key: builder.find(getattr(self, key), "bodies") for key in ("a", "b")}
        builder.names[name] = ("brakes", builder.add("brakes", force=(1.0, 2.0, 3.0), held=5.0, **own))


def _observe(view, name, found):
    a, b = (view.pose(int(view.model.brakes[view.index(name)][key])) for key in ("a", "b"))
    found.scalar("slip", np.linalg.norm(b.w - a.w, axis=1), "rad s-1", "rate of one body against the other")


BRAKES = Family(
    "brakes",
    record("a b switch account", "held", "force", force=(3,)),
    order=500,
    results={"force": ("force", "N", "force of the brake"), "held": ("held", "N m", "torque that it holds")},
    kinds=(Kind("a brake", symmetric=True),),
    ends=of_bodies("a", "b"),
    accounts=(Accounts(2),),
    switches=(Switches(1, lambda found, builder: [1] * found.size),),
    observe=_observe,
)
'''
CASE = """
system: structure
parts:
  drum: {kind: rigid-body, mass: 1 kg, inertia: 1 kg m^2, angular_velocity: [0, 0, 2 rad/s]}
  rim: {kind: rigid-body, mass: 1 kg, inertia: 1 kg m^2, angular_velocity: [0, 0, -1 rad/s]}
  brake: {kind: brake, a: drum, b: rim}
simulate: {until: 0.02 s, every: 0.01 s, method: rk4, step: 5 ms}
"""
SCRIPT = """
import json, sys
import numpy as np
import evolvent
from evolvent import parts
from evolvent.parts.registry import kinds, unusable
system = evolvent.System()
for name, rate in {"drum": 2.0, "rim": -1.0}.items():
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, angular_velocity=(0.0, 0.0, rate)), name)
system.add(kinds()["brake"](a="drum", b="rim"), "brake")
first = system.simulate(until=0.02, every=0.01, method="rk4", step=5e-3)
second = evolvent.run("case.yaml")
held = [{name: [str(run["brake"][name].attrs["units"]), run["brake"][name].values.tolist()]
         for name in run["brake"].data_vars} for run in (first, second)]
model, y, s = (getattr(system.assemble(), key) for key in ("model", "y", "s"))
account, switch = (int(model.brakes[key][0]) for key in ("account", "switch"))
print(json.dumps([held, [y.size - account, s[switch].item(), int(model.info.open)], dict(unusable())]))
"""


@pytest.fixture
def outside(tmp_path: pathlib.Path) -> pathlib.Path:
    """A folder with the module and its entry point, and beside it one that cannot be loaded."""
    (tmp_path / "brakes_from_outside.py").write_text(MODULE)
    (tmp_path / "case.yaml").write_text(CASE)
    about = tmp_path / "brakes_from_outside-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: brakes-from-outside\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[evolvent.families]\nbrakes = brakes_from_outside\nlost = lost_module\n")
    return tmp_path


def test_a_family_from_outside_is_built_read_and_has_results(outside: pathlib.Path) -> None:
    source = str(pathlib.Path(evolvent.__file__).parents[1])
    env = os.environ | {"PYTHONPATH": os.pathsep.join([source, str(outside)]), "NUMBA_DISABLE_JIT": "1"}
    env["EVOLVENT_PLUGINS"] = "all"
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=outside, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    runs, (behind, switched, is_open), unusable = json.loads(done.stdout.splitlines()[-1])
    for found in runs:
        assert found["force"] == ["N", [[1.0, 2.0, 3.0]] * 3]
        assert found["held"] == ["N m", [5.0] * 3]
        units, slip = found["slip"]
        assert units == "rad s-1"
        np.testing.assert_allclose(slip, 3.0, rtol=1e-12)
    assert (behind, switched, is_open) == (2, 1, 1)  # which does not say that its forces balance
    assert list(unusable) == ["lost"]
    assert "lost_module" in unusable["lost"]
