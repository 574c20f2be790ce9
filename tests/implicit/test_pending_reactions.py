"""Reactions at the samples of an implicit run are evaluated where they are asked for, with the same bits."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evolvent import System, cases, parts
from evolvent.solvers.time.implicit import reactions


@pytest.mark.slow
def test_reactions_are_evaluated_where_they_are_asked_for(monkeypatch):
    plan = cases.system("structure").plan(cases.load("solar-array", {"simulate.until": "3 s"}))
    whole = plan.run(None)
    evaluated, calls = reactions.PendingReactions.evaluated, []
    monkeypatch.setattr(
        reactions.PendingReactions, "evaluated", lambda self: calls.append(self.samples.size) or evaluated(self)
    )
    seen = plan.observe(["hinge 1.angle", "panel 3.rate"])
    assert calls == []
    assert seen["hinge 1.angle"].values.tobytes() == whole["hinge 1"].angle.values.tobytes()
    assert seen["panel 3.rate"].values.tobytes() == whole["panel 3"].rate.values.tobytes()
    seen = plan.observe(["pivot 1.force"])
    assert set(calls) == {whole.time.size}
    assert seen["pivot 1.force"].values.tobytes() == whole["pivot 1"].force.values.tobytes()


def test_explicit_and_implicit_equations_give_the_same_reactions(monkeypatch):
    """A double pendulum with a wheel, a spring, a load and a joint that is released."""
    system = System(gravity=(0.0, 0.0, -9.81))
    for k, x in enumerate((0.5, 1.5)):
        system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.3, 0.3), position=(x, 0.0, 0.0)), f"arm {k}")
    axis = {"type": "revolute", "axis": (0.0, 1.0, 0.1)}
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="arm 0", **axis), "shoulder")
    system.add(parts.Joint(a=("arm 0", (0.5, 0.0, 0.0)), b="arm 1", **axis, until=0.5), "elbow")
    system.add(parts.Spring(a=(1.0, 0.0, 1.0), b="arm 1", stiffness=50.0, damping=1.0), "spring")
    system.add(parts.ReactionWheel(body="arm 1", axis=(0.0, 0.0, 1.0), inertia=0.01, rate=20.0), "wheel")
    system.add(parts.Load(at="arm 1", force=(0.0, 0.0, 2.0)), "push")

    def found() -> np.ndarray:
        run = system.simulate(until=1.0, every=0.02, method="generalized-alpha")
        return np.concatenate([run[name][key].values for name in ("shoulder", "elbow") for key in ("force", "moment")])

    by_rates, asked = found(), []
    monkeypatch.setattr(reactions, "has_explicit_equations", lambda model: asked.append(model) or False)
    by_tangent = found()
    assert asked
    assert np.abs(by_tangent).max() > 10.0
    np.testing.assert_allclose(by_rates, by_tangent, atol=1e-7 * np.abs(by_tangent).max())


def test_joints_of_a_planar_loop_share_loads_at_every_sample():
    """Four bars on revolute joints, of which a light one makes pivots of redundant rows round-off that is not small.

    Gravity lies in the plane of the loop. By symmetry no joint has a force across it.
    """
    turn = Rotation.from_rotvec([1.0, -0.4, 0.2]).as_matrix()
    corners = [turn @ one for one in ([0.0, 0.0, 0.0], [0.3, 0.0, 1.0], [1.5, 0.0, 1.2], [1.4, 0.0, 0.0])]
    system, across = System(gravity=turn @ [0.0, 0.0, -9.81]), turn @ [0.0, 1.0, 0.0]
    for k, mass in enumerate((1.0, 1e-5, 1.0)):
        middle = 0.5 * (corners[k] + corners[k + 1])
        system.add(parts.RigidBody(mass=mass, inertia=0.1 * mass, position=middle), f"bar {k}")
    for k, corner in enumerate(corners):
        a, b = (
            (f"bar {n}", corner - 0.5 * (corners[n] + corners[n + 1])) if 0 <= n < 3 else corner for n in (k - 1, k)
        )
        system.add(parts.Joint(a=a, b=b, type="revolute", axis=across), f"pin {k}")
    run = system.simulate(until=1.0, every=0.02, method="generalized-alpha")
    for k in range(4):
        force = run[f"pin {k}"].force.values
        np.testing.assert_allclose(force @ across, 0.0, atol=1e-5 * np.abs(force).max())
