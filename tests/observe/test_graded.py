"""Results of a beam with unequal elements: positions along it, means, contact points, and the line that is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.view import drawing
from observe.seeing import Seen, at_rest, close, run

LENGTHS = np.array([1.0, 3.0, 2.0, 2.0]) / 8.0
ARC = np.append(0.0, np.cumsum(LENGTHS))


@pytest.fixture(scope="module")
def lying() -> Seen:
    """A cable on two hinges under a load per length, pressed on a cylinder in its middle."""
    system = System()
    soft = elements.Material(young_modulus=2e6, poisson_ratio=0.0, density=1000.0)
    square = elements.Rectangle(thickness=0.05, width=0.05)
    system.add(
        parts.Beam(length=1.0, section=square, material=soft, elements=4, formulation="cable", grading=(1, 3, 2, 2)),
        "beam",
    )
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="spherical"), "left")
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b="beam.tip", type="spherical"), "right")
    system.add(parts.Load(along="beam", force=(0.0, -1.0, 0.0)), "load")
    drum = parts.Contact(a="beam", b=(0.5, -0.201, 0.0), shape=parts.Cylinder(radius=0.2), stiffness=200.0, points=2)
    system.add(drum, "drum")
    return at_rest(system)


def on_axis(found: Seen, element: int, xi: float) -> np.ndarray:
    nodes, S = found.nodes("beam")[-1], elements.axis_shape(LENGTHS[element], xi)
    i = element
    return S[0] * nodes[i, 0] + S[1] * nodes[i, 1] + S[2] * nodes[i + 1, 0] + S[3] * nodes[i + 1, 1]


def test_places_along_the_beam(lying: Seen) -> None:
    tree = lying.tree["beam"]
    close(tree["arc_node"].values, ARC)
    two = ARC[:-1, None] + LENGTHS[:, None] * (0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0))
    close(tree["arc"].values, two.ravel())
    drum = lying.tree["drum"]
    points = (ARC[:-1, None] + LENGTHS[:, None] * [0.5, 1.0]).ravel()
    close(drum["arc"].values, points[-drum["arc"].size :])


def test_deflection_and_curvature(lying: Seen) -> None:
    """The load's middle is the mean over the length; the curvature that of the elements' cubics."""
    nodes = lying.nodes("beam")[-1]
    at, weight = np.polynomial.legendre.leggauss(4)
    mean = sum(
        LENGTHS[i] * 0.5 * w * on_axis(lying, i, 0.5 + 0.5 * x)
        for i in range(4)
        for x, w in zip(at, weight, strict=True)
    )
    close(lying.of("load", "position")[-1], mean)
    second = [np.asarray(f) for f in elements.axis_shape(LENGTHS[0], 0.0, order=2)]
    bend = second[0] * nodes[0, 0] + second[1] * nodes[0, 1] + second[2] * nodes[1, 0] + second[3] * nodes[1, 1]
    size = np.linalg.norm(np.cross(nodes[0, 1], bend)) / np.linalg.norm(nodes[0, 1]) ** 3
    close(lying.of("beam", "curvature")[-1, 0], size)
    along = nodes[0, 1] / np.linalg.norm(nodes[0, 1])
    close(lying.of("beam", "deflection")[-1, :, 0], (nodes[:, 0] - nodes[0, 0]) @ along - ARC)


def test_the_line_passes_the_nodes_evenly_within_each_element(lying: Seen) -> None:
    motion = drawing.motion_of(lying.tree)
    assert motion is not None
    line = next(line for line in motion.lines if line.name == "beam")
    between = (line.points.shape[1] - 1) // 4
    close(line.points[-1, ::between], lying.nodes("beam")[-1, :, 0])
    close(line.points[-1, between + between // 2], on_axis(lying, 1, (between // 2) / between))
    pushes = next(force for force in motion.forces if force.name.startswith("drum"))
    held = lying.tree["drum"]
    arc = held["arc"].values[np.flatnonzero(held["point_force"].values[-1] > 0.0)]
    assert arc.size
    pressed = np.flatnonzero(np.linalg.norm(pushes.vectors[-1], axis=-1) > 0.0)
    element = int(np.searchsorted(ARC, arc[0], side="left")) - 1
    close(pushes.points[-1, pressed[0]], on_axis(lying, element, (arc[0] - ARC[element]) / LENGTHS[element]))


def test_a_tapered_graded_beam_weighs_what_it_should() -> None:
    section = elements.Taper(
        root=elements.Rectangle(thickness=0.01, width=0.02), tip=elements.Rectangle(thickness=0.01, width=0.04)
    )
    system = System(gravity=(0.0, 0.0, -2.0))
    system.add(parts.Beam(length=1.0, section=section, material="steel", elements=3, grading=(1, 4, 2)), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"), "root")
    held = at_rest(system)
    mass = 7850.0 * 0.01 * 0.03
    assert held.of("root", "force")[-1] == pytest.approx([0.0, 0.0, 2.0 * mass], abs=1e-7)
    centre = (0.02 / 2.0 + 0.02 / 3.0) / 0.03  # of a trapezium
    assert held.of("root", "moment")[-1, 1] == pytest.approx(-2.0 * mass * centre, rel=1e-4)


@pytest.mark.parametrize(
    ("section", "kind", "width"),
    [
        (elements.Angle(height=0.04, width=0.03, thickness=0.003), "line", 0.04),
        (elements.IBeam(height=0.1, width=0.05, web=0.004, flange=0.006), "line", 0.1),
        (elements.Arc(radius=0.02, angle=1.0, thickness=1e-4), "line", 0.04 * np.sin(0.5)),
        (elements.Arc(radius=0.02, angle="350 deg", thickness=1e-4), "rod", 0.04),
        (
            elements.Taper(root=elements.Circle(radius=0.02), tip=elements.Circle(radius=0.01)), "rod", 0.04,
        ),
    ],
)  # fmt: skip
def test_how_wide_sections_are_drawn(section: elements.CrossSection, kind: str, width: float) -> None:
    system = System()
    system.add(parts.Beam(length=1.0, section=section, material="steel", elements=1), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"), "root")
    motion = drawing.motion_of(at_rest(system).tree)
    assert motion is not None
    assert (motion.lines[0].kind, motion.lines[0].width) == (kind, pytest.approx(width))


def test_resultant_of_a_line_load_by_a_law() -> None:
    """A force per length x along a straight beam: integral x ds = 1/2."""
    system, square = System(), elements.Rectangle(thickness=0.05, width=0.05)
    stiff = elements.Material(young_modulus=2e8, poisson_ratio=0.0, density=1000.0)
    system.add(
        parts.Beam(length=1.0, section=square, material=stiff, elements=4, formulation="cable", grading=(1, 3, 2, 2)),
        "beam",
    )
    system.add(parts.Load(along="beam", law=["0", "x", "0"]), "load")
    found = run(system, [0.0, 1e-4], "generalized-alpha", step=1e-4)
    close(found.of("load", "force")[0], np.array([0.0, 0.5, 0.0]))
