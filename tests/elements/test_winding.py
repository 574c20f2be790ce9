"""Beams wound on a cylinder: coils without stretch, stiffness of bent elements, nodes on another mesh."""

import numpy as np
import pytest

from evolvent import elements
from evolvent.elements import Material, Rectangle

SECTION = Rectangle(thickness=3e-4, width=0.03)
MATERIAL = Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0)
R, N, LENGTH = 0.6, 20, 0.3
Z = np.array([0.0, 0.0, 1.0])


def points(nodes, length, xi):
    """Places on the axes of all elements at xi: (n, k, 3)."""
    ends = np.stack([nodes[:-1, 0], nodes[:-1, 1], nodes[1:, 0], nodes[1:, 1]])
    return np.einsum("jk,jni->nki", np.array(elements.axis_shape(length, xi)), ends)


@pytest.mark.parametrize("formulation", ["cable", "cable_stretch", "assumed_strain"])
def test_a_coil_touches_the_cylinder_and_keeps_its_length(formulation):
    nodes = elements.coil(formulation, N, LENGTH, SECTION, MATERIAL, radius=R, points=4)
    assert nodes.shape == (N + 1, 4 if formulation == "assumed_strain" else 2, 3)
    touching = np.linalg.norm(points(nodes, LENGTH, np.arange(1, 5) / 4), axis=-1)
    assert touching.min() == pytest.approx(R, rel=1e-12)
    line = points(nodes, LENGTH, np.linspace(0.0, 1.0, 200)).reshape(-1, 3)
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(N * LENGTH, rel=2e-3)
    angle = np.unwrap(np.arctan2(nodes[:, 0, 1], nodes[:, 0, 0]))
    assert angle[-1] == pytest.approx(N * LENGTH / R, rel=2e-3)
    assert np.all(np.diff(angle) > 0.0)


def test_turns_of_a_coil_lie_a_thickness_apart():
    thickness = 2e-3
    nodes = elements.coil("cable", 60, LENGTH, SECTION, MATERIAL, radius=R, points=4, thickness=thickness)
    angle = np.unwrap(np.arctan2(nodes[:, 0, 1], nodes[:, 0, 0]))
    radius = np.linalg.norm(nodes[:, 0], axis=1)
    rise = np.polyfit(angle, radius, 1)[0] * 2.0 * np.pi
    assert thickness < rise < 1.6 * thickness  # more by what the elements' cubics leave the circle
    two = elements.coil("cable", 60, LENGTH, SECTION, MATERIAL, radius=R, points=4, thickness=thickness, beams=2)
    wound = np.unwrap(np.arctan2(two[:, 0, 1], two[:, 0, 0]))
    assert np.polyfit(wound, np.linalg.norm(two[:, 0], axis=1), 1)[0] * np.pi == pytest.approx(rise, rel=1e-6)


def test_the_stiffness_of_a_fine_mesh_is_the_beams():
    for formulation in ("cable", "cable_stretch", "assumed_strain"):
        ratio = elements.bending_stiffness_ratio(formulation, 0.01, SECTION, MATERIAL, R)
        assert ratio == pytest.approx(1.0, abs=1e-4), formulation
    # a continuum without lateral contraction: (1 - nu)/((1 + nu)(1 - 2 nu)) too stiff
    assert elements.bending_stiffness_ratio("full", 1e-3, SECTION, MATERIAL, R) == pytest.approx(
        0.7 / (1.3 * 0.4), rel=2e-3
    )


@pytest.mark.parametrize("vectors", [2, 4])
def test_nodes_on_a_finer_mesh_are_those_of_the_same_curve(vectors):
    formulation = "cable" if vectors == 2 else "assumed_strain"
    nodes = elements.coil(formulation, N, LENGTH, SECTION, MATERIAL, radius=R)
    rates = np.cross(np.array([0.3, -0.1, 0.7]), nodes)
    x, v = elements.resampled(nodes, rates, N * LENGTH, 3 * N, vectors=vectors, z=Z)
    np.testing.assert_allclose(x[::3], nodes, atol=1e-14)
    np.testing.assert_allclose(v, np.cross(np.array([0.3, -0.1, 0.7]), x), atol=1e-14)
    np.testing.assert_allclose(points(x, LENGTH / 3, np.array([0.5]))[1::3], points(nodes, LENGTH, np.array([0.5])))


def test_directors_that_a_cable_lacks_stand_across_it():
    nodes = elements.coil("cable", N, LENGTH, SECTION, MATERIAL, radius=R)
    w = np.array([0.0, 0.0, 0.7])
    x, v = elements.resampled(nodes, np.cross(w, nodes), N * LENGTH, N, vectors=4, z=Z)
    e1 = x[:, 1] / np.linalg.norm(x[:, 1], axis=1)[:, None]
    np.testing.assert_allclose(np.einsum("ni,ni->n", x[:, 2], e1), 0.0, atol=1e-14)
    np.testing.assert_allclose(x[:, 3], np.tile(Z, (N + 1, 1)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(x[:, 2], axis=1), 1.0)
    np.testing.assert_allclose(v, np.cross(w, x), atol=1e-14)
