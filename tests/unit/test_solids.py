"""Solids: their meshes are closed, face outwards and enclose the volume of the closed form."""

import numpy as np
import pytest

from evolvent.results.solids import Solid

# area of a regular polygon over that of its circle
ROUND = np.sin(2.0 * np.pi / 48) / (2.0 * np.pi / 48)
SOLIDS = {
    "box": (Solid.box((1.0, 2.0, 0.1)), 0.2),
    "cylinder": (Solid.cylinder(0.5, 2.0), 0.5 * np.pi * ROUND),
    "cone": (Solid.revolution([(0.0, 0.5), (1.5, 0.0)]), 0.125 * np.pi * ROUND),
    "frustum": (Solid.revolution([(0.0, 0.2), (0.3, 0.4)]), 0.1 * np.pi * (0.04 + 0.08 + 0.16) * ROUND),
    "sphere": (Solid.sphere(0.3), 4.0 / 3.0 * np.pi * 0.027),
}


def volume(vertices, faces):
    """Divergence theorem over the triangles of the faces."""
    a, b, c, d = np.moveaxis(vertices[faces], 1, 0)
    return sum(np.einsum("fi,fi->", x, np.cross(y, z)) for x, y, z in ((a, b, c), (a, c, d))) / 6.0


@pytest.mark.parametrize("name", SOLIDS)
def test_meshes_enclose_the_volume(name):
    solid, wanted = SOLIDS[name]
    mesh = solid.mesh()
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(wanted, rel=0.02 if name == "sphere" else 1e-9)
    # shifted, it is the same only if the mesh is closed
    assert volume(mesh.vertices + 7.0, mesh.faces) == pytest.approx(volume(mesh.vertices, mesh.faces), rel=1e-9)
    assert np.linalg.norm(mesh.vertices, axis=1).max() == pytest.approx(solid.size)
    assert len(mesh.dark) == len(mesh.faces)


def test_a_cylinder_stands_where_it_is_placed():
    solid = Solid.cylinder(0.1, 2.0, centre=(1.0, 2.0, 3.0), axis=(0.0, 5.0, 0.0), turned=np.array([0.0, 0.5 * np.pi]))
    mesh = solid.mesh()
    placed = solid.placed(mesh.vertices, 0) - solid.centre
    assert np.abs(placed[:, 1]).max() == pytest.approx(1.0)
    assert np.hypot(placed[:, 0], placed[:, 2]).max() == pytest.approx(0.1)
    later = solid.placed(mesh.vertices, 1) - solid.centre
    edge = np.hypot(placed[:, 0], placed[:, 2]) > 0.09
    before, after = placed[edge] * [1, 0, 1], later[edge] * [1, 0, 1]
    assert np.einsum("ni,ni->n", before, after) == pytest.approx(0.0, abs=1e-12)  # a right angle,
    assert (np.cross(before, after)[:, 1] > 0.0).all()  # turned forwards about y


def test_what_is_no_solid_is_refused():
    with pytest.raises(ValueError, match="either edges or a profile"):
        Solid()
    with pytest.raises(ValueError, match="an axis"):
        Solid.cylinder(1.0, 1.0, axis=(0.0, 0.0, 0.0))
