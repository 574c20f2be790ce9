"""Parts that are written once and repeated: in a row, round a ring, with numbers alone; merge keys of YAML."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import evolvent
from evolvent import InputError, cases
from evolvent_base.units.orientation import quaternion_about

RIBS = """
parts:
  hub:
    kind: rigid-body
    motion: driven
    rate: 0 rad/s
    shape: {cylinder: {radius: 0.28 m, length: 0.1 m, axis: [0, 0, 1]}}
  rib:
    repeat: &ring {count: 6, axis: [0, 0, 1]}
    kind: rod
    length: 2 m
    shape: {parabola: {focal_length: 1.2 m, offset: 0.3 m}}
    section: {tube: {radius: 8 mm, thickness: 0.5 mm}}
    material: cfrp
    elements: 6
    stiffness_damping: 2 ms
    position: [0.3, 0, 0.01875 m]
    direction: [0.3887217073, 0, 0.9213552161]
    normal: [-0.9213552161, 0, 0.3887217073]
  hinge:
    repeat: *ring
    kind: joint
    a: [hub, [0.3, 0, 0.01875 m]]
    b: rib {n}.root
    type: revolute
    axis: [0, -1, 0]
  spring:
    repeat: *ring
    kind: joint-spring
    joint: hinge {n}
    start: 60 deg
    rest: -40 deg
    stiffness: 1 N m/rad
    damping: 0.3 N m s/rad
  cord:
    repeat: *ring
    kind: spring
    a: rib {n}.tip
    b: rib {n+1}.tip
    stiffness: 1 kN/m
"""


def load(text):
    """The system of a case as text."""
    return evolvent.load(cases.parse_yaml(text, "text"))


def test_a_ring_is_the_reflector_that_is_written_out():
    """Ribs, hinges and springs of rib-reflector, in 33 lines for 120; the last cord closes the ring."""
    found, expected = load(RIBS), evolvent.load("rib-reflector")
    for name in expected.parts:
        if name.startswith(("rib", "hinge", "spring")):
            one, other = found.parts[name], expected.parts[name]
            assert type(one) is type(other)
            for key in type(one).model_fields:
                a, b = getattr(one, key), getattr(other, key)
                if key in ("position", "direction", "normal", "axis"):
                    assert b is a is None or np.allclose(a, b, rtol=0.0, atol=1e-9), (name, key)
                elif name.startswith("hinge") and key == "a":
                    assert a[0] == b[0] == "hub"
                    assert np.allclose(a[1], b[1], rtol=0.0, atol=1e-9)
                else:
                    assert a == b, (name, key)
    assert [found.parts[f"cord {n}"].b for n in (1, 5, 6)] == ["rib 2.tip", "rib 6.tip", "rib 1.tip"]
    assert list(found.parts)[:3] == ["hub", "rib 1", "rib 2"]
    assert len(found.parts) == 25
    found.assemble()


def test_bodies_on_a_ring_keep_their_own_axes():
    """Positions and orientations turn, also about a center beside the origin; body axes, points and rates stay."""
    text = """
parts:
  panel:
    repeat: {count: 3, axis: [0, 1, 1], center: [0, 1, 0 m], angle: 40 deg}
    kind: rigid-body
    mass: 1 kg
    inertia: [1, 2, 2.5 kg m^2]
    position: [1, 2, 3 m]
    velocity: [0, 0, 1 m/s]
    orientation: {axis: [1, 0, 0], angle: 20 deg}
    angular_velocity: [0, 0, 2 rad/s]
    points: {edge: [0.5, 0, 0 m]}
"""
    system = load(text)
    first = Rotation.from_rotvec([np.radians(20.0), 0.0, 0.0])
    for k in range(3):
        part = system.parts[f"panel {k + 1}"]
        turn = Rotation.from_rotvec(np.radians(40.0 * k) * np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0))
        assert np.allclose(part.position, np.array([0.0, 1.0, 0.0]) + turn.apply([1.0, 1.0, 3.0]), atol=1e-14)
        assert np.allclose(part.velocity, turn.apply([0.0, 0.0, 1.0]), atol=1e-14)
        found = Rotation.from_quat(part.orientation, scalar_first=True)
        assert np.allclose(found.as_matrix(), (turn * first).as_matrix(), atol=1e-14)
        assert part.points == {"edge": (0.5, 0.0, 0.0)}
        assert part.angular_velocity == (0.0, 0.0, 2.0)


CHAIN = """
parts:
  panel:
    repeat: {count: 4, step: [1 m, 0, 0]}
    kind: rigid-body
    mass: 2 kg
    inertia: [0.2, 0.2, 0.3 kg m^2]
    position: [0.5, 0, 0 m]
  root: {kind: joint, a: [0, 0, 0], b: ["panel 1", [-0.5, 0, 0 m]], type: revolute, axis: [0, 0, 1]}
  hinge:
    repeat: {count: 3, first: 2}
    kind: joint
    a: ["panel {n-1}", [0.5, 0, 0 m]]
    b: ["panel {n}", [-0.5, 0, 0 m]]
    type: revolute
    axis: [0, 0, 1]
  spring:
    repeat: {count: 3, first: 2}
    kind: joint-spring
    joint: hinge {n}
    stiffness: 0.5 N m/rad
    rest: 90 deg
"""


def test_a_chain_is_that_of_its_parts():
    """Panels in a row, hinges between neighbours: the run is that of the parts written out, to the last bit."""
    system = load(CHAIN)
    assert list(system.parts) == ["panel 1", "panel 2", "panel 3", "panel 4", "root", "hinge 2", "hinge 3", "hinge 4",
                                  "spring 2", "spring 3", "spring 4"]  # fmt: skip
    assert [system.parts[f"panel {n}"].position[0] for n in (1, 2, 3, 4)] == [0.5, 1.5, 2.5, 3.5]
    assert system.parts["hinge 3"].a == ("panel 2", (0.5, 0.0, 0.0))
    again = load(system.to_yaml())
    assert again.parts == system.parts
    found, expected = system.simulate(until=0.2), again.simulate(until=0.2)
    assert np.array_equal(found["spring 4"].angle, expected["spring 4"].angle)


def test_points_of_a_fixed_body_that_is_turned_and_moved():
    """The point of a body that is not repeated moves in inertial axes, whatever the body's own."""
    text = """
parts:
  hub:
    kind: rigid-body
    motion: driven
    position: [0, 0, 2 m]
    orientation: {axis: [1, 2, 0], angle: 50 deg}
  mass:
    repeat: &ring {count: 4, axis: [0, 0, 1]}
    kind: point
    mass: 1 kg
    position: [1, 0, 0 m]
  cord: {repeat: *ring, kind: spring, a: [hub, [0.1, 0.2, 0.3 m]], b: "mass {n}", stiffness: 1 N/m}
  stay: {repeat: *ring, kind: spring, a: [3, 0, 1 m], b: "mass {n}", stiffness: 1 N/m}
"""
    system = load(text)
    axis = np.array([1.0, 2.0, 0.0])
    hub = Rotation.from_rotvec(np.radians(50.0) * axis / np.linalg.norm(axis))
    first = hub.apply([0.1, 0.2, 0.3]) + np.array([0.0, 0.0, 2.0])
    for k in range(4):
        turn = Rotation.from_rotvec([0.0, 0.0, 0.5 * np.pi * k])
        local = system.parts[f"cord {k + 1}"].a[1]
        assert np.allclose(hub.apply(local) + np.array([0.0, 0.0, 2.0]), turn.apply(first), atol=1e-14)
        assert np.allclose(system.parts[f"stay {k + 1}"].a, turn.apply([3.0, 0.0, 1.0]), atol=1e-14)
        assert np.allclose(system.parts[f"mass {k + 1}"].position, turn.apply([1.0, 0.0, 0.0]), atol=1e-15)


def test_a_ring_moves_like_one_part():
    """Four equal bodies round a ring, pulled to its axis, have motions that differ by their turn."""
    text = """
parts:
  body:
    repeat: &ring {count: 4, axis: [0, 0, 1]}
    kind: rigid-body
    mass: 1 kg
    inertia: [0.1, 0.2, 0.25 kg m^2]
    position: [1, 0, 0 m]
    velocity: [0, 0.3, 0.1 m/s]
    angular_velocity: [0.1, 0.2, 0.3 rad/s]
  cord: {repeat: *ring, kind: spring, a: [0, 0, 0], b: ["body {n}", [0, 0.1, 0 m]], stiffness: 3 N/m, length: 0.2 m}
"""
    run = load(text).simulate(until=1.0, method="rk4", step=1e-3)
    for k in range(1, 4):
        turn = Rotation.from_rotvec([0.0, 0.0, 0.5 * np.pi * k])
        expected = turn.apply(run["body 1"].position.values)
        assert np.allclose(run[f"body {k + 1}"].position, expected, rtol=0.0, atol=1e-12)


def test_overrides_reach_all_parts():
    """A key of the part that is written is a key of all; the number of parts can be set as well."""
    content = cases.parse_yaml(CHAIN, "text")
    system = evolvent.load(content, {"parts.panel.mass": "3 kg", "parts.panel.repeat.step": [2, 0, 0]})
    assert [system.parts[f"panel {n}"].mass for n in (1, 4)] == [3.0, 3.0]
    assert system.parts["panel 4"].position[0] == 6.5


def test_sweeps_of_all_parts():
    """A key of the part that is written, and one inside an orientation, vary in a sweep: E = 3 m v^2 / 2."""
    text = """
parts:
  mass: {repeat: {count: 3, step: [1 m, 0, 0]}, kind: point, mass: 1 kg, velocity: [1, 0, 0 m/s]}
  body: {kind: rigid-body, mass: 1 kg, inertia: 1 kg m^2, orientation: {axis: [0, 0, 1], angle: 10 deg}}
simulate: {until: 1 s}
"""
    over = {"parts.mass.mass": ["1 kg", "2 kg"], "parts.body.orientation.angle": ["0 deg", "90 deg"]}
    found = evolvent.sweep({"case": cases.parse_yaml(text, "text"), "over": over, "keep": ["energy.last"]})
    assert np.allclose(found["parts.mass.mass"], [1.0, 2.0])
    assert np.allclose(found["parts.body.orientation.angle"], [0.0, np.pi / 2.0])
    assert np.allclose(found.energy_last, [[1.5, 1.5], [3.0, 3.0]], rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"repeat": {"count": 0}}, "parts.x.repeat.count is 0"),
        ({"repeat": 3}, "parts.x.repeat is 3; it must be a mapping"),
        ({"repeat": {"cuont": 3}}, "unknown key 'parts.x.repeat.cuont'; did you mean 'parts.x.repeat.count'"),
        ({"repeat": {"count": 2, "step": [1, 0, 0], "axis": [0, 0, 1]}}, "step and parts.x.repeat.axis are both given"),
        ({"repeat": {"count": 2, "angle": "3 deg"}}, "parts.x.repeat.angle is given without parts.x.repeat.axis"),
        ({"repeat": {"count": 2}, "mass": -1}, "parts.x.mass is -1"),
        ({"repeat": {"count": 2}, "masss": 1}, "unknown key 'parts.x.masss'"),
        ({"repeat": {"count": 2}, "kind": "pont"}, "parts.x.kind is 'pont'; did you mean 'point'"),
        ({"repeat": {"count": 1000}}, "the name 'x 7' is taken by another part"),
        (
            {"kind": "load", "repeat": {"count": 2, "axis": [0, 0, 1]}, "mass": None, "at": "x 7", "force": [1, 0, 0]},
            "parts.x.force cannot be repeated on a ring",
        ),
        (
            {"kind": "spring", "repeat": {"count": 2, "axis": [0, 0, 1]}, "mass": None, "a": ["x 7", [1, 0, 0]],
             "b": [0, 0, 0], "stiffness": 1}, "parts.x.a is ['x 7', [1, 0, 0]]; a repeated point must be on the ground",
        ),
    ],
)  # fmt: skip
def test_refusals(change, words):
    """One sentence names the key."""
    given = {"kind": "point", "mass": 1} | change
    content = {"x 7": {"kind": "point", "mass": 1}, "x": {k: v for k, v in given.items() if v is not None}}
    with pytest.raises(InputError) as error:
        evolvent.load({"parts": content})
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_rods_on_a_ring_need_their_normal():
    """The normal that a rod has by default is as near to y as can be, which does not turn along."""
    content = cases.parse_yaml(RIBS, "text")
    del content["parts"]["rib"]["normal"]
    with pytest.raises(InputError, match=r"parts\.rib\.normal is missing; on a ring it must be given"):
        evolvent.load(content)


SHELL = """
parts:
  petal:
    kind: shell
    repeat: {count: 4, axis: [1, 0, 0]}
    formula: [0.3*u, 0.2*v, 0.1*v**2]
    elements: [1, 2]
    thickness: 2 mm
    material: cfrp
    position: [0.3, 0.1, 0 m]
    direction: [1, 0, 0]
    normal: [0, 0, 1]
"""


def test_shells_on_a_ring():
    """Positions and normals of the nodes of each turn by a quarter."""
    model = load(SHELL).assemble().model.bodies[1:]
    quarter = Rotation.from_rotvec([0.5 * np.pi, 0.0, 0.0]).as_matrix()
    for k in range(3):
        first, second = model[6 * k : 6 * k + 6], model[6 * k + 6 : 6 * k + 12]
        np.testing.assert_allclose(second["x0"], first["x0"] @ quarter.T, atol=1e-12)
        np.testing.assert_allclose(second["R0"], quarter @ first["R0"], atol=1e-12)
    for key, text in (("direction", "    direction: [1, 0, 0]\n"), ("normal", "    normal: [0, 0, 1]\n")):
        with pytest.raises(InputError, match=rf"parts\.petal\.{key} is missing; on a ring it must be given"):
            load(SHELL.replace(text, ""))


def test_the_size_of_a_case_is_limited():
    """Many repetitions end with a sentence."""
    one = {"kind": "point", "mass": 1, "repeat": {"count": 1000}}
    with pytest.raises(InputError, match="the case would have more than 10000 parts"):
        evolvent.load({"parts": {f"p{chr(97 + k)}": one for k in range(11)}})


def test_merge_keys():
    """The keys of another mapping stand where a mapping has none of its own; of several the first one counts."""
    text = """
parts:
  a: &a {kind: point, mass: 1 kg, position: [1, 0, 0 m]}
  b: &b {<<: *a, mass: 2 kg}
  c: {<<: *b, position: [2, 0, 0 m]}
  d: {position: [3, 0, 0 m], <<: [*b, *a]}
"""
    found = load(text).parts
    assert [found[n].mass for n in "abcd"] == [1.0, 2.0, 2.0, 2.0]
    assert [found[n].position[0] for n in "abcd"] == [1.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: &a {x: 1}\nb: {<<: *a, <<: *a}", "the merge key '<<' is given twice"),
        ("b: {<<: 3}", "the merge key '<<' takes a mapping"),
        ("a: &a {x: 1}\nb: {<<: *a, y: 1, y: 2}", "the key 'y' is given twice"),
        ("b: {<<: [3]}", "the merge key '<<' takes a mapping"),
        ("b: &b {<<: *b}", "an alias is inside what it names"),
    ],
)
def test_merge_keys_that_are_refused(text, words):
    """One sentence with the place."""
    with pytest.raises(InputError) as error:
        cases.parse_yaml(text, "text")
    assert words in str(error.value)


def test_merged_texts_stay_small():
    """Merges of merges that would grow without end are refused as aliases are."""
    lines = ["a0: &a0 {x: 1}"] + [f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 10)}]}}" for k in range(1, 9)]
    with pytest.raises(InputError, match="aliases written out"):
        cases.parse_yaml("\n".join(lines), "text")


def test_quaternions_of_the_turns():
    """The half turn about z is (0, 0, 0, 1)."""
    assert np.allclose(quaternion_about((0.0, 0.0, 2.0), np.pi), (0.0, 0.0, 0.0, 1.0), atol=1e-15)
