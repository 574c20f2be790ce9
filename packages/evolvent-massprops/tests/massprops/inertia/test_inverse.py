"""The four ways from modes to inertia, there and back, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from evolvent_base.errors import InputError
from evolvent_massprops.inertia import (
    Body,
    Stand,
    candidates,
    equilibrium,
    fit,
    from_shapes,
    from_six_modes,
    from_three_frequencies,
    linear_model,
    vertical_model,
)
from evolvent_massprops.inertia.linear_equations import properties, regressor
from evolvent_massprops.inertia.problem import BODY_NAMES, assign, value_of
from evolvent_massprops.inertia.stand import setup

TENSOR = np.array([[3703.0, 120.0, 400.0], [120.0, 43000.0, -300.0], [400.0, -300.0, 42000.0]])
STAND = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5)
P = STAND.points
BODY = Body(mass=15190.0, centre=(0.4, -0.05, 0.2), inertia=TENSOR)
NOMINAL = Body(mass=15000.0, centre=(0.0, 0.0, 0.0), inertia=(3600.0, 43500.0, 43920.0))
TRUE = {
    "mass": 15190.0, "ex": 0.4, "h": 0.05, "ez": 0.2,
    "Ixx": 3703.0, "Iyy": 43000.0, "Izz": 42000.0, "Ixy": 120.0, "Ixz": 400.0, "Iyz": -300.0,
}  # fmt: skip
SIX_POINTS, SIX_DIRECTIONS = np.concatenate([P] * 3), np.repeat(np.eye(3), 4, axis=0)


def close(found, names, rel):
    for name in names:
        assert found[name] == pytest.approx(TRUE[name], rel=rel), name


# ------------------------------------------------------------------------------------------- three frequencies


@pytest.mark.parametrize("at", [(0.0, 0.0), (0.4, 0.0), (0.0, 0.2), (0.4, 0.17392), (0.8, 0.348), (-0.3, 0.13)])
@pytest.mark.parametrize("Ixz", [0.0, 439.2, -439.2])
def test_three_frequencies_there_and_back(at, Ixz, book):
    """Also where ex / a = ez / b, where the polynomial degenerates to a double one."""
    tensor = np.diag([3703.0, 43920.0, 43920.0])
    tensor[0, 2] = tensor[2, 0] = Ixz
    body = Body(mass=15190.0, centre=(at[0], 0.0, at[1]), inertia=tensor)
    modes = vertical_model(STAND, body).modes()
    found = from_three_frequencies(STAND, body, modes.natural_frequency, shapes=modes.at(P), points=P)
    assert found["Ixx"] == pytest.approx(3703.0, rel=1e-9)
    assert found["Izz"] == pytest.approx(43920.0, rel=1e-9)
    assert found["stiffness"] == pytest.approx(740250.0, rel=1e-9)
    assert found.candidates[0].mac == pytest.approx(1.0, abs=1e-9)
    assert found.candidates[1].mac < 0.9
    assert "Iyy" in found.assumed
    assert "Ixx" not in found.assumed
    if Ixz > 0.0:
        book(
            "Inertia stand and identification", f"Moments from three frequencies, offset {at}, Ixz {Ixz:g}",
            reference="Ixx, Izz put in", source="there and back",
            error=max(abs(found["Ixx"] / 3703.0 - 1.0), abs(found["Izz"] / 43920.0 - 1.0)), allowed=1e-9,
        )  # fmt: skip


def test_every_candidate_gives_the_frequencies():
    modes = vertical_model(STAND, BODY).modes()
    found = candidates(STAND, BODY, modes.natural_frequency, shapes=modes.at(P), points=P)
    assert len(found) == 6
    for c in found:
        s = setup(STAND, BODY)
        s = assign(s, ("stiffness", "Ixx", "Izz"), np.array([c.stiffness, c.Ixx, c.Izz]))
        from evolvent_massprops.inertia.vibration import level

        np.testing.assert_allclose(level(s).modes().natural_frequency, modes.natural_frequency, rtol=1e-9)


def test_shapes_and_not_nearness_tell_the_candidate():
    """Another candidate's stiffness is within 2 % of the true one."""
    modes = vertical_model(STAND, BODY).modes()
    found = candidates(STAND, BODY, modes.natural_frequency, shapes=modes.at(P), points=P)
    near = [c for c in found[1:] if abs(c.stiffness / 740250.0 - 1) < 0.02]
    assert near
    assert near[0].mac < 0.1
    order = [2, 0, 1]  # modes may come in any order
    again = candidates(STAND, BODY, modes.natural_frequency[order], shapes=modes.at(P)[order], points=P)
    assert again[0].Ixx == pytest.approx(3703.0, rel=1e-9)
    with pytest.raises(InputError, match="give the mode shapes"):
        from_three_frequencies(STAND, BODY, modes.natural_frequency)


def test_three_frequencies_with_unequal_springs(book):
    stand = Stand(
        points=[[2.0, 0, 0.9], [1.9, 0, -0.8], [-2.1, 0, -0.9], [-1.8, 0, 0.85], [0.1, 0, 0.5]],
        stiffness=[7e5, 8e5, 7.5e5, 6e5, 1e5],
        length=0.5,
    )
    modes = vertical_model(stand, BODY).modes()
    found = from_three_frequencies(stand, BODY, modes.natural_frequency, shapes=modes.at(P), points=P)
    close(found, ("Ixx", "Izz"), 1e-9)
    book(
        "Inertia stand and identification", "Moments from three frequencies, five unequal springs",
        reference="Ixx, Izz put in", source="there and back",
        error=max(abs(found[name] / TRUE[name] - 1.0) for name in ("Ixx", "Izz")), allowed=1e-9,
    )  # fmt: skip


def test_frequencies_that_no_body_has():
    with pytest.raises(InputError, match="no body with this mass"):
        from_three_frequencies(STAND, BODY, [10.0, 10.001, 10.002], shapes=np.eye(3, 4), points=P)
    with pytest.raises(InputError, match="different"):
        candidates(STAND, BODY, [10.0, 10.0, 11.0])


# -------------------------------------------------------------------------------------------------------- shapes


@pytest.mark.parametrize(
    "points", [P, P[:3], np.array([[1.0, 0, 0.3], [-1.5, 0, 0.2], [0.5, 0, -0.9], [0, 0, 2], [2, 0, 1]])]
)
def test_shapes_there_and_back(points):
    modes = vertical_model(STAND, BODY).modes()
    scale = np.array([[2.0], [-0.3], [1e-3]])
    found = from_shapes(STAND, NOMINAL, modes.natural_frequency, shapes=scale * modes.at(points), points=points)
    close(found, ("mass", "ex", "ez", "Ixx", "Izz", "Ixz"), 1e-8)
    assert found.assumed == ("h", "Iyy", "Ixy", "Iyz")


def test_shapes_at_the_tilted_rest():
    modes = linear_model(STAND, BODY).modes()
    start = Body(mass=15000.0, centre=(0.3, -0.05, 0.1), inertia=[[3600, 120, 0], [120, 43000, -300], [0, -300, 43920]])
    found = from_shapes(STAND, start, modes.natural_frequency[3:], shapes=modes.at(P)[3:], points=P, model="full")
    close(found, ("mass", "ex", "ez", "Ixx", "Izz", "Ixz"), 1e-6)


def test_too_few_sensors():
    modes = vertical_model(STAND, BODY).modes()
    line = P[:2] * [[1.0], [0.5]]
    with pytest.raises(InputError, match="sensors do not show"):
        from_shapes(STAND, NOMINAL, modes.natural_frequency, shapes=modes.at(line), points=line)


@pytest.mark.slow
def test_noise_falls_to_what_covariance_tells():
    """1 % noise (of the rms) on four sensors, 12 s at 50 Hz: the amplitudes' and frequencies' own bounds."""
    body = Body(mass=15190.0, centre=(0.4, 0.0, 0.1), inertia=(3703.0, 43920.0, 43920.0))
    modes = vertical_model(STAND, body).modes()
    A = modes.amplitude(modes.release((0, -9806.65, 0), P[0]), P).real
    n, T = 600, 0.02
    sigma = 0.01 * np.sqrt(np.sum(A**2, axis=0) / 2).max()
    C = np.diag(24 * sigma**2 / (np.sum(A**2, axis=1) * T**2 * n**3))
    S = np.broadcast_to(np.eye(4) * 2 * sigma**2 / n, (3, 4, 4))
    found = from_shapes(
        STAND, body, modes.natural_frequency, shapes=A, points=P, frequency_covariance=C, shape_covariance=S
    )
    std = found.std
    assert 100 * std["mass"] / 15190.0 < 0.02
    assert max(std["ex"], std["ez"]) < 0.3e-3
    assert 100 * std["Ixx"] / 3703.0 < 0.015
    assert 100 * max(std["Izz"], std["Ixz"]) / 43920.0 < 0.015
    random = np.random.default_rng(5)
    trials = []
    for _ in range(60):
        noisy = A + np.sqrt(2 / n) * sigma * random.standard_normal(A.shape)
        f = random.multivariate_normal(modes.natural_frequency, C)
        r = from_shapes(STAND, body, f, shapes=noisy, points=P, frequency_covariance=C, shape_covariance=S)
        trials.append([r[name] for name in r.identified])
    np.testing.assert_allclose(np.std(trials, axis=0), np.sqrt(np.diag(found.covariance)), rtol=0.3)


# ------------------------------------------------------------------------------------------------------ six modes


@pytest.mark.parametrize("refine", [False, True])
def test_six_modes_there_and_back(refine):
    modes = linear_model(STAND, BODY).modes()
    shapes = modes.at(SIX_POINTS, SIX_DIRECTIONS)
    given = {"points": SIX_POINTS, "directions": SIX_DIRECTIONS, "refine": refine}
    found = from_six_modes(STAND, NOMINAL, modes.natural_frequency, shapes=shapes, **given)
    close(found, BODY_NAMES, 1e-6)
    assert found.assumed == ()
    np.testing.assert_allclose(found.tensor, TENSOR, rtol=1e-6)
    np.testing.assert_allclose(found.centre, BODY.centre, rtol=1e-6)
    posed = from_six_modes(
        STAND, NOMINAL, modes.natural_frequency, shapes=shapes, pose=equilibrium(STAND, BODY), **given
    )
    close(posed, BODY_NAMES, 1e-6)


def test_six_modes_with_noise():
    """0.2 % noise on 600 samples: all of the tensor to some 0.02 % of the largest moment."""
    modes = linear_model(STAND, BODY).modes()
    shapes = modes.at(SIX_POINTS, SIX_DIRECTIONS)
    level = 0.002 * np.sqrt(2 / 600) * np.abs(shapes).max(axis=1)
    random = np.random.default_rng(3)
    found = from_six_modes(
        STAND,
        NOMINAL,
        modes.natural_frequency * (1 + 1e-6 * random.standard_normal(6)),
        shapes=shapes + level[:, None] * random.standard_normal(shapes.shape),
        points=SIX_POINTS,
        directions=SIX_DIRECTIONS,
        frequency_covariance=np.diag((1e-6 * modes.natural_frequency) ** 2),
        shape_covariance=level[:, None, None] ** 2 * np.eye(12),
    )
    np.testing.assert_allclose(found.tensor, TENSOR, atol=2e-4 * 43000.0)
    assert found["mass"] == pytest.approx(15190.0, rel=1e-4)
    for name in BODY_NAMES:
        assert abs(found[name] - TRUE[name]) < 4 * found.std[name]
    assert 0.5 < found.misfit < 1.5


def test_six_modes_need_freedom_and_sensors():
    modes = linear_model(STAND, BODY).modes()
    with pytest.raises(InputError, match="sensors do not show"):
        from_six_modes(STAND, NOMINAL, modes.natural_frequency, shapes=modes.at(P), points=P, directions=[0, 1, 0])
    guided = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, support="guided")
    with pytest.raises(InputError, match="this model has 3 modes"):
        from_six_modes(guided, NOMINAL, modes.natural_frequency, shapes=modes.at(P), points=P, directions=[0, 1, 0])


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(u=st.lists(st.floats(-1.0, 1.0), min_size=16, max_size=16))
def test_regressor_is_linear_in_the_ten_numbers(u):
    from evolvent_massprops.inertia.statics import rotation_matrix, skew

    c, R = np.array(u[:3]), rotation_matrix(np.array(u[3:6]))
    phi = np.array(u[6:12])
    tensor = np.eye(3) + 0.2 * np.array([[0, u[12], u[13]], [u[12], 0, u[14]], [u[13], u[14], 0]])
    mass = 2.0 + u[15]
    S = skew(R @ c)
    M = np.block([[mass * np.eye(3), -mass * S], [mass * S, R @ tensor @ R.T - mass * S @ S]])
    about = tensor + mass * (c @ c * np.eye(3) - np.outer(c, c))
    p = np.array([mass, *(mass * c), *(about[ij] for ij in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))])
    np.testing.assert_allclose(regressor(phi, R) @ p, M @ phi, atol=1e-12)
    found = properties(p)
    np.testing.assert_allclose([found["ex"], -found["h"], found["ez"]], c, atol=1e-12)
    assert found["Ixz"] == pytest.approx(tensor[0, 2], abs=1e-12)


# --------------------------------------------------------------------------------------------------- least squares


def modes_seen(stand=STAND):
    modes = linear_model(stand, BODY).modes()
    return modes.natural_frequency[-3:], modes.at(P)[-3:]


@pytest.mark.parametrize(
    "unknown",
    [
        ("stiffness", "Ixx", "Izz"),
        ("mass", "Ixx", "Izz"),
        ("mass", "ex", "ez", "Ixx", "Izz", "Ixz"),
        ("stiffness", "ex", "ez", "Ixx", "Izz", "Ixz"),
        ("ex", "ez", "Ixx", "Izz", "k1", "k2", "k3", "k4"),
        ("Ixx", "Izz", "b"),
    ],
)
@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_least_squares_there_and_back(unknown, support):
    stand = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, support=support)
    frequency, shapes = modes_seen(stand)
    s = setup(stand, BODY)
    off = {n: 1.03 * float(value_of(s, n)) for n in unknown if n in ("mass", "ex", "ez", "Ixx", "Izz", "Ixz")}
    near = assign(s, tuple(off), np.array(list(off.values())))
    start = Body(mass=float(near.mass), centre=near.centre, inertia=near.inertia)
    found = fit(stand, start, unknown, frequency, shapes=shapes, points=P)
    for name in unknown:
        assert found[name] == pytest.approx(float(value_of(s, name)), rel=1e-5), name


@pytest.mark.slow
def test_a_known_force_distinguishes_mass_and_stiffness():
    """Without it they change together."""
    body = Body(mass=15190.0, centre=(0.4, 0.0, 0.1), inertia=(3703.0, 43920.0, 43920.0))
    modes = vertical_model(STAND, body).modes()
    force = ((0.0, -9806.65, 0.0), P[0])
    A = modes.amplitude(modes.release(*force), P).real
    unknown = ("mass", "stiffness", "ex", "ez", "Ixx", "Izz", "Ixz")
    start = Body(mass=15000.0, centre=(0.35, 0.0, 0.08), inertia=(3600.0, 43920.0, 43000.0))
    given = {"shapes": A, "points": P, "model": "vertical"}
    with pytest.raises(InputError, match=r"stiffness.* are not distinguished"):
        fit(STAND, start, unknown, modes.natural_frequency, **given)
    found = fit(STAND, start, unknown, modes.natural_frequency, release=force, **given)
    assert found["mass"] == pytest.approx(15190.0, rel=1e-7)
    assert found["stiffness"] == pytest.approx(740250.0, rel=1e-7)
    weighed = fit(STAND, start, unknown, modes.natural_frequency, prior={"mass": (15190.0, 1.5)}, **given)
    assert weighed["stiffness"] == pytest.approx(740250.0, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("unknown", "message"),
    [
        (("Ixx", "Izz", "Iyy"), "Iyy does not show in the data"),
        (("Ixx", "Izz", "Ixy", "Iyz", "Iyy"), "Ixy"),
        (("Ixx", "Izz", "k1", "stiffness", "k2", "k3", "k4"), "not distinguished"),
        (("Ixx", "Ixy2"), "unknown names 'Ixy2'"),
        (("Ixx", "Ixx"), "twice"),
        ((), "name what is to be identified"),
    ],
)
def test_unknowns_that_data_cannot_tell(unknown, message):
    frequency, shapes = modes_seen()
    with pytest.raises(InputError, match=message):
        fit(STAND, BODY, unknown, frequency, shapes=shapes, points=P)


def test_more_unknowns_than_data():
    with pytest.raises(InputError, match="the data do not determine the unknowns"):
        fit(STAND, BODY, ("mass", "Ixx", "Izz", "ex", "ez"), modes_seen()[0], model="vertical")


def test_no_impossible_body_is_returned():
    """Heave far too low for pitch and roll: the moments that follow break the triangle inequality."""
    modes = vertical_model(STAND, BODY).modes()
    bad = modes.natural_frequency * [1.0, 1.6, 1.0]
    with pytest.raises(InputError, match=r"no body (has|that)|no body with|no body"):
        from_three_frequencies(STAND, BODY, np.sort(bad), shapes=modes.at(P)[[0, 2, 1]], points=P)
    thin = Body(mass=15190.0, centre=(0.0, 0.0, 0.0), inertia=(3703.0, 43920.0, 41000.0))
    w = vertical_model(STAND, thin).modes()
    flat = Body(mass=15190.0, centre=(0.0, 0.0, 0.0), inertia=(3703.0, 40000.0, 41000.0))
    changed = w.natural_frequency * [1.0, 1.0, 1.0]
    changed[np.argmax(np.abs(w.shapes[5]))] *= 0.95  # pitch: Izz 11 % up, above Ixx + Iyy
    with pytest.raises(InputError, match="exceeds the sum"):
        from_three_frequencies(STAND, flat, changed, shapes=w.at(P), points=P)


def test_shapes_from_identified_modes_keep_symmetry():
    """The mirrored body gives the mirrored result."""
    modes = vertical_model(STAND, BODY).modes()
    found = from_shapes(STAND, NOMINAL, modes.natural_frequency, shapes=modes.at(P), points=P)
    mirrored = from_shapes(STAND, NOMINAL, modes.natural_frequency, shapes=modes.at(P), points=P * [-1.0, 1.0, 1.0])
    for name in found.identified:
        sign = -1.0 if name in ("ex", "Ixz") else 1.0
        assert mirrored[name] == pytest.approx(sign * found[name], rel=1e-8)
