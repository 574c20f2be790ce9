"""Rest and small vibrations of a body on springs: against finite differences, closed forms and symmetry."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from evolvent_base.errors import InputError
from evolvent_massprops.inertia import Body, Stand, energy, equilibrium, linear_model, vertical_model, wrench
from evolvent_massprops.inertia.statics import rotation_matrix

TENSOR = np.array([[3703.0, 120.0, 400.0], [120.0, 43000.0, -300.0], [400.0, -300.0, 42000.0]])


def crooked(**fields):
    """A stand without any symmetry."""
    given = {
        "points": [[2.0, 0.1, 0.9], [1.9, 0.0, -0.8], [-2.1, -0.1, -0.9], [-1.8, 0.05, 0.85]],
        "stiffness": [700e3, 760e3, 740e3, 780e3],
        "length": [0.5, 0.52, 0.48, 0.5],
        "lateral_stiffness": [2e5, 1e5, 3e5, 2.5e5],
        "damping": [900.0, 1000.0, 1100.0, 1200.0],
        "lateral_damping": 300.0,
    }
    return Stand(**{**given, **fields})


def crooked_ground(support):
    stand = crooked(support=support)
    return crooked(support=support, ground=stand.ground_points + 0.1 * np.sin(np.arange(12.0)).reshape(4, 3))


STANDS = {
    "hanging": crooked(),
    "guided": crooked(support="guided"),
    "standing": crooked(support="standing"),
    "oblique": crooked_ground("hanging"),
    "oblique guided": crooked_ground("guided"),
}
BODY = Body(mass=15190.0, centre=(0.4, -0.2, 0.15), inertia=TENSOR)


@pytest.mark.parametrize("name", STANDS)
def test_rest_has_no_force_but_the_guides(name):
    stand = STANDS[name]
    pose = equilibrium(stand, BODY)
    F = wrench(stand, BODY, pose.position, pose.rotation)
    x, z, yaw = pose.reaction
    axis = np.cross(pose.rotation[:, 0], [0.0, 0.0, 1.0])
    np.testing.assert_allclose(F + np.array([x, 0, z, *(yaw * axis)]), 0.0, atol=1e-6)
    assert pose.tilt > 1e-3
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
    if stand.support == "guided":
        np.testing.assert_allclose(pose.position[[0, 2]], BODY.centre[[0, 2]], atol=1e-12)
        assert abs(pose.rotation[2, 0]) < 1e-12
    else:
        assert not np.any(pose.reaction)


def displaced(pose, q):
    return pose.position + q[:3], rotation_matrix(q[3:]) @ pose.rotation


def test_force_is_the_gradient_of_the_energy():
    stand = STANDS["oblique"]
    pose = equilibrium(stand, BODY)
    away = np.array([0.02, -0.03, 0.01, 0.05, -0.04, 0.06])
    x, R = displaced(pose, away)
    F = wrench(stand, BODY, x, R)
    for i, step in enumerate(1e-6 * np.eye(6)):
        plus, minus = (energy(stand, BODY, x + s * step[:3], rotation_matrix(s * step[3:]) @ R) for s in (1, -1))
        assert F[i] == pytest.approx(-(plus - minus) / 2e-6, rel=1e-5, abs=0.5)


@pytest.mark.parametrize("name", STANDS)
def test_stiffness_is_the_hessian_of_the_energy_on_the_constraint(name):
    """Along curves that keep the guides: energy of the reduced motion, found by projecting back onto them."""
    stand = STANDS[name]
    model = linear_model(stand, BODY)
    _, _, K = model.reduced()
    f = K.shape[0]

    def potential(s):
        x, R = displaced(model.pose, model.basis @ s)
        if stand.support == "guided":  # turn about the vertical until (R e_x) . Z = 0
            x = np.array([BODY.centre[0], x[1], BODY.centre[2]])
            R = rotation_matrix(np.array([0.0, np.arctan2(R[2, 0], R[0, 0]), 0.0])) @ R
            assert abs(R[2, 0]) < 1e-12
        return energy(stand, BODY, x, R)

    eps = 1e-4
    H = np.empty((f, f))
    for i in range(f):
        for j in range(f):
            a, b = eps * np.eye(f)[i], eps * np.eye(f)[j]
            H[i, j] = (potential(a + b) - potential(a - b) - potential(b - a) + potential(-a - b)) / (4 * eps**2)
    np.testing.assert_allclose(K, H, atol=3e-6 * np.max(np.abs(K)))


def test_linear_model_is_the_derivative_of_the_forces():
    stand = STANDS["oblique"]
    model = linear_model(stand, BODY)
    for i, step in enumerate(1e-6 * np.eye(6)):
        plus, minus = (wrench(stand, BODY, *displaced(model.pose, s * step)) for s in (1, -1))
        np.testing.assert_allclose(-(plus - minus) / 2e-6, model.stiffness[:, i], atol=1e-6 * model.stiffness.max())


def test_damping_is_that_of_the_springs():
    stand = STANDS["hanging"]
    model = linear_model(stand, BODY)
    D = np.zeros((6, 6))
    d = model.pose.position + (stand.points - BODY.centre) @ model.pose.rotation.T - stand.ground_points
    for r, e, c in zip((stand.points - BODY.centre) @ model.pose.rotation.T, d, stand.damping, strict=True):
        e = e / np.linalg.norm(e)
        J = np.array([[*np.eye(3)[i], *np.cross(r, np.eye(3)[i])] for i in range(3)])
        D += J.T @ (c * np.outer(e, e) + 300.0 * np.diag([1.0, 0.0, 1.0])) @ J
    np.testing.assert_allclose(model.damping, D, rtol=1e-9, atol=1e-6)


def test_poles_of_a_damped_stand_satisfy_the_quadratic_eigenproblem():
    model = linear_model(STANDS["hanging"], BODY)
    M, D, K = model.reduced()
    modes = model.modes()
    for w, d in zip(modes.frequency, modes.decay_rate, strict=True):
        s = -d + 1j * w
        A = s * s * M + s * D + K
        scale = np.sqrt(np.diag(M))
        singular = np.linalg.svd(A / np.outer(scale, scale), compute_uv=False)
        assert singular[-1] < 1e-9 * singular[0]
    np.testing.assert_allclose(modes.natural_frequency**2, modes.frequency**2 + modes.decay_rate**2)
    assert np.all(modes.damping_ratio > 0.0)


def test_damping_in_proportion_to_stiffness_keeps_natural_frequencies():
    stand = Stand.rectangle(2.0, 0.87, stiffness=740e3, length=0.5, damping=740.0)
    body = Body(mass=15190.0, centre=(0.3, 0.0, 0.1), inertia=TENSOR)
    modes = vertical_model(stand, body).modes()
    np.testing.assert_allclose(modes.natural_frequency, np.sqrt(modes.eigenvalue), rtol=1e-12)
    np.testing.assert_allclose(modes.decay_rate, 0.5e-3 * modes.eigenvalue, rtol=1e-9)


def test_overdamped_is_refused():
    stand = Stand.rectangle(2.0, 0.87, stiffness=740e3, length=0.5, damping=1e7, support="guided")
    with pytest.raises(InputError, match="damping is too high"):
        linear_model(stand, BODY).modes()


def test_heave_of_one_mass():
    """Centred: M y'' = -sum k y, sag M g / sum k, the springs' tension in the pendulum modes."""
    stand = Stand.rectangle(2.0, 0.8, stiffness=5e4, length=0.7)
    body = Body(mass=1000.0, centre=(0, 0, 0), inertia=(500.0, 900.0, 800.0))
    sag = 1000.0 * 9.80665 / 2e5
    model = linear_model(stand, body)
    assert model.pose.position[1] == pytest.approx(-sag, rel=1e-12)
    w = model.modes().natural_frequency
    lateral = np.sqrt(9.80665 / (0.7 + sag))
    yaw = np.sqrt(1000.0 * 9.80665 / (0.7 + sag) * (2.0**2 + 0.8**2) / 900.0)
    expected = [lateral, lateral, yaw, np.sqrt(2e5 / 1000.0), np.sqrt(2e5 * 0.64 / 500.0), np.sqrt(2e5 * 4.0 / 800.0)]
    np.testing.assert_allclose(w, np.sort(expected), rtol=1e-10)


def test_rest_under_an_extra_force():
    stand = STANDS["hanging"]
    force, point = np.array([3e4, -8e4, 2e4]), np.array([1.9, 0.3, 0.7])
    pose = equilibrium(stand, BODY, force=force, point=point)
    F = wrench(stand, BODY, pose.position, pose.rotation)
    arm = pose.rotation @ (point - BODY.centre)
    np.testing.assert_allclose(F + np.concatenate([force, np.cross(arm, force)]), 0.0, atol=1e-6)


def test_a_small_release_is_linear():
    """Static displacement of the exact stand under a force against K^-1 Q, and against the modes' sum."""
    stand = STANDS["oblique guided"]
    model = linear_model(stand, BODY)
    force, point = np.array([0.0, -10.0, 0.0]), stand.points[0]
    moved = equilibrium(stand, BODY, force=force, point=point)
    modes = model.modes()
    there = modes.amplitude(modes.release(force, point), stand.points).real.sum(axis=0)
    at = lambda p: p.position[1] + ((stand.points - BODY.centre) @ p.rotation.T)[:, 1]  # noqa: E731
    np.testing.assert_allclose(at(moved) - at(model.pose), there, rtol=1e-3)


def test_large_tilt_has_a_rest():
    stand = Stand.rectangle(2.0, 0.87, stiffness=740e3, length=0.5)
    body = Body(mass=15190.0, centre=(1.99, -0.5, 0.8), inertia=TENSOR)
    pose = equilibrium(stand, body)
    assert pose.tilt > 0.02
    assert np.abs(wrench(stand, body, pose.position, pose.rotation)).max() < 1e-6
    soft = Stand.rectangle(2.0, 0.87, stiffness=2e4, length=0.5)
    pose = equilibrium(soft, body)
    assert pose.tilt > 0.3
    assert np.abs(wrench(soft, body, pose.position, pose.rotation)).max() < 1e-5
    linear_model(soft, body).modes()


def test_a_map_is_the_same_as_its_points():
    stand = STANDS["oblique"]
    centres = np.array([[0.0, 0.0, 0.0], [0.4, -0.1, 0.2], [-0.5, 0.1, 0.3]])
    modes = linear_model(stand, Body(mass=15190.0, centre=centres, inertia=TENSOR)).modes()
    z = modes.release((0, -1e4, 0), stand.points[0])
    for i, centre in enumerate(centres):
        one = linear_model(stand, Body(mass=15190.0, centre=centre, inertia=TENSOR)).modes()
        np.testing.assert_allclose(modes.natural_frequency[i], one.natural_frequency, rtol=1e-10)
        np.testing.assert_allclose(
            modes.energy(z)[i], one.energy(one.release((0, -1e4, 0), stand.points[0])), rtol=1e-6
        )


def test_modes_are_orthonormal_and_carry_the_energy():
    model = linear_model(STANDS["hanging"], BODY)
    modes = model.modes()
    np.testing.assert_allclose(modes.shapes.T @ model.mass @ modes.shapes, np.eye(6), atol=1e-10)
    q, v = np.array([0.01, 0.02, -0.01, 0.01, 0.02, -0.01]), np.array([0.1, -0.2, 0.3, 0.1, -0.1, 0.2])
    total = 0.5 * q @ model.stiffness @ q + 0.5 * v @ model.mass @ v
    assert modes.energy(modes.state(q, v)).sum() == pytest.approx(total, rel=1e-10)
    J, point = np.array([10.0, 20.0, -5.0]), np.array([1.0, 0.2, 0.5])
    arm = model.pose.rotation @ (point - BODY.centre)
    v = np.linalg.solve(model.mass, np.concatenate([J, np.cross(arm, J)]))
    np.testing.assert_allclose(modes.impulse(J, point), modes.state(np.zeros(6), v), atol=1e-12)


def test_motion_starts_where_it_was_let_go_and_decays():
    modes = linear_model(STANDS["hanging"], BODY).modes()
    q = np.array([0.01, 0.02, -0.01, 0.01, 0.02, -0.01])
    t = np.array([0.0, 100.0])
    u = modes.motion(t, modes.state(q), STANDS["hanging"].points)
    np.testing.assert_allclose(u[:, 0], modes.model.displacement(STANDS["hanging"].points) @ q, rtol=1e-10)
    assert np.abs(u[:, 1]).max() < 0.2 * np.abs(u[:, 0]).max()


def test_standing_on_pinned_springs_falls_over():
    stand = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, support="standing")
    model = linear_model(stand, BODY)
    with pytest.raises(InputError, match=r"cannot hold the body: it .*slides along.*e-fold in"):
        model.modes()
    modes = model.modes(refuse_unstable=False)
    assert np.isnan(modes.natural_frequency).sum() == 3
    firm = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, support="standing", lateral_stiffness=370e3)
    assert np.all(linear_model(firm, BODY).modes().natural_frequency > 5.0)
    ground = stand.ground_points
    guided = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, support="guided", ground=ground)
    assert len(linear_model(guided, BODY).modes().natural_frequency) == 3


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"stiffness": -1.0}, "stand.stiffness"),
        ({"stiffness": 0.0}, "stand.stiffness"),
        ({"length": [0.5, 0.5]}, "stand.length"),
        ({"support": "hangng"}, "did you mean 'hanging'"),
        ({"points": [[1.0, 2.0]]}, "stand.points"),
        ({"gravity": float("nan")}, "stand.gravity"),
    ],
)
def test_stands_that_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        crooked(**fields)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"mass": 0.0}, "body.mass"),
        ({"inertia": (1.0, 2.0, 4.0)}, "exceeds the sum"),
        ({"inertia": (-1.0, 2.0, 2.0)}, "above 0"),
        ({"inertia": [[1.0, 0.1, 0], [0, 1.0, 0], [0, 0, 1.0]]}, "symmetric"),
        ({"centre": (0.0, 1.0)}, "body.centre"),
    ],
)
def test_bodies_that_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        Body(**{"mass": 1.0, "centre": (0.0, 0.0, 0.0), "inertia": (1.0, 1.0, 1.0), **fields})


def test_springs_that_leave_a_motion_free_have_no_modes():
    stand = Stand(points=[[0.0, 0.0, 0.0]], stiffness=1.0, length=1.0)
    with pytest.raises(InputError, match="a motion without any stiffness"):
        linear_model(stand, Body(mass=1.0, centre=(0, 0, 0), inertia=(1.0, 1.0, 1.0))).modes()


numbers = st.floats(-1.0, 1.0)


def random_stand(u, **fields):
    """A stand and a body from 24 numbers in [-1, 1]."""
    corners = np.array([[2.0, 0, 1], [2, 0, -1], [-2, 0, -1], [-2, 0, 1]]) + 0.2 * np.reshape(u[:12], (4, 3))
    stand = {"points": corners, "stiffness": 1e5 * (1.5 + 0.5 * np.array(u[12:16])), "length": 0.6, **fields}
    A = np.diag([1.0, 1.2, 1.1]) + 0.1 * np.array([[0, u[16], u[17]], [u[16], 0, u[18]], [u[17], u[18], 0]])
    return stand, {"mass": 2000.0, "centre": np.array([0.4 * u[19], 0.2 * u[20], 0.2 * u[21]]), "inertia": 1500.0 * A}


@settings(max_examples=30, deadline=None)
@given(u=st.lists(numbers, min_size=24, max_size=24), angle=st.floats(-3.1, 3.1))
def test_turning_everything_about_the_vertical_keeps_free_frequencies(u, angle):
    stand, body = random_stand(u, lateral_stiffness=2e4)
    R = rotation_matrix(np.array([0.0, angle, 0.0]))
    turned = {**stand, "points": stand["points"] @ R.T}
    moved = {**body, "centre": R @ body["centre"], "inertia": R @ body["inertia"] @ R.T}
    w = linear_model(Stand(**stand), Body(**body)).modes()
    v = linear_model(Stand(**turned), Body(**moved)).modes()
    np.testing.assert_allclose(w.natural_frequency, v.natural_frequency, rtol=1e-9)
    np.testing.assert_allclose(w.model.pose.tilt, v.model.pose.tilt, atol=1e-10)


@settings(max_examples=30, deadline=None)
@given(u=st.lists(numbers, min_size=24, max_size=24), axis=st.sampled_from([0, 2]), guided=st.booleans())
def test_mirroring_everything_keeps_frequencies(u, axis, guided):
    stand, body = random_stand(u, lateral_stiffness=2e4, support="guided" if guided else "hanging")
    S = np.diag([-1.0 if i == axis else 1.0 for i in range(3)])
    mirrored = {**stand, "points": stand["points"] @ S}
    other = {**body, "centre": S @ body["centre"], "inertia": S @ body["inertia"] @ S}
    w = linear_model(Stand(**stand), Body(**body)).modes().natural_frequency
    v = linear_model(Stand(**mirrored), Body(**other)).modes().natural_frequency
    np.testing.assert_allclose(w, v, rtol=1e-9)
