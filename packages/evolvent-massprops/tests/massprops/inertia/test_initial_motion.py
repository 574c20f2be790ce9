"""Starts of a body on springs in full geometry against the linear model, and inertia from the modes of its signals."""

import numpy as np
import pytest

from evolvent_base.errors import InputError
from evolvent_massprops.identification import identify
from evolvent_massprops.inertia import (
    Body,
    Stand,
    displaced,
    from_modes,
    inertia_variables,
    linear_model,
    mode_energies,
    partners,
    released,
    spring_energies,
    struck,
)

TENSOR = np.array([[3703.0, 120.0, 400.0], [120.0, 43000.0, -300.0], [400.0, -300.0, 42000.0]])
BODY = Body(mass=15190.0, centre=(0.4, -0.2, 0.15), inertia=TENSOR)
UP = (0.0, 1.0, 0.0)


def stand(support="hanging"):
    return Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, support=support)


@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_a_small_release_has_the_modal_coordinates_of_its_pose(support):
    modes = linear_model(stand(support), BODY).modes()
    force = (3.0, -10.0, 2.0) if support == "hanging" else (0.0, -10.0, 0.0)
    start = released(stand(support), BODY, modes, force, (2.0, 0.1, 0.8))
    rest = modes.model.pose
    turn = start.rotation @ rest.rotation.T
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    z = modes.state(np.concatenate([start.position - rest.position, vector]))
    assert z == pytest.approx(start.z, abs=1e-4 * np.abs(start.z).max())
    assert not np.any([start.velocity, start.rate])


@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_an_impulse_gives_its_momentum_but_for_the_guides(support):
    """Free: m v = J and I w = r x J. Guided: what is left of J and r x J is along what the guides hold."""
    modes, impulse, point = linear_model(stand(support), BODY).modes(), np.array([30.0, -100.0, 20.0]), (1.5, 0.2, -0.4)
    start, model = struck(modes, impulse, point), modes.model
    r = model.pose.rotation @ (np.array(point) - BODY.centre)
    jump = np.concatenate([start.velocity, start.rate])
    left = model.mass @ jump - np.concatenate([impulse, np.cross(r, impulse)])
    assert model.basis.T @ left == pytest.approx(0.0, abs=1e-9)
    if support == "hanging":
        assert left == pytest.approx(0.0, abs=1e-9)
    else:
        assert start.velocity[[0, 2]] == pytest.approx(0.0, abs=1e-15)
        axis = model.pose.rotation[:, 0]
        assert np.cross(start.rate, axis)[2] == pytest.approx(0.0, abs=1e-15)
    assert modes.state(np.zeros(6), jump) == pytest.approx(start.z, abs=1e-12)


def test_a_guided_start_keeps_the_plane_of_the_guides():
    modes = linear_model(stand("guided"), BODY).modes()
    start = displaced(modes, displacement=(0.0, 0.01, 0.0), rotation=(0.05, 0.0, 0.08), rate=(0.2, 0.0, -0.1))
    assert start.rotation[2, 0] == pytest.approx(0.0, abs=1e-15)
    assert np.cross(start.rate, start.rotation[:, 0])[2] == pytest.approx(0.0, abs=1e-15)
    for given in ({"displacement": (0.1, 0.0, 0.0)}, {"velocity": (0.0, 0.0, 1.0)}, {"rotation": (0.0, 0.1, 0.0)}):
        with pytest.raises(InputError, match="motion along x or z or about y, which support 'guided' holds"):
            displaced(modes, **given)


def test_kinds_and_shares_of_the_modes():
    body = Body(mass=15190.0, centre=(0.0, 0.0, 0.0), inertia=(3703.0, 43920.0, 43920.0))
    modes = linear_model(stand(), body).modes()
    assert modes.shares.sum(axis=0) == pytest.approx(1.0, rel=1e-12)
    assert [modes.kinds[k] for k in modes.vertical] == ["heave", "pitch", "roll"]
    assert sorted(modes.kinds) == ["heave", "pitch", "roll", "sway along x", "sway along z", "yaw"]


# ------------------------------------------------------------------------------------------------ from signals


def signals(given, body, noise=0.0, directions=UP):
    """Modes identified in the linear motion after a release, and the linear modes."""
    modes = linear_model(given, body).modes()
    t = np.arange(600) / 50.0
    z = modes.release((0.0, -9806.65, 0.0), given.points[0])
    clean = modes.motion(t, z, given.points, directions).T
    read = clean + noise * np.random.default_rng(7).standard_normal(clean.shape)
    return identify(read, rate=50.0, order=3), modes, z


@pytest.mark.parametrize("way", ["fit", "three-frequencies", "shapes"])
def test_each_way_finds_the_body_from_its_signals(way):
    body = Body(mass=15190.0, centre=(0.4, 0.0, 0.1), inertia=(3703.0, 43920.0, 43920.0))
    found, _, _ = signals(stand(), body, noise=1e-5)
    inertia = from_modes(stand(), body, found, way=way, points=stand().points)
    limit = 1e-3 if way == "three-frequencies" else 1e-4  # the first leaves the tilt out
    assert inertia["Ixx"] == pytest.approx(3703.0, rel=limit)
    assert inertia["Izz"] == pytest.approx(43920.0, rel=limit)
    assert np.all(np.isfinite(list(inertia.std.values())))
    table = inertia_variables(inertia, {"Ixx": 3.0})
    assert table["inertia_identified"][1][0] == inertia["Ixx"]
    assert table["inertia_std"][1][0] == pytest.approx(np.hypot(inertia.std["Ixx"], 3.0))
    assert np.isnan(table["inertia_identified"][1][1])  # Iyy was taken as known
    assert np.isnan(table["mass_identified"][1]) == (way != "shapes")
    assert all(np.all(np.isnan(values)) for _, values, _, _ in inertia_variables(None).values())


def test_another_number_of_modes_and_other_ways_are_refused():
    found, _, _ = signals(stand(), BODY)
    with pytest.raises(InputError, match="3 modes were identified, but `way` 'six-modes' takes 6; set `order`"):
        from_modes(stand(), BODY, found, way="six-modes", points=stand().points)
    with pytest.raises(InputError, match="way is 'shape'; did you mean 'shapes'"):
        from_modes(stand(), BODY, found, way="shape", points=stand().points)


def test_identified_modes_find_their_partners_and_energies():
    given = stand()
    found, modes, z = signals(given, BODY)
    pairs = partners(found.frequency, found.mode_shapes().real, modes, given.points)
    assert modes.frequency[list(pairs.values())] == pytest.approx(found.frequency[list(pairs)], rel=1e-3)
    assert sorted(pairs.values()) == modes.vertical.tolist()
    assert partners(1.1 * found.frequency, found.mode_shapes().real, modes, given.points, within=0.01) == {}
    energy, std = mode_energies(given, modes, found, pairs, given.points, UP)
    assert energy == pytest.approx(spring_energies(given.stiffness, found.amplitude), rel=1e-12)
    assert energy == pytest.approx(modes.energy(z)[list(pairs.values())], rel=0.02)  # without gravity's part
    inner = 0.5 * given.points  # other places: by the modal coordinate
    seen = identify(modes.motion(np.arange(600) / 50.0, z, inner).T, rate=50.0, order=3)
    own, _ = mode_energies(given, modes, seen, pairs, inner, UP)
    assert own == pytest.approx(modes.energy(z)[list(pairs.values())], rel=1e-3)
    none, _ = mode_energies(given, modes, found, {0: pairs[0]}, given.points, UP)
    assert np.isnan(none).tolist() == [False, True, True]
    assert np.all(std[np.isfinite(std)] >= 0.0)
