"""Where things are and what acts on them: against the run's own variables and Newton's laws."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import evolvent
from evolvent import cases
from evolvent.results.rotations import about_z, product, turned


def motion(run):
    return cases.system(run.attrs["system"]).motion(run)


def matrices(q):
    return Rotation.from_quat(q[:, [1, 2, 3, 0]]).as_matrix()


def test_quaternions_turn_as_matrices_do(rng):
    p, q = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.standard_normal((2, 5, 4)))
    x = rng.standard_normal((5, 3, 3))
    assert turned(q, x) == pytest.approx(np.einsum("tij,tnj->tni", matrices(q), x))
    assert matrices(product(p, q)) == pytest.approx(matrices(p) @ matrices(q))
    assert matrices(about_z(np.full(5, 0.3))) == pytest.approx(
        np.tile(Rotation.from_rotvec([0, 0, 0.3]).as_matrix(), (5, 1, 1))
    )


def test_blades_turn_with_the_body(runs):
    """The copy of a blade stands half a turn from it; wound nodes are where the thread leaves the spool."""
    run, found = runs["heliogyro"], motion(runs["heliogyro"])
    blade = run["blade-1"]
    out = blade.released.values > 0.0
    assert out.any()
    assert not out.all()
    one, two = found.lines
    assert one.points[:, :-1][out] == pytest.approx(blade.position.values[out], abs=1e-12)
    c, s = np.cos(run.body_angle.values), np.sin(run.body_angle.values)
    leaves = np.stack([0.05 * c, 0.05 * s, np.full(c.size, 0.01)], axis=-1)
    assert one.points[:, :-1][~out] == pytest.approx(np.repeat(leaves, (~out).sum(axis=1), axis=0), abs=1e-12)
    assert two.points == pytest.approx(one.points * [-1.0, -1.0, 1.0], abs=1e-12)
    tension = two.values["tension [N]"]
    assert tension[:, :-1][out] == pytest.approx(blade.tension.values[out])
    assert np.isnan(tension[:, :-1][~out]).all()
    assert tension[-1, -1] == run.hub_tension.values[-1, 1]


def test_copies_stand_as_blades_of_their_own_do():
    """Three blades that one stands for, and three of equal drive followed one by one: lines, strips, forces."""
    case = {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "3 s", "body.blades": 3}
    sun = {"blade.width": "8 cm", "sunlight": {"pressure": 0.0, "direction": [0.0, 0.0, 1.0]}}
    copies = motion(evolvent.run("heliogyro", {**case, **sun}))
    each = motion(evolvent.run("heliogyro", {**case, **sun, "sunlight.direction": [1.0, 0.0, 1.0]}))
    assert len(copies.lines) == len(each.lines) == 3
    for one, other in zip(copies.lines, each.lines, strict=True):
        assert one.points == pytest.approx(other.points, abs=1e-7)
        assert one.across == pytest.approx(other.across, abs=1e-7)
        assert one.width == other.width == 0.08
    solids = zip(copies.frames[0].solids, each.frames[0].solids, strict=True)
    for one, other in solids:
        assert one.centre == pytest.approx(other.centre, abs=1e-12)
        assert one.axis == pytest.approx(other.axis, abs=1e-12)
    pulls = [force for force in each.forces if force.name.startswith("pull of")]
    lights = [force for force in each.forces if force not in pulls]
    assert len(copies.forces) == 2
    for one, others in zip(copies.forces, (pulls, lights), strict=True):
        assert len(others) == 3
        at, vectors = (np.concatenate([getattr(f, key) for f in others], axis=1) for key in ("points", "vectors"))
        assert one.points == pytest.approx(at, abs=1e-7)
        assert one.vectors == pytest.approx(vectors, abs=1e-9)


def test_the_pull_of_the_blades_turns_the_body(runs):
    """J W' = sum r x F about z (eq. 16), W' by central differences."""
    run, found = runs["heliogyro"], motion(runs["heliogyro"])
    force = found.forces[0]
    torque = np.cross(force.points, force.vectors).sum(axis=1)[:, 2]
    wanted = 0.004 * np.gradient(run.body_rate.values, run.time.values)
    smooth = slice(3, 34)  # before the second node is released, at 7.1 s
    assert torque[smooth] == pytest.approx(wanted[smooth], rel=2e-2)
    # seen from the body the spools stand still
    still = found.in_body()
    assert np.ptp(still.forces[0].points, axis=0).max() < 1e-12
    assert matrices(still.frames[0].attitude) == pytest.approx(np.tile(np.eye(3), (run.sizes["time"], 1, 1)), abs=1e-12)


def test_the_springs_carry_and_move_the_stand(runs):
    """m a = sum F + m g, a by central differences; the forces are the springs' stiffness times their stretch."""
    run, found = runs["stand"], motion(runs["stand"])
    mass, h = 15190.0, float(run.time[1])
    force = found.forces[0]
    a = np.gradient(run["body"].velocity.values, h, axis=0)[2:-2]
    wanted = mass * (a + np.array([0.0, 9.81, 0.0]))
    assert force.vectors.sum(axis=1)[2:-2] == pytest.approx(wanted, abs=2e-3 * 9.81 * mass)
    ends = [s.points[:, 1] for s in found.lines]
    assert np.stack(ends, axis=1) == pytest.approx(force.points)
    stiffness = np.stack([run[f"spring-{k}"].force.values for k in range(1, 5)], axis=1) / (
        np.linalg.norm(np.stack([s.points[:, 1] - s.points[:, 0] for s in found.lines], axis=1), axis=-1)
        - natural_length(run)
    )
    assert stiffness == pytest.approx(np.full_like(stiffness, stiffness.flat[0]), rel=1e-6)


def natural_length(run):
    return np.array(cases.load(cases.parse_yaml(run.attrs["case"], "case")).stand.natural_length)


def test_the_hub_presses_on_the_rib(runs):
    run, found = runs["rib"], motion(runs["rib"])
    nodes = run["rib-1"]["position"].values
    assert found.lines[0].points[:, :: (found.lines[0].points.shape[1] - 1) // 20] == pytest.approx(nodes)
    (pushed,) = (force for force in found.forces if force.name == "contact-1 on rib-1")
    sizes = np.linalg.norm(pushed.vectors, axis=-1)
    assert sizes.sum(axis=1) == pytest.approx(run["contact-1"]["point_force"].values.sum(axis=1), rel=1e-6, abs=1e-9)
    assert sizes[-1].max() > 0.0
    outward = np.sum(pushed.vectors * pushed.points, axis=-1)
    assert (outward >= 0.0).all()
    assert np.hypot(*pushed.points[-1, :, :2].T) == pytest.approx(np.full(80, 0.6), rel=2e-2)


@pytest.mark.parametrize("name", ["heliogyro", "stand", "rib"])
def test_body_axes_keep_all_distances(runs, name):
    found = motion(runs[name]).at(np.array([0, 5]))
    seen = found.in_body()
    for one, other in zip(found.lines, seen.lines, strict=True):
        assert np.linalg.norm(np.diff(one.points, axis=1), axis=-1) == pytest.approx(
            np.linalg.norm(np.diff(other.points, axis=1), axis=-1)
        )
    assert seen.reach == pytest.approx(found.reach)
