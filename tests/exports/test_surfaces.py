"""Surfaces of quadrilaterals: their geometry, in pictures, pages and files for other programs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

import evolvent
from evolvent.exports import gltf, matlab, pictures as films, table, vtk
from evolvent.exports.request import Request
from evolvent.results.motion import Frame, Motion
from evolvent.results.rotations import about_z
from evolvent.results.surfaces import Surface
from evolvent.view import animation
from exports.test_files import arrays, grid, pieces, steps
from exports.test_gltf import Model, upright
from unit.test_animation import browser, read_pack, read_page  # noqa: F401  (browser is a fixture)

Array = np.ndarray
RADIUS, COUNT = 2.0, 5


def rolled(n1: int = 6, n2: int = 2) -> Surface:
    """A quarter of a cylinder about z, seen from outside along its normals, that turns about z."""
    turn, height = np.linspace(0.0, 0.5 * np.pi, n1 + 1), np.linspace(0.0, 1.0, n2 + 1)
    angle = np.linspace(0.0, 1.0, COUNT)[:, None, None] + turn[:, None] + 0.0 * height
    normals = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1).reshape(COUNT, -1, 3)
    points = RADIUS * normals + np.array([0.0, 0.0, 1.0]) * np.tile(height, n1 + 1)[:, None]
    index = np.arange((n1 + 1) * (n2 + 1)).reshape(n1 + 1, n2 + 1)
    faces = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    values = np.arange(COUNT)[:, None] + np.arange(len(faces), dtype=float)
    return Surface(
        name="panel", points=points, faces=faces, normals=normals, thickness=0.1, values={"moment [N]": values},
        data={"force [N m-1]": 2.0 * values}, vectors={"displacement [m]": points - points[0]},
    )  # fmt: skip


def motion(surface: Surface) -> Motion:
    return Motion(title="A panel", time=np.linspace(0.0, 1.0, COUNT), surfaces=[surface])


@pytest.fixture(scope="module")
def run() -> Any:
    """A run with as many samples, whose motion the exports are given another for."""
    system = evolvent.System()
    system.add(evolvent.parts.Point(mass=1.0), "bob")
    found = system.simulate(until=1.0, every=0.25)
    return found if found.sizes["time"] == COUNT else found.isel(time=np.linspace(0, -1, COUNT).astype(int))


def test_the_edge_all_around() -> None:
    rim = rolled().rim
    assert len(rim) == 2 * (6 + 2)
    assert sorted(rim[:, 0]) == sorted(rim[:, 1])  # closed


def test_values_at_points_are_means() -> None:
    surface = rolled()
    found = surface.at_points(surface.values["moment [N]"][0])
    assert found[:3] == pytest.approx([0.0, 0.5, 1.0])
    assert found[4] == pytest.approx(np.mean([0.0, 1.0, 2.0, 3.0]))


def test_a_coarse_surface_is_made_smooth() -> None:
    """Points of Hermite's cubics are off a circle by the fourth power of the arc, those of chords by the second."""
    surface = rolled()
    fine = surface.refined()
    assert len(fine.faces) == len(surface.faces) * fine.each <= 600
    assert fine.points.shape[1] == (6 * 7 + 1) * (2 * 7 + 1)  # each once
    assert len(fine.rim) == 7 * len(surface.rim)
    assert surface.outer.all()
    edges = np.stack([fine.faces, np.roll(fine.faces, -1, axis=1)], axis=-1)[fine.outer.T]
    assert len(np.unique(np.sort(edges, axis=1), axis=0)) == 7 * (6 * 3 + 7 * 2)  # those of the mesh, each divided
    arc = 0.5 * np.pi / 6
    off = np.abs(np.linalg.norm(fine.points[..., :2], axis=-1) / RADIUS - 1.0).max()
    assert off < 0.02 * arc**4 < 1.0 - np.cos(0.5 * arc)
    assert fine.normals == pytest.approx(fine.points * [1.0, 1.0, 0.0] / RADIUS, abs=0.02)
    corners = fine.points[0][fine.faces]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    assert (np.sum(normal * fine.normals[0][fine.faces[:, 0]], axis=1) > 0.0).all()
    assert surface.refined(len(surface.faces)) is surface


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"faces": np.array([[0, 1, 2, 99]])}, "no quadrilaterals between its 21 points"),
        ({"normals": np.zeros((COUNT, 3, 3))}, "'normals' has shape"),
        ({"values": {"moment [N]": np.zeros((COUNT, 3))}}, r"'moment \[N\]' has shape"),
    ],
)
def test_surfaces_that_do_not_fit_are_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        dataclasses.replace(rolled(), **change)


def test_axes_of_a_body() -> None:
    """Seen from a body that turns as much, the surface stands still; displacements are vectors."""
    angle = np.linspace(0.0, 1.0, COUNT)
    frame = Frame(name="hub", origin=np.zeros((COUNT, 3)), attitude=about_z(angle))
    (seen,) = dataclasses.replace(motion(rolled()), frames=[frame]).in_body().surfaces
    assert np.ptp(seen.points, axis=0).max() < 1e-12
    assert np.ptp(seen.normals, axis=0).max() < 1e-12
    length = np.linalg.norm(rolled().vectors["displacement [m]"], axis=-1)
    assert np.linalg.norm(seen.vectors["displacement [m]"], axis=-1) == pytest.approx(length)


@pytest.mark.slow
def test_pictures_show_it_in_colours_and_with_its_thickness() -> None:
    def drawn(surface: Surface) -> Array:
        (picture,) = films.pictures(motion(surface), np.array([0.5]), size=(400, 300), inertial=True)
        return np.asarray(picture[..., :3]).astype(int)

    picture = drawn(rolled())
    plain = drawn(dataclasses.replace(rolled(), values={}))
    middle = picture[60:260, 60:340]
    assert (np.ptp(middle, axis=2) > 60).mean() > 0.1  # viridis
    assert (np.ptp(plain, axis=2) > 60).mean() < 0.01
    assert (drawn(dataclasses.replace(rolled(), thickness=0.0)) != picture).any()
    hidden = dataclasses.replace(rolled(), points=np.full_like(rolled().points, np.nan), values={})
    both = dataclasses.replace(motion(rolled()), surfaces=[rolled(), dataclasses.replace(hidden, name="none")])
    (same,) = films.pictures(both, np.array([0.5]), size=(400, 300), inertial=True)
    assert np.array_equal(same[..., :3], picture)


def test_page_and_pack_hold_it() -> None:
    fine = rolled().refined()
    _, header, blocks = read_page(animation.page(motion(rolled()))[0])
    packed, exact = read_pack(animation.pack(motion(rolled())))
    (shown,) = header["surfaces"]
    assert [shown] == packed["surfaces"]
    assert (shown["name"], shown["count"], shown["each"]) == ("panel", fine.points.shape[1], 49)
    assert header["colors"][0]["name"] == "moment"
    assert exact["surface 0"] == pytest.approx(fine.points, abs=1e-6)
    assert blocks["surface 0"] == pytest.approx(fine.points, abs=1e-4)
    assert blocks["normal 0"] == pytest.approx(fine.normals, abs=1e-2)
    assert blocks[shown["values"]["0"]] == pytest.approx(rolled().values["moment [N]"], abs=1e-3)


@pytest.mark.slow
def test_the_viewer_draws_it(browser: Any, tmp_path: Path) -> None:  # noqa: F811
    """Both sides and the edge, more of it than without."""
    path = animation.write(motion(rolled()), tmp_path / "page.html")
    page = browser.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(Path(path).as_uri())
    page.wait_for_function("document.getElementById('viewer').viewer.spots?.length > 0")
    found = page.evaluate(
        "(() => { const v = document.getElementById('viewer').viewer, parts = []; v.parts = parts;"
        " v.surface(v.motions[0], v.motions[0].surfaces[0], v.C, v.see([0, 0, 0])); return v.parts.length; })()"
    )
    fine = rolled().refined()
    assert found == len(fine.faces) + fine.outer.sum() + len(fine.rim)
    assert errors == []


def test_vtk_has_data_of_cells_and_points(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    surface = rolled()
    monkeypatch.setattr(vtk, "motion_of", lambda run: motion(surface))
    said = vtk.write(run, str(tmp_path), Request())
    assert said.startswith("surfaces.pvd in ")
    found = steps(tmp_path, "surfaces")
    assert len(found) == COUNT
    held = grid(found[3][1])
    assert pieces(found[3][1]) == (21, 0, 0)
    assert np.array_equal(held["points"], surface.points[3])
    assert np.array_equal(held["connectivity"].reshape(-1, 4), surface.faces)
    assert held["surface"].tolist() == [1] * 12
    assert np.array_equal(held["displacement [m]"], surface.vectors["displacement [m]"][3])
    assert np.array_equal(held["normal"], surface.normals[3])
    assert held["thickness [m]"].tolist() == [0.1] * 21
    both = arrays(found[3][1])
    for name, values in {**surface.values, **surface.data}.items():
        assert np.array_equal(both["CellData"][name], values[3])
        assert np.array_equal(both["PointData"][name], surface.at_points(values[3]))
    text = (tmp_path / "about.txt").read_text()
    assert "cell data: moment [N], force [N m-1], and surface" in text


def test_gltf_moves_its_points(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A joint a point: where the joint takes the vertex, the point is."""
    wanted = motion(rolled())
    monkeypatch.setattr(gltf, "animation_of", lambda run: wanted)
    gltf.write(run, str(tmp_path / "a.glb"), Request())
    model = Model(tmp_path / "a.glb")
    (skin,) = model.json["skins"]
    (number,) = (k for k, node in enumerate(model.nodes) if "skin" in node)
    (primitive,) = model.json["meshes"][model.nodes[number]["mesh"]]["primitives"]
    vertices = model.array(primitive["attributes"]["POSITION"])
    bones = model.array(primitive["attributes"]["JOINTS_0"])
    weights = model.array(primitive["attributes"]["WEIGHTS_0"])
    assert np.array_equal(weights, np.tile([1.0, 0.0, 0.0, 0.0], (21, 1)))
    assert len(model.array(primitive["indices"])) == 12 * 6
    for k in (0, COUNT - 1):
        for point, (bone, *_), wished in zip(vertices, bones, wanted.surfaces[0].points[k], strict=True):
            at = model.placed(skin["joints"][bone], point[None], k)
            assert upright(at, wanted.up)[0] == pytest.approx(wished, abs=1e-5)


def test_tables_and_structs_hold_it(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    surface = rolled()
    for module in (matlab, table):
        monkeypatch.setattr(module, "motion_of", lambda run: motion(surface))
    matlab.write(run, str(tmp_path / "a.mat"), Request())
    held = loadmat(tmp_path / "a.mat", simplify_cells=True)["run"]["surfaces"]
    assert held["name"] == "panel"
    assert np.array_equal(held["faces"], surface.faces + 1)
    assert np.array_equal(held["points"], surface.points)
    assert np.array_equal(held["values"]["moment_N"], surface.values["moment [N]"])
    table.write(run, str(tmp_path / "csv"), Request())
    rows = (tmp_path / "csv" / "shapes.csv").read_text(encoding="utf-8-sig").splitlines()
    assert len(rows) == 1 + COUNT * 21
    last = rows[-1].split(",")
    assert last[1:3] == ["panel", "21"]
    assert [float(x) for x in last[3:6]] == pytest.approx(surface.points[-1, -1])
    assert float(last[6]) == surface.values["moment [N]"][-1, -1]
