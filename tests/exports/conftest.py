"""Short runs of all three systems, one that failed, and the command line."""

from __future__ import annotations

import pytest

import evolvent
from evolvent import parts, results
from evolvent.solvers.common import balance
from evolvent.solvers.time.explicit import run as explicit_run

SHORT = {
    "heliogyro": (
        "heliogyro",
        {
            "blade.segments": "inextensible",
            "solver.method": "dopri5",
            "solver.duration": "12 s",
            "output.every": "0.2 s",
        },
    ),
    "stand": ("inertia-stand", {"sensors.duration": "3 s", "body.offset_x": "0.2 m", "body.height": "0.1 m"}),
    "rib": ("wrapped-rib-hold", {"rib.elements": 20, "hold.time": "4 s", "output.every": "0.2 s"}),
}


@pytest.fixture(scope="session")
def runs():
    """A short run of every system, by a short name."""
    return {name: evolvent.run(case, changes) for name, (case, changes) in SHORT.items()}


@pytest.fixture(scope="session")
def released():
    """A flap with a spring and a harness in its hinge, which is released half-way, and a post that stays."""
    made = evolvent.System(title="Flap")
    shape = {"box": (0.2, 0.1, 0.1)}
    for name, x in (("flap", 0.0), ("post", 1.0)):
        made.add(parts.RigidBody(mass=1.0, shape=shape, position=(x, 0.0, 0.0)), name)
    made.add(parts.Joint(a=(0.0, 0.0, 0.0), b="flap", type="revolute", axis=(0, 1, 0), until=0.1), "pin")
    made.add(parts.JointSpring(joint="pin", stiffness=1.0, damping=0.1, rest=0.5), "hinge")
    made.add(parts.Resistance(joint="hinge", type="harness", stiffness=0.1), "harness")
    made.add(parts.Joint(a=(1.0, 0.0, 0.0), b="post", type="clamp"), "clamp")
    return made.simulate(until=0.2, every=0.02)


@pytest.fixture(scope="session")
def failed():
    """A run that stopped half-way, since its energy balance was said to be off."""
    case, changes = SHORT["heliogyro"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explicit_run, "DIVERGED", 1e-13)
        patch.setattr(balance, "GAINED", 1e-13)
        patch.setattr(balance, "ROUND_OFF", 0.0)
        with pytest.raises(evolvent.RunFailed) as caught:
            evolvent.run(case, changes)
    run = caught.value.run
    assert run.attrs["status"] == "failed"
    assert 2 <= run.sizes["time"] < 61
    return run


@pytest.fixture(scope="session")
def files(runs, failed, tmp_path_factory):
    """The runs as files, by name."""
    folder = tmp_path_factory.mktemp("runs")
    paths = {}
    for name, run in (runs | {"failed": failed}).items():
        paths[name] = str(folder / f"{name}.nc")
        results.save(run, paths[name])
    return paths
