"""The tangent of the implicit equations against central differences of their residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from evolvent import System, law, parts
from evolvent.assembly.assembled import Assembly
from evolvent.parts.base import unit
from implicit.rigs import RUBBER, SQUARE, Equations, start_step

Array = np.ndarray
C_MASS, C_RATE = 3e4, 2e2


def bodies(system: System) -> None:
    """One body of each motion."""
    inertia = [[0.3, 0.02, -0.01], [0.02, 0.25, 0.03], [-0.01, 0.03, 0.2]]
    system.add(
        parts.RigidBody(
            mass=2.0, inertia=inertia, position=(0.3, -0.2, 0.1), orientation=unit((0.8, 0.3, -0.4, 0.2)),
            velocity=(0.3, 0.2, -0.5), angular_velocity=(0.7, -0.4, 0.9),
        ),
        "free",
    )  # fmt: skip
    system.add(
        parts.RigidBody(
            motion="spin", inertia=inertia, axis=(0.1, 0.3, 1.0), rate=1.3, position=(-0.5, 0.1, 0.2),
            orientation=unit((0.9, 0.1, 0.2, -0.3)),
        ),
        "spin",
    )  # fmt: skip
    system.add(parts.RigidBody(motion="driven", axis=(1.0, 0.2, 0.0), rate=0.8, position=(0.2, 0.6, -0.3)), "driven")
    system.add(parts.Point(mass=0.7, position=(0.9, 0.4, -0.6), velocity=(0.4, -0.3, 0.2)), "point")
    system.add(parts.Point(mass=0.3, position=(-0.9, 0.2, 0.5)), "other")


def beam(formulation: str = "cable", **fields: object) -> parts.Beam:
    return parts.Beam(
        length=1.0, section=SQUARE, material=RUBBER, elements=2, formulation=formulation, **fields  # type: ignore[arg-type]
    )  # fmt: skip


def disturbed(assembly: Assembly, rng: np.random.Generator, size: float = 0.02) -> Equations:
    """Equations at a state and rates a little off those of the start."""
    model = assembly.model
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    y = assembly.y.copy()
    y[:n_q] += size * rng.standard_normal(n_q)
    y[n_q : n_q + n_v] += 5.0 * size * rng.standard_normal(n_v)
    for row in model.bodies:
        if row["motion"] == 2:
            q = row["iq"] + 3
            y[q : q + 4] /= np.linalg.norm(y[q : q + 4])
    return Equations(assembly, 0.37, y, rng.standard_normal(n_v), C_MASS, C_RATE)


def worst(equations: Equations, la: Array, h: float = 1e-4) -> float:
    """Largest difference between tangent and differences, both with rows and columns brought to size 1."""
    n = int(equations.assembly.model.info.nv)
    exact, found = equations.differences(la, np.ones(n), h), equations.tangent(la)
    size = np.sqrt(np.abs(np.diag(found)))
    size[n:] = 1.0 / np.sqrt(C_MASS)
    size[size == 0.0] = 1.0
    scale = 1.0 / np.outer(size, size)
    return float(np.abs((found - exact) * scale).max())


JOINTS: dict[str, list[parts.Joint]] = {
    "spherical": [
        parts.Joint(a=("free", (0.1, 0.2, -0.3)), b=("spin", (0.2, -0.1, 0.3))),
        parts.Joint(a=("driven", (0.1, 0.2, -0.3)), b="point"),
        parts.Joint(a="other", b=("free", (-0.1, 0.2, 0.3))),
    ],
    "revolute": [
        parts.Joint(a=("free", (0.1, 0.2, -0.3)), b=("spin", (0.2, -0.1, 0.3)), type="revolute", axis=(0.3, 0.2, 0.9)),
        parts.Joint(
            a=("driven", (0.1, 0.0, -0.3)), b=("free", (0.0, -0.1, 0.3)), type="revolute", axis=(1.0, 0.2, 0.1)
        ),
    ],
    "clamp": [parts.Joint(a=("free", (0.1, 0.2, -0.3)), b=("spin", (0.2, -0.1, 0.3)), type="clamp")],
    "distance": [
        parts.Joint(a=("free", (0.1, 0.2, -0.3)), b=("spin", (0.2, -0.1, 0.3)), type="distance"),
        parts.Joint(a="point", b=("free", (0.1, 0.2, -0.3)), type="distance"),
        parts.Joint(a=(0.1, 0.2, 0.3), b="other", type="distance"),
        parts.Joint(a="point", b="other", type="distance"),
    ],
}


def together(system: System, joint: parts.Joint) -> parts.Joint:
    """The joint as it is where its places coincide: `b` on a body is put where `a` stands."""
    from evolvent.assembly.builder import Builder
    from evolvent.families.joints.part_sides import point_side

    if joint.type == "distance":
        return joint
    builder = Builder(np.zeros(3))
    for name, part in system._parts.items():
        part.write(builder, name)
    a, b = point_side(builder, joint.a), point_side(builder, joint.b)
    fields = {f: getattr(joint, f) for f in ("type", "axis", "stiffness", "damping")}
    if b.on == 0:
        pose = builder.poses[b.body]
        return parts.Joint(a=joint.a, b=(joint.b[0], pose.R.T @ (a.u - pose.x)), **fields)
    pose = builder.poses[a.body]
    return parts.Joint(a=(joint.a[0], pose.R.T @ (b.u - pose.x)), b=joint.b, **fields)


@pytest.mark.parametrize("kind", sorted(JOINTS))
@pytest.mark.parametrize("stiffness", [0.0, 2e4])
def test_joints_between_bodies_and_points(kind: str, stiffness: float, rng: np.random.Generator) -> None:
    system = System(gravity=(0.3, -1.0, 0.2))
    bodies(system)
    for joint in JOINTS[kind]:
        fitted = together(system, joint)
        fields = {f: getattr(fitted, f) for f in ("a", "b", "type", "axis")}
        system.add(parts.Joint(**fields, stiffness=stiffness))
    equations = disturbed(system.assemble(), rng)
    la = rng.standard_normal(equations.assembly.model.joints.size) * 50.0
    assert worst(equations, la) < 1e-7


@law
def hardening(extension, rate, t, p):
    return p[0] * extension + p[1] * extension**3


LAWS: dict[str, dict] = {
    "stiffness": {"stiffness": 3e3},
    "law": {"law": hardening, "parameters": (3e3, 2e4)},
    "expression": {"law": "k*x + c*x**3", "constants": {"k": 3e3, "c": 2e4}},
}


@pytest.mark.parametrize("fields", LAWS.values(), ids=LAWS)
def test_springs(fields: dict, rng: np.random.Generator) -> None:
    system = System()
    bodies(system)
    ends: Sequence[tuple] = [
        (("free", (0.1, 0.2, -0.3)), ("spin", (0.2, -0.1, 0.3))),
        (("driven", (0.1, 0.2, -0.3)), "point"),
        ("point", ("free", (0.1, 0.2, 0.3))),
        ((0.1, 0.7, 0.3), "other"),
    ]
    for a, b in ends:
        system.add(parts.Spring(a=a, b=b, length=0.4, **fields))
    system.add(parts.Spring(a=(0.5, 0.1, 0.2), b="other", stiffness=1e3, lateral_stiffness=500.0, lateral_damping=3.0))
    equations = disturbed(system.assemble(), rng)
    assert worst(equations, np.zeros(0)) < 1e-7


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain", "full"])
@pytest.mark.parametrize("damping", [None, "objective", "paper"])
def test_beams(formulation: str, damping: str | None, rng: np.random.Generator) -> None:
    system = System(gravity=(0.0, -9.81, 0.0))
    damped = {} if damping is None else {"mass_damping": 0.4, "stiffness_damping": 2e-3, "damping": damping}
    system.add(beam(formulation, **damped), "beam")
    system.add(parts.Load(along="beam", force=(0.1, 0.2, 0.3)))
    assert worst(disturbed(system.assemble(), rng), np.zeros(0)) < 1e-7


def mixed(system: System) -> None:
    """Beams of both kinds, on bodies of each motion."""
    bodies(system)
    n = np.array([0.0, 0.6, 0.8])
    cable = beam("cable", position=(0.3, -0.2, 0.1), direction=n, mass_damping=0.2)
    system.add(cable, "cable")
    system.add(beam("assumed_strain", position=(1.0, 1.0, 0.0), direction=n, normal=(1.0, 0.0, 0.0)), "beam")
    system.add(beam("cable", position=(1.0, 1.6, 0.8), direction=(1.0, 0.0, 0.0)), "last")


def attach(system: System, body: str, **fields: object) -> None:
    """Joints of all kinds from a body to beams, and from beam to beam."""
    from evolvent.assembly.builder import Builder

    builder = Builder(np.zeros(3))
    for name, part in system._parts.items():
        part.write(builder, name)
    pose = builder.poses[0 if body == "ground" else builder.find(body, "bodies")]

    def at(*place: float) -> tuple[str, Array]:
        return body, pose.R.T @ (np.array(place) - pose.x)

    system.add(parts.Joint(a=at(0.3, -0.2, 0.1), b="cable.root", type="revolute", axis=(1.0, 0.0, 0.0), **fields))  # type: ignore[arg-type]
    system.add(parts.Joint(a="beam.root", b=at(1.0, 1.0, 0.0), type="clamp", **fields))  # type: ignore[arg-type]
    system.add(parts.Joint(a="beam.tip", b="last.root", **fields))  # type: ignore[arg-type]
    system.add(parts.Joint(a="cable.tip", b="beam[1]", type="distance", **fields))  # type: ignore[arg-type]
    system.add(parts.Joint(a="point", b="beam.tip", type="distance", **fields))  # type: ignore[arg-type]


@pytest.mark.parametrize("body", ["ground", "driven", "spin", "free"])
@pytest.mark.parametrize("stiffness", [0.0, 3e4])
def test_beams_on_bodies(body: str, stiffness: float, rng: np.random.Generator) -> None:
    """A cable's nodes leave part of their block empty where beams stand beside them."""
    system = System()
    mixed(system)
    attach(system, body, stiffness=stiffness)
    equations = disturbed(system.assemble(), rng)
    la = rng.standard_normal(equations.assembly.model.joints.size) * 5.0
    assert worst(equations, la) < 1e-7


def test_driven_places_and_angles(rng: np.random.Generator) -> None:
    system = System()
    mixed(system)
    system.add(parts.Joint(a="ground", b="spin", type="revolute", drive=parts.ConstantDrive(rate=1.3)))
    system.add(
        parts.Joint(
            a="ground", b="cable.tip", type="point-on-line", drive=parts.ConstantDrive(rate=0.2), axis=(0.3, 1.0, 0.0)
        )
    )
    system.add(
        parts.Joint(
            a=(0.0, 0.0, 0.0), b="beam.tip", type="involute", drive=parts.ConstantDrive(rate=0.2), drum=0.2, length=1.0
        )
    )
    equations = disturbed(system.assemble(), rng)
    la = rng.standard_normal(equations.assembly.model.joints.size) * 5.0
    assert worst(equations, la) < 1e-7


@pytest.mark.parametrize("body", ["ground", "spin", "free"])
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_hinges(body: str, damping: float, rng: np.random.Generator) -> None:
    system = System()
    mixed(system)
    for node, zero in (("cable", (0.0, -0.8, 0.6)), ("beam", None)):
        system.add(
            parts.JointSpring(
                a=body, b=f"{node}.root", axis=(1.0, 0.0, 0.0), zero=zero, stiffness=40.0, damping=damping, rest=0.3,
                low=-0.2, high=1.0, stop=300.0, latch=0.5, latch_stiffness=700.0, latch_damping=0.2 * damping
            )
        )  # fmt: skip
    equations = disturbed(system.assemble(), rng)
    model = equations.assembly.model
    model.switches[model.coordinates["switch"] + 1] = (0, 1)
    assert worst(equations, np.zeros(0)) < 1e-6


def pressed(
    body: str, law: str, friction: float, rng: np.random.Generator, formulation: str = "cable", **fields: float
) -> Equations:
    """A beam lying on a cylinder, sliding or sticking, in the middle of a step."""
    system = System()
    bodies(system)
    system.add(
        beam(formulation, direction=(0.0, 1.0, 0.0), normal=(0.0, 0.0, 1.0), position=(0.0, -0.5, 0.3997)), "beam"
    )
    axis = (1.0, 0.0, 0.0)
    if body == "ground":
        centre = (0.0, 0.0, 0.0)
    else:
        from evolvent.assembly.builder import Builder

        builder = Builder(np.zeros(3))
        for name, part in system._parts.items():
            part.write(builder, name)
        pose = builder.poses[builder.find(body, "bodies")]
        centre, axis = tuple(pose.R.T @ -pose.x), tuple(pose.R.T @ np.array(axis))
    system.add(
        parts.Contact(
            a="beam", b=(body, centre), shape=parts.Cylinder(radius=0.4, axis=axis), law=law, stiffness=3e3,
            exponent=1.5, damping=fields.get("damping", 0.0), friction=friction, bristle_stiffness=400.0, points=3,
        )
    )  # fmt: skip
    assembly = system.assemble()
    model = assembly.model
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    y = assembly.y.copy()
    y[model.beams[0]["iq"] + 2 : n_q : 3 * (2 if formulation == "cable" else 4)] -= 0.06
    if fields.get("rest", 0.0):
        y[n_q : n_q + n_v] = 0.0
    start_step(assembly, y)
    dq = fields.get("moved", 1e-3) * rng.standard_normal(n_v)
    from evolvent.kernels import blocks

    y1 = y.copy()
    blocks.displace(y, dq, False, model, y1)
    y1[n_q : n_q + n_v] += 0.02 * rng.standard_normal(n_v) * (1.0 - fields.get("rest", 0.0))
    return Equations(assembly, 0.0, y1, np.zeros(n_v), C_MASS, C_RATE, 1e-2)


CASES: list[tuple[str, dict[str, float]]] = [
    ("hunt-crossley", {}),
    ("hunt-crossley", {"damping": 0.7}),
    ("paper", {"damping": 30.0}),
]


@pytest.mark.parametrize(("law", "fields"), CASES)
@pytest.mark.parametrize("body", ["ground", "spin", "free"])
def test_contact(law: str, fields: dict[str, float], body: str, rng: np.random.Generator) -> None:
    equations = pressed(body, law, 0.0, rng, rest=1.0, **fields)
    touching = equations.assembly.model.contact_surfaces["touching"]
    n = int(equations.assembly.model.info.nv)
    equations.residual(np.zeros(n), np.zeros(0))
    assert touching.sum() >= 2
    assert worst(equations, np.zeros(0), h=1e-6) < 1e-5


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
@pytest.mark.parametrize(("mu", "moved"), [(0.3, 3e-3), (30.0, 3e-4)])
def test_friction(formulation: str, mu: float, moved: float, rng: np.random.Generator) -> None:
    equations = pressed("ground", "hunt-crossley", mu, rng, formulation, rest=1.0, moved=moved)
    # left out: how the direction of friction follows the normal, slip by radius
    assert worst(equations, np.zeros(0), h=1e-7) < 0.5 * moved
