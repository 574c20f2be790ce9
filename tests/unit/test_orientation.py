"""Orientations as a turn about an axis and as Euler angles, against SciPy's rotations."""

from __future__ import annotations

import copy
import itertools
import json
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import evolvent
from evolvent import InputError, cases, parts
from evolvent_base import schema
from evolvent_base.units.orientation import ORDERS, quaternion_about, quaternion_of_euler

ANGLES = (0.4, -1.1, 2.3)


def matrix(q):
    """Rotation matrix (3, 3) of a quaternion, scalar part first."""
    return Rotation.from_quat(np.array(q), scalar_first=True).as_matrix()


@pytest.mark.parametrize("order", [*ORDERS, *(order.upper() for order in ORDERS)])
def test_euler_angles_are_those_of_scipy(order):
    """Small letters are fixed axes, capital letters turned ones, in all twelve orders."""
    expected = Rotation.from_euler(order, ANGLES).as_matrix()
    assert np.allclose(matrix(quaternion_of_euler(ANGLES, order)), expected, rtol=0.0, atol=1e-14)


def test_extrinsic_and_intrinsic_differ_as_stated():
    """90 deg about x, then about z: y goes to z, which the fixed z leaves, and the turned z takes y to -x."""
    quarter = np.pi / 2.0
    fixed, turned = (matrix(quaternion_of_euler((quarter, quarter, 0.0), order)) for order in ("xzx", "XZX"))
    assert np.allclose(fixed @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], atol=1e-15)
    assert np.allclose(turned @ [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], atol=1e-15)


def test_axes_of_any_length():
    """A turn about an axis is that of the rotation vector."""
    axis, angle = np.array([1.0, -2.0, 0.5]), 2.1
    expected = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    assert np.allclose(matrix(quaternion_about(axis, angle)), expected, rtol=0.0, atol=1e-14)
    assert len(ORDERS) == 12 == sum(a != b != c for a, b, c in itertools.product("xyz", repeat=3))


def body(orientation):
    """A free body with an orientation."""
    return parts.RigidBody(mass=1.0, inertia=1.0, orientation=orientation)


def test_the_form_is_kept_and_written_back():
    """The value is a quaternion; copies, dumps and cases hold the form that was given."""
    one = body({"axis": [0, 0, 1], "angle": "90 deg"})
    assert np.allclose(one.orientation, [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
    assert one.as_keys()["orientation"] == {"axis": [0.0, 0.0, 1.0], "angle": f"{np.pi / 2!r} rad"}
    other = body({"euler": [10, 0, "5 deg"], "order": "ZYX"})
    assert other.as_keys()["orientation"]["order"] == "ZYX"
    for copied in (copy.deepcopy(other), pickle.loads(pickle.dumps(other)), other.replaced(mass=1.0)):
        assert copied.as_keys() == other.as_keys()
    assert body([1, 0, 0, 0]).orientation == (1.0, 0.0, 0.0, 0.0)
    system = evolvent.System()
    system.add(other, "body")
    again = evolvent.load(cases.parse_yaml(system.to_yaml(), "text"))
    assert again.parts["body"] == other
    assert again.to_yaml() == system.to_yaml()


def test_the_start_is_that_of_the_quaternion():
    """Both forms give the start of the quaternion that they stand for."""
    q = quaternion_about((0.0, 1.0, 0.0), 0.3)
    starts = []
    for given in (q, {"axis": [0, 2, 0], "angle": 0.3}, {"euler": [0.0, 0.3, 0.0], "order": "xyz"}):
        system = evolvent.System()
        system.add(body(given))
        starts.append(system.assemble().y)
    assert np.allclose(starts[1], starts[0], rtol=0.0, atol=1e-15)
    assert np.allclose(starts[2], starts[0], rtol=0.0, atol=1e-15)


def test_keys_inside_can_be_set():
    """An angle is a key like others: of overrides, of values of a system, of sweeps."""
    case = {"parts": {"body": {"kind": "rigid-body", "mass": 1, "inertia": 1,
                               "orientation": {"axis": [0, 0, 1], "angle": "0 deg"}}}}  # fmt: skip
    system = evolvent.load(case, {"parts.body.orientation.angle": "30 deg"})
    assert np.isclose(system.parts["body"].orientation[3], np.sin(np.pi / 12.0))
    assert np.isclose(system.with_values({"body.orientation.angle": "90 deg"}).parts["body"].orientation[0], 0.5**0.5)
    kind = cases.system("structure").Case
    found = schema.locate(kind, "parts.body.orientation.angle", {"system": "structure", **case})
    assert found.types[0][0] is float


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"axis": [0, 0, 1]}, "or a mapping such as {axis: [0, 0, 1], angle: 90 deg}"),
        ({"axis": [0, 0, 0], "angle": 1}, "its key axis is [0, 0, 0]; it must be a list of 3 values"),
        ({"axis": [0, 0, 1], "angle": "1 m"}, "its key angle is '1 m'; it must be an angle"),
        ({"euler": [1, 2], "order": "xyz"}, "its key euler is [1, 2]; it must be a list of 3 values"),
        ({"euler": [1, 2, 3], "order": "xxz"}, "its key order is 'xxz'; it must be three letters"),
        ({"euler": [1, 2, 3], "order": "xYz"}, "small ones are fixed axes (extrinsic)"),
        ("up", "or a mapping such as"),
        ([1, 0, 0, 1], "normalised it is"),
    ],
)
def test_errors(given, words):
    """What cannot be used is refused in one sentence that names the key."""
    with pytest.raises(InputError) as error:
        body(given)
    assert words in str(error.value)
    assert str(error.value).startswith("RigidBody.orientation is ")
    assert "\n" not in str(error.value)


def test_schema_for_editors():
    """Editors know all three forms."""
    schema = json.dumps(cases.json_schema("structure"))
    assert '"euler"' in schema
    assert '"enum": ["xyx"' in schema
