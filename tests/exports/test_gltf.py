"""Animated models: what a viewer of glTF draws at a sample is where the run has its bodies and lines."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evolvent import cases
from evolvent.exports import gltf
from evolvent.exports.request import Request
from evolvent_base.errors import InputError
from many_bodies import many_bodies

#: Columns of the file, which has y up, that are x, y and z of a motion, and their signs, by what points up there.
UPRIGHT = {"x": ([1, 0, 2], [1, -1, 1]), "y": ([0, 1, 2], [1, 1, 1]), "z": ([0, 2, 1], [1, -1, 1])}


def upright(points, up):
    columns, signs = UPRIGHT[up]
    return points[:, columns] * signs


class Model:
    """A binary glTF file, read by its specification."""

    def __init__(self, path) -> None:
        raw = path.read_bytes()
        magic, version, length = raw[:4], *np.frombuffer(raw, "<u4", 2, 4)
        assert (magic, version, length) == (b"glTF", 2, len(raw))
        size, kind = int(np.frombuffer(raw, "<u4", 1, 12)[0]), raw[16:20]
        assert kind == b"JSON"
        self.json = json.loads(raw[20 : 20 + size])
        rest = int(np.frombuffer(raw, "<u4", 1, 20 + size)[0])
        assert raw[24 + size : 28 + size] == b"BIN\0"
        assert (size % 4, rest % 4, 28 + size + rest) == (0, 0, len(raw))
        self.data = raw[28 + size :]
        self.nodes = self.json["nodes"]
        self.moves, self.between = {}, {}
        (animation,) = self.json["animations"]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            place = channel["target"]["node"], channel["target"]["path"]
            self.between[place] = sampler["interpolation"]
            assert self.between[place] == "LINEAR" or place[1] == "scale"
            self.time = self.array(sampler["input"])
            self.moves[place] = self.array(sampler["output"])
        self.parents = {child: k for k, node in enumerate(self.nodes) for child in node.get("children", [])}

    def array(self, number):
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        kind = {5126: "<f4", 5125: "<u4", 5123: "<u2"}[accessor["componentType"]]
        found = np.frombuffer(self.data, kind, accessor["count"] * width, view["byteOffset"])
        return found if width == 1 else found.reshape(-1, width)

    def placed(self, number, points, k):
        """Points of a node in the axes of the file, at a sample."""
        while number is not None:
            node = self.nodes[number]
            move = {path: self.moves[number, path][k] for path in ("scale", "rotation", "translation")
                    if (number, path) in self.moves}  # fmt: skip
            points = points * move.get("scale", node.get("scale", [1.0, 1.0, 1.0]))
            turn = Rotation.from_quat(move.get("rotation", node.get("rotation", [0.0, 0.0, 0.0, 1.0])))
            points = turn.apply(points) + move.get("translation", node.get("translation", [0.0, 0.0, 0.0]))
            number = self.parents.get(number)
        return points

    def drawn(self, k, up):
        """Points of all meshes at a sample in the axes of the run, by the names of their nodes."""
        found = {}
        for number, node in enumerate(self.nodes):
            if "mesh" in node:
                (primitive,) = self.json["meshes"][node["mesh"]]["primitives"]
                points = self.array(primitive["attributes"]["POSITION"])
                used = points[self.array(primitive["indices"])]
                assert np.isfinite(used).all()
                found.setdefault(node["name"], []).append(upright(self.placed(number, used, k), up))
        return found


def motion(run):
    return cases.system(run.attrs["system"]).motion(run)


@pytest.mark.parametrize("k", [0, 17, 120])
def test_bodies_are_where_they_are(runs, tmp_path, monkeypatch, k):
    wanted = many_bodies(121, drift=0.1)
    monkeypatch.setattr(gltf, "animation_of", lambda run: wanted)
    run = runs["rib"].isel(time=[0]).to_dataset().isel(time=np.zeros(121, dtype=int))
    gltf.write(run.assign_coords(time=wanted.time), str(tmp_path / "a.glb"), Request(speed=2.0))
    model = Model(tmp_path / "a.glb")
    assert model.time == pytest.approx(wanted.time / 2.0, abs=1e-6)
    drawn = model.drawn(k, wanted.up)
    for frame in wanted.frames:
        turn = Rotation.from_quat(frame.attitude[k][[1, 2, 3, 0]])
        for solid, points in zip(frame.solids, drawn[frame.name], strict=True):
            vertices = turn.apply(solid.placed(solid.mesh(sectors=32, cells=1).vertices, k)) + frame.origin[k]
            assert points.min(axis=0) == pytest.approx(vertices.min(axis=0), abs=1e-5)
            assert points.max(axis=0) == pytest.approx(vertices.max(axis=0), abs=1e-5)
            away = np.linalg.norm(points[:, None] - vertices[None], axis=2).min(axis=1)
            assert away.max() < 1e-5


@pytest.mark.parametrize("name", ["heliogyro", "rib", "stand"])
def test_lines_follow_their_points(runs, tmp_path, name):
    run, wanted = runs[name], motion(runs[name])
    said = gltf.write(run, str(tmp_path / "a.glb"), Request())
    assert f"a.glb: {run.sizes['time']} samples, " in said
    model = Model(tmp_path / "a.glb")
    numbers = {node["name"]: k for k, node in enumerate(model.nodes)}
    for k in (0, run.sizes["time"] - 1):
        for line in wanted.lines:
            ends = np.stack([line.points[k, :-1], line.points[k, 1:]], axis=1)
            for i, pair in enumerate(ends):
                if not np.all(np.isfinite(pair)) or np.array_equal(*pair):
                    continue
                at = model.placed(numbers[f"{line.name} {i + 1}"], np.array([[-0.5, 0, 0], [0.5, 0, 0]]), k)
                assert upright(at, wanted.up) == pytest.approx(pair, abs=2e-6 * wanted.reach)


def test_turns_are_short_from_sample_to_sample(runs, tmp_path):
    """A viewer takes the shorter way between quaternions, by their signs; q and -q are the same attitude."""
    gltf.write(runs["heliogyro"], str(tmp_path / "a.glb"), Request())
    model = Model(tmp_path / "a.glb")
    turns = [values for (_, path), values in model.moves.items() if path == "rotation"]
    assert turns
    for values in turns:
        assert np.linalg.norm(values, axis=1) == pytest.approx(np.ones(len(values)), abs=1e-6)
        assert np.all(np.sum(values[1:] * values[:-1], axis=1) >= 0.0)


def test_turns_that_are_not_seen_are_told(runs, tmp_path):
    said = gltf.write(runs["heliogyro"], str(tmp_path / "a.glb"), Request(frames=3))
    assert "'body' turns by more than half a turn between samples, which is not seen: raise --frames" in said
    assert "half a turn" not in gltf.write(runs["heliogyro"], str(tmp_path / "a.glb"), Request())


def test_single_precision_far_from_the_origin_is_told(runs, tmp_path, monkeypatch):
    near = many_bodies(121)
    origin = np.broadcast_to([7e6, 0.0, 0.0], (121, 3))
    far = near.carried(origin, np.tile([1.0, 0.0, 0.0, 0.0], (121, 1)))
    run = runs["rib"].isel(time=[0]).to_dataset().isel(time=np.zeros(121, dtype=int)).assign_coords(time=near.time)
    for moved, axes, told in ((near, None, False), (far, None, True), (far, "body", False)):
        monkeypatch.setattr(gltf, "animation_of", lambda run, moved=moved: moved)
        said = gltf.write(run, str(tmp_path / "a.glb"), Request(axes=axes))
        assert ("positions are rounded to 420 mm: take --axes body" in said) is told


def test_a_symbol_vanishes_at_the_sample_at_which_its_joint_is_released(released, tmp_path):
    gltf.write(released, str(tmp_path / "a.glb"), Request())
    model, closed = Model(tmp_path / "a.glb"), released["pin"].closed.values > 0.5
    of = {one["name"]: k for k, one in enumerate(model.nodes) if "mesh" not in one}
    assert np.array_equal(model.moves[of["pin"], "scale"], np.repeat(closed[:, None], 3, axis=1))
    assert model.between[of["pin"], "scale"] == "STEP"
    assert (of["clamp"], "scale") not in model.moves


def test_a_single_sample_is_no_animation(runs, tmp_path):
    with pytest.raises(InputError, match="a single sample, which makes no animation"):
        gltf.write(runs["rib"].isel(time=[0]), str(tmp_path / "a.glb"), Request())
    assert not (tmp_path / "a.glb").exists()


def test_what_failed_has_its_label(failed, tmp_path):
    gltf.write(failed, str(tmp_path / "a.glb"), Request())
    assert "FAILED" in Model(tmp_path / "a.glb").nodes[0]["name"]
