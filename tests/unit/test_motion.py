"""Motions: changes of axes and times, scales of colours and arrows, units."""

import dataclasses

import numpy as np
import pytest

from evolvent.results.motion import Forces, Frame, Line, Marks, Motion, name_and_unit, quantity
from evolvent.results.rotations import (
    about_z,
    conjugate,
    from_rotation_vectors,
    product,
    rotation_vectors,
    turned,
    turns_between,
)
from many_bodies import many_bodies


def lines_of(values, label="tension [N]"):
    values = np.asarray(values, dtype=float)
    points = np.zeros((*values.shape, 3))
    return Motion(title="t", time=np.arange(len(values)), lines=[Line(name="a", points=points, values={label: values})])


def test_body_axes_and_back():
    motion = many_bodies(9, drift=3.0)
    body = motion.body
    seen = motion.in_body()
    assert body.name == "bus"
    assert np.abs(seen.body.origin).max() < 1e-12
    back = seen.carried(body.origin, body.attitude)
    for one, other in zip(motion.lines, back.lines, strict=True):
        assert one.points == pytest.approx(other.points, abs=1e-12)
    for one, other in zip(motion.frames, back.frames, strict=True):
        assert one.origin == pytest.approx(other.origin, abs=1e-12)
        assert rotation_vectors(product(conjugate(one.attitude), other.attitude)) == pytest.approx(0.0, abs=1e-7)
    assert back.lines[0].across == pytest.approx(motion.lines[0].across, abs=1e-12)
    assert back.forces[0].vectors == pytest.approx(motion.forces[0].vectors, abs=1e-12)
    assert back.marks[0].points == pytest.approx(motion.marks[0].points, abs=1e-12)
    assert seen.reach == pytest.approx(motion.reach)


def test_other_axes_may_be_the_body_axes():
    motion = dataclasses.replace(many_bodies(5), main="panel")
    seen = motion.in_body()
    assert np.abs(seen.frames[1].origin).max() < 1e-12
    assert np.ptp(seen.lines[0].points[:, -1], axis=0) == pytest.approx(0.0, abs=1e-12)  # the boom's tip is held
    with pytest.raises(ValueError, match="main is 'wing'"):
        dataclasses.replace(motion, main="wing")


def test_without_bodies_there_are_no_body_axes():
    motion = lines_of([[1.0, 2.0], [3.0, 4.0]])
    assert motion.body is None
    assert motion.in_body() is motion
    assert motion.resampled(np.array([0.5])).lines[0].values["tension [N]"] == pytest.approx(np.array([[2.0, 3.0]]))


def test_between_samples_a_spinning_craft_keeps_its_size():
    """Between samples a radian apart points go round a circle; straight lines between them would cut it short."""
    time = np.arange(5.0)
    attitude = about_z(time)
    arm = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    points = turned(attitude, np.broadcast_to(arm, (5, 2, 3)))
    motion = Motion(
        title="t",
        time=time,
        frames=[Frame(name="b", origin=np.zeros((5, 3)), attitude=attitude)],
        lines=[Line(name="arm", points=points)],
        numbers={"n": np.array([0.0, np.nan, 2.0, 3.0, 4.0])},
    )
    between = motion.resampled(np.array([0.25, 2.5, 4.0]))
    angle = np.array([0.25, 2.5, 4.0])
    wanted = np.stack([2.0 * np.cos(angle), 2.0 * np.sin(angle), 0.0 * angle], axis=1)
    assert between.lines[0].points[:, 1] == pytest.approx(wanted, abs=1e-12)
    assert np.isnan(between.numbers["n"][0])
    assert between.numbers["n"][1:] == pytest.approx([2.5, 4.0])


def test_whole_turns_between_kept_samples_are_counted():
    angle = np.linspace(0.0, 40.0, 401)
    axis = np.array([0.6, 0.0, 0.8])
    attitude = from_rotation_vectors(angle[:, None] * axis)
    for kept in (np.arange(0, 401, 100), np.array([0, 63, 126, 400])):
        turns = turns_between(attitude, kept)
        assert turns[:-1] == pytest.approx(np.diff(angle[kept])[:, None] * axis, abs=1e-6)
        assert not turns[-1].any()
    backwards = turns_between(attitude[::-1], np.array([0, 400]))
    assert backwards[0] == pytest.approx(-40.0 * axis, abs=1e-6)


def test_small_motions_are_enlarged_about_their_mean():
    time = np.linspace(0.0, 1.0, 201)
    swing = 1e-3 * np.sin(2.0 * np.pi * time)
    vectors = np.stack([0.0 * swing, swing, 0.0 * swing], axis=1)
    attitude = product(np.tile([0.6, 0.8, 0.0, 0.0], (201, 1)), from_rotation_vectors(vectors))
    origin = np.array([1.0, 2.0, 3.0]) + vectors
    motion = Motion(
        title="stand",
        time=time,
        frames=[Frame(name="b", origin=origin, attitude=attitude)],
        lines=[Line(name="l", points=origin[:, None] + np.zeros((201, 2, 3)))],
        magnification=50.0,
    )
    shown = motion.magnified()
    assert shown.title == "stand (displacements enlarged 50 times)"
    assert shown.frames[0].origin[:, 1] == pytest.approx(2.0 + 50.0 * swing, abs=1e-12)
    assert shown.lines[0].points[:, 0, 1] == pytest.approx(2.0 + 50.0 * swing, abs=1e-12)
    turn = rotation_vectors(product(conjugate(np.tile([0.6, 0.8, 0.0, 0.0], (201, 1))), shown.frames[0].attitude))
    assert turn == pytest.approx(50.0 * vectors, abs=1e-9)
    assert shown.magnified() is shown


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        ([[1.0, 2.0], [3.0, np.nan]], (0.0, 3.0)),
        ([[30.0, 44.0], [35.0, 40.0]], (30.0, 44.0)),
        ([[-5.0, 2.0], [3.0, 0.0]], (-5.0, 3.0)),
        ([[-5.0, -2.0], [-1.0, -1.0]], (-5.0, 0.0)),
        ([[-1e-9, 2.0], [3.0, 0.0]], (0.0, 3.0)),
        ([[np.nan, np.nan], [np.nan, np.nan]], (0.0, 1.0)),
        ([[0.0, 0.0], [0.0, 0.0]], (0.0, 1.0)),
    ],
)
def test_ends_of_the_colour_scale(values, wanted):
    assert lines_of(values).value_range("tension [N]") == pytest.approx(wanted, rel=0.02, abs=1e-6)


def test_a_single_peak_does_not_set_the_colours():
    values = np.ones((100, 100))
    values[50, 50] = 1e6
    assert lines_of(values).value_range("tension [N]") == (0.0, 1.0)
    assert lines_of(values).clipped("tension [N]") == (False, True)
    assert lines_of(-values).clipped("tension [N]") == (True, False)
    assert lines_of(np.minimum(values, 1.0)).clipped("tension [N]") == (False, False)
    assert lines_of(np.linspace(0.0, 1.0, 10_000).reshape(100, 100)).clipped("tension [N]") == (False, False)


def test_the_usual_largest_force_is_a_fifth_of_the_reach():
    vectors = np.zeros((100, 2, 3))
    vectors[:, 0, 0], vectors[50, 1, 1] = 3.0, 1e5
    points = np.broadcast_to([[5.0, 0, 0], [0.0, 0.0, 0.0]], (100, 2, 3))
    frame = Frame(name="b", origin=np.zeros((100, 3)), attitude=about_z(np.zeros(100)))
    motion = Motion(
        title="t",
        time=np.arange(100.0),
        frames=[frame],
        forces=[Forces(name="f", points=points, vectors=vectors)],
        marks=[Marks(name="m", points=points)],
    )
    assert motion.reach == 5.0
    assert 3.0 * motion.arrow_scale("N") == pytest.approx(1.0)
    assert motion.arrow_scale("N m") == 0.0
    of_nothing = dataclasses.replace(motion, forces=[Forces(name="f", points=points, vectors=1e-30 * vectors)])
    assert of_nothing.arrow_scale("N") == 0.0


def test_units():
    assert name_and_unit("tip speed [m/s]") == ("tip speed", "m/s")
    assert name_and_unit("strain") == ("strain", "")
    assert name_and_unit("curvature [m-1]") == ("curvature", "1/m")
    assert name_and_unit("angular momentum [kg m2 s-1]") == ("angular momentum", "kg m²/s")
    shown = [quantity(x, "N") for x in (0.0, 0.0021, 12.34, 44321.0, -3e-7)]
    assert shown == ["0 N", "2.1 mN", "12.3 N", "44.3 kN", "-300 nN"]
    assert quantity(0.0021, "m/s") == "0.0021 m/s"
    assert quantity(0.5, "") == "0.5"


def test_shapes_that_do_not_fit_are_refused():
    points = np.zeros((3, 2, 3))
    with pytest.raises(ValueError, match="line 'a': 'x' has shape"):
        Line(name="a", points=points, values={"x": np.zeros((3, 3))})
    with pytest.raises(ValueError, match="line 'a': points have shape"):
        Line(name="a", points=points[:, :1])
    with pytest.raises(ValueError, match="a strip needs a width"):
        Line(name="a", points=points, across=points)
    with pytest.raises(ValueError, match="'a' has 3 samples, and the motion has 4"):
        Motion(title="t", time=np.zeros(4), lines=[Line(name="a", points=points)])
