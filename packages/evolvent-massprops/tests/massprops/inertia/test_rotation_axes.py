"""Axes of rotation of the modes and partial frequencies, against closed forms."""

import numpy as np
import pytest

import evolvent
from evolvent_massprops.inertia import Body, Stand, linear_model, partial_frequencies, vertical_model

A, B, K, MASS, IXX, IZZ = 2.0, 0.8696, 740250.0, 15190.0, 3703.0, 43920.0


def stand(stiffness=K, **fields):
    return Stand.rectangle(A, B, stiffness=stiffness, length=0.5, **fields)


def body(ex=0.0, ez=0.0):
    return Body(mass=MASS, centre=[ex, 0.0, ez], inertia=(IXX, IZZ, IZZ))


@pytest.mark.parametrize("stiffness", [K, K / 100.0, 10.0 * K])
def test_axes_lie_beyond_the_centre_of_mass_whatever_the_stiffness(stiffness, book):
    """To first order by ex / (M a^2 / Izz - 1) and ez / (M b^2 / Ixx - 1); the paper has them on the other side."""
    e = 1e-4
    pitch = vertical_model(stand(stiffness), body(ex=e)).modes().axes()[0][1]
    roll = vertical_model(stand(stiffness), body(ez=e)).modes().axes()[0][2]
    found = np.array([pitch[0] - e, roll[2] - e]) / e
    expected = np.array([1.0 / (MASS * A**2 / IZZ - 1.0), 1.0 / (MASS * B**2 / IXX - 1.0)])
    np.testing.assert_allclose(expected, [2.61, 0.475], atol=0.01)
    book(
        "Inertia stand and identification", f"Stand, axes of pitch and roll, k = {stiffness:g} N/m",
        reference="ex/(M a^2/Izz - 1), ez/(M b^2/Ixx - 1)", source="closed form to first order",
        error=np.abs(found / expected - 1.0).max(), allowed=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize("ex", [0.4, -0.8])
def test_distances_of_the_two_axes_from_the_centre_of_mass(ex):
    """Modes are orthogonal: of heave and pitch, the product of the distances is - Izz / M at any offset."""
    points, directions = vertical_model(stand(), body(ex)).modes().axes()
    heave, pitch = points[:2, 0] - ex
    assert heave * pitch == pytest.approx(-IZZ / MASS, rel=1e-9)
    assert pitch * ex > 0.0
    np.testing.assert_allclose(directions, [[0, 0, 1], [0, 0, 1], [1, 0, 0]], atol=1e-9)


def test_a_body_does_not_move_on_the_axis():
    modes = linear_model(stand(), body(0.4, 0.17)).modes()
    points, directions = modes.axes()
    for shape, point, direction in zip(modes.shapes.T, points, directions, strict=True):
        arm = modes.model.pose.rotation @ (point - modes.model.centre)
        moved = shape[:3] + np.cross(shape[3:], arm)
        along = modes.model.pose.rotation @ direction
        assert np.abs(np.cross(moved, along)).max() < 1e-9 * np.abs(shape[:3]).max()


def test_a_translation_has_no_axis():
    points, directions = vertical_model(stand(), body()).modes().axes()
    assert np.isnan(points[0]).all()
    assert np.isnan(directions[0]).all()
    assert points[1:] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_the_results_hold_axes_and_partial_frequencies(book):
    changes = {"body.offset_x": 0.4, "sensors.duration": "4 s", "identification.order": 3}
    run = evolvent.run("inertia-stand", changes)
    pitch = list(run.linear_kind.values).index("pitch")
    point = run.linear_axis_point.values[pitch]
    assert point == pytest.approx([1.139, 0.0, 0.0], abs=0.005)
    assert run.linear_axis_direction.values[pitch] == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    assert "nearest to the centre of mass" in run.linear_axis_point.attrs["long_name"]
    expected = [np.sqrt(4 * K / MASS), np.sqrt(4 * K * B**2 / IXX), np.sqrt(4 * K * A**2 / IZZ)]
    assert list(run.partial_motion.values) == ["heave", "roll", "pitch"]
    book(
        "Inertia stand and identification", "Stand, partial frequencies of heave, roll and pitch",
        reference="sqrt(4k/M), sqrt(4k b^2/Ixx), sqrt(4k a^2/Izz)", source="closed form",
        error=np.abs(run.partial_frequency.values / expected - 1.0).max(), allowed=1e-12,
    )  # fmt: skip


def test_partial_frequencies_of_unequal_springs():
    """They are about the springs' own centre, where a rotation needs no force."""
    uneven = Stand(points=stand().points, stiffness=K * np.array([1.0, 1.0, 0.5, 0.5]), length=0.5)
    found = partial_frequencies(uneven, body(0.3))
    centre = 2.0 * (2.0 - 1.0) / 3.0
    about = K * (2.0 * (2.0 - centre) ** 2 + 1.0 * (2.0 + centre) ** 2)
    np.testing.assert_allclose(found, [np.sqrt(3 * K / MASS), np.sqrt(3 * K * B**2 / IXX), np.sqrt(about / IZZ)])
    many = partial_frequencies(stand(stiffness=np.full((5, 4), K)), body())
    assert many.shape == (5, 3)
