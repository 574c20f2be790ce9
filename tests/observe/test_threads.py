"""Threads and reels: against the heliogyro's own data set, and against springs written out here."""

from __future__ import annotations

import numpy as np
import pytest

import evolvent
from evolvent import System, analysis, parts
from evolvent.systems.heliogyro import dataset as own
from observe.seeing import Array, Seen, close, derivative, matrices, run

#: Cases of the heliogyro, and the motion of its body.
CASES = {
    "springs": {"blade.segments": "springs", "solver.duration": "3 s", "blade.nodes": 10},
    "inextensible": {
        "blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "6 s", "blade.nodes": 20,
    },
    "backwards": {
        "blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "3 s", "blade.nodes": 20,
        "body.rate": "-6 rad/s",
    },
    "implicit": {"blade.segments": "springs", "solver.method": "generalized-alpha", "solver.duration": "3 s",
                 "blade.nodes": 10},
    "free": {
        "blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "3 s", "blade.nodes": 20,
        "body.motion": "free", "body.mass": "2 kg",
    },
}  # fmt: skip


def heliogyro(monkeypatch: pytest.MonkeyPatch, overrides: dict[str, str]) -> tuple[object, Seen]:
    """A run of the heliogyro: its data set, and the tree of the same solution."""
    kept: list[object] = []
    plain = own.dataset_of

    def noted(case: object, assembly: object, solution: object, laws: object) -> object:
        kept.append(solution)
        return plain(case, assembly, solution, laws)

    monkeypatch.setattr("evolvent.systems.heliogyro.simulate.dataset_of", noted)
    data = evolvent.run("heliogyro", overrides)
    solution = kept[-1]
    return data, Seen(solution.assembly, solution, analysis.tree(solution, case="", why=""))


@pytest.mark.parametrize("which", list(CASES))
def test_a_blade_of_the_heliogyro(which: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lag, tension at the spool, length and spool as the heliogyro's own data set has them."""
    data, found = heliogyro(monkeypatch, CASES[which])
    name = next(k for k, (family, _) in found.assembly.names.items() if family == "threads")
    reel = found.assembly.parts[name].reel
    for variable, wanted in {
        "tension": data.tension[:, 0], "lag": data.lag_angle[:, 0], "signed_lag": data.signed_lag[:, 0],
        "released": data.released[:, 0], "hub_tension": data.hub_tension[:, 0],
        "deployed_length": data.deployed_length[:, 0], "separated": data.let_go[:, 0],
        "tip_lag": data.signed_lag[:, 0, 0],
    }.items():  # fmt: skip
        close(found.of(name, variable), wanted.values, part=1e-7)
    close(found.of(reel, "angle"), data.spool_angle[:, 0].values)
    radius = float(found.assembly.parts[reel].radius)
    close(found.of(reel, "torque"), radius * data.hub_tension[:, 0].values)
    # places: the data set has them in body axes, from the body's centre
    body = found.tree["body"]
    R = matrices(body["attitude"].values)
    arm = found.of(name, "position") - body["position"].values[:, None]
    close(np.einsum("tji,tnj->tni", R, arm), data.position[:, 0].values, part=1e-9)
    # energies: those of the blades and of the body are all there is
    blades = [group for group in found.tree.children.values() if group.attrs["kind"] == "thread"]
    kinetic, elastic, angular = (
        sum(blade[key].values for blade in blades) for key in ("energy_kinetic", "energy_elastic", "angular_momentum")
    )
    close(kinetic + body["energy_kinetic"].values, data.energy_kinetic.values)
    close(elastic + 1.0, data.energy_elastic.values + 1.0)
    x, v = body["position"].values, body["velocity"].values
    mass = float(found.assembly.parts["body"].mass or 0.0)
    total = angular + body["angular_momentum"].values + mass * np.cross(x, v)
    close(total[:, 2], data.angular_momentum.values)
    rate = found.of(reel, "rate")
    assert rate == pytest.approx(np.gradient(data.spool_angle[:, 0].values, found.t), rel=1e-3)


def hanging(feed: object) -> System:
    system = System(gravity=(0.0, 0.0, -2.0))
    system.add(parts.RigidBody(motion="driven"), "base")
    reel = parts.Reel(
        body="base",
        radius=0.1,
        feed=feed,
        centre=(0.0, 0.1, 0.0),
        feed_axis=(0.0, 0.0, -1.0),
        spool_axis=(1.0, 0.0, 0.0),
    )
    system.add(reel, "reel")
    thread = parts.Thread(
        reel="reel", length=1.0, line_density=0.1, tip_mass=0.2, nodes=5, stiffness=400.0, damping=2.0
    )
    system.add(thread, "thread")
    return system


def test_tensions_of_springs_under_both_methods() -> None:
    """Each segment pulls with c (length - l0) + d length', also under the implicit method, and both runs agree."""
    seen = {}
    for method, options in (("rk4", {"step": 5e-4}), ("generalized-alpha", {"step": 1e-3})):
        found = run(hanging(parts.ConstantDrive(rate=1.0, angle=5.0)), np.linspace(0.0, 1.0, 21), method, **options)
        x, v = (a.reshape(21, 5, 3) for a in (found.state("thread", 15), found.state("thread", 15, rate=True)))
        tension, count = found.of("thread", "tension"), found.solution.s[:, 0]
        for k in range(21):
            for i in range(int(count[k]) - 1):
                e = x[k, i] - x[k, i + 1]
                length = np.linalg.norm(e)
                wanted = 400.0 * (length - 0.2) + 2.0 * (v[k, i] - v[k, i + 1]) @ e / length
                assert tension[k, i] == pytest.approx(wanted, abs=1e-9)
            last = int(count[k]) - 1  # the boundary segment is let out by the spool
            Q = np.array([0.0, 0.0, 0.0]) + found.assembly.model.threads["departure"][0]
            e = x[k, last] - Q
            length, out = np.linalg.norm(e), 0.1 * (5.0 + found.t[k]) - 0.2 * last
            rate = v[k, last] @ e / length - 0.1 * (np.array([0.0, 0.0, -1.0]) @ e) / length
            assert tension[k, last] == pytest.approx(400.0 * (length - out) + 2.0 * rate, abs=1e-8)
            assert np.all(np.isnan(tension[k, last + 1 :]))
        close(found.of("thread", "deployed_length"), 0.1 * (5.0 + found.t))
        close(found.of("reel", "rate"), 1.0)
        close(found.of("reel", "torque"), 0.1 * found.of("thread", "hub_tension"))
        rows = count[:, None] > np.arange(5)
        masses = np.array([0.2 + 0.01, 0.02, 0.02, 0.02, 0.02])
        kinetic = 0.5 * np.sum(np.where(rows, masses * np.sum(v**2, axis=-1), 0.0), axis=1)
        close(found.of("thread", "energy_kinetic"), kinetic)
        close(found.of("thread", "momentum"), np.sum(np.where(rows[..., None], masses[:, None] * v, 0.0), axis=1))
        seen[method] = found
    one, two = (seen[m].of("thread", "hub_tension") for m in seen)
    close(one[2:], two[2:], part=0.15)
    close(one.mean(), two.mean(), part=0.02)


def test_a_free_spool() -> None:
    """It turns by the thread's pull: J phi'' = r T, and its energy is the thread's."""
    feed = parts.FreeSpool(inertia=0.01, angle=5.0, rate=0.5)
    found = run(hanging(feed), np.linspace(0.0, 0.3, 601), "rk4", step=1e-4)
    model = found.assembly.model
    at = int(model.threads["spool_q"][0]), int(model.threads["spool_v"][0])
    angle, rate = (found.solution.y[:, k] for k in at)
    close(found.of("reel", "angle"), angle)
    close(found.of("reel", "rate"), rate)
    smooth: Array = np.flatnonzero(np.all([np.roll(found.solution.s[:, 0], k)[2:-2] == found.solution.s[2:-2, 0]
                                           for k in range(-3, 4)], axis=0))  # fmt: skip
    wanted = 0.01 * derivative(found.t, rate)
    close(found.of("reel", "torque")[2:-2][smooth], wanted[smooth], part=5e-3)
    v = found.state("thread", 15, rate=True).reshape(-1, 5, 3)
    rows = found.solution.s[:, :1] > np.arange(5)
    masses = np.array([0.21, 0.02, 0.02, 0.02, 0.02])
    kinetic = 0.5 * np.sum(np.where(rows, masses * np.sum(v**2, axis=-1), 0.0), axis=1) + 0.5 * 0.01 * rate**2
    close(found.of("thread", "energy_kinetic"), kinetic)
