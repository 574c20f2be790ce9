"""Files open again in what they are for, and hold what the run holds."""

import pathlib
import re
import xml.etree.ElementTree as ElementTree
import zlib

import imageio.v3 as imageio
import imageio_ffmpeg
import numpy as np
import pandas
import pytest
import xarray as xr
from scipy.io import loadmat

import evolvent
from evolvent import cases, parts
from evolvent.exports import matlab, moving, page, table, vtk, vtp
from evolvent.exports.request import LARGE, Request
from evolvent.results import variables
from evolvent.results.motion import Frame, Motion
from evolvent.results.rotations import from_rotation_vectors
from evolvent.results.solids import Solid
from evolvent_base import signals
from evolvent_base.errors import InputError
from many_bodies import many_bodies

SYSTEMS = ("heliogyro", "stand", "rib")


@pytest.fixture
def latching():
    """A panel that springs open and locks."""
    system = evolvent.System()
    system.add(parts.RigidBody(mass=1.0, shape={"box": (1.0, 0.5, 0.02)}, position=(0.5, 0.0, 0.0)), "panel")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="panel", type="revolute", axis=(0, 1, 0)), "pin")
    system.add(
        parts.JointSpring(
            joint="pin", start=0.0, rest=2.0, stiffness=0.5, latch="45 deg", latch_stiffness=50.0, latch_damping=0.5
        ),
        "hinge",
    )
    return system.simulate(until="3 s", every="0.05 s")


def motion(run):
    return cases.system(run.attrs["system"]).motion(run)


def grid(path):
    """Arrays of a .vtp file by name."""
    return {name: values for held in arrays(path).values() for name, values in held.items()}


def arrays(path):
    """Arrays of a .vtp file by element and name: after the first underscore, with a header and compressed."""
    head, _, rest = path.read_bytes().partition(b"<AppendedData")
    data = rest.partition(b"_")[2]
    root = ElementTree.fromstring(head.decode() + "</VTKFile>")
    assert root.get("compressor") == "vtkZLibDataCompressor"
    found = {}
    for element, array in ((owner, array) for owner in root.find("PolyData/Piece") for array in owner):
        at = int(array.get("offset"))
        count, size, rest_size, packed = np.frombuffer(data, "<u8", 4, at).tolist()
        assert (count, rest_size) == (1, 0)
        raw = zlib.decompress(data[at + 32 : at + 32 + packed])
        assert len(raw) == size
        values = np.frombuffer(raw, np.dtype(array.get("type").lower()))
        width = int(array.get("NumberOfComponents"))
        held = values if width == 1 else values.reshape(-1, width)
        found.setdefault(element.tag, {})[array.get("Name")] = held
    return found


def pieces(path):
    """Numbers of points, vertices and lines of a .vtp file."""
    head = path.read_bytes().partition(b"<AppendedData")[0]
    piece = ElementTree.fromstring(head.decode() + "</VTKFile>").find("PolyData/Piece")
    return tuple(int(piece.get(f"NumberOf{what}")) for what in ("Points", "Verts", "Lines"))


def steps(folder, kind):
    """Times and files of a collection."""
    root = ElementTree.parse(folder / f"{kind}.pvd").getroot()
    return [(float(d.get("timestep")), folder / d.get("file")) for d in root.iter("DataSet")]


# ------------------------------------------------------------------------------------------------ ParaView


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_vtk_holds_points_values_and_forces(runs, tmp_path, name):
    run, wanted = runs[name], motion(runs[name])
    said = vtk.write(run, str(tmp_path / "out"), Request())
    kinds = {
        "stand": ["lines", "bodies", "forces", "marks", "frames"],
        "rib": ["lines", "strips", "bodies", "symbols", "forces", "marks", "frames"],
    }
    named = kinds.get(name, ["lines", "bodies", "forces", "frames"])
    assert said.startswith(", ".join(f"{kind}.pvd" for kind in named) + " in ")
    found = steps(tmp_path / "out", "lines")
    assert [time for time, _ in found] == pytest.approx(run.time.values.tolist())
    for k in (0, len(found) - 1):
        lines = grid(found[k][1])
        assert np.array_equal(lines["points"], np.concatenate([s.points[k] for s in wanted.lines]))
        for value in wanted.lines[0].values:
            expected = np.concatenate([s.values[value][k] for s in wanted.lines])
            assert np.array_equal(lines[value], expected, equal_nan=True)
        assert pieces(found[k][1]) == (len(lines["points"]), 0, len(wanted.lines))
        assert lines["offsets"].tolist() == np.cumsum([s.points.shape[1] for s in wanted.lines]).tolist()
        forces = grid(steps(tmp_path / "out", "forces")[k][1])
        assert pieces(steps(tmp_path / "out", "forces")[k][1]) == (len(forces["points"]), len(forces["points"]), 0)
        assert np.array_equal(forces["points"], np.concatenate([f.points[k] for f in wanted.forces]))
        pushed = [f.vectors[k] if f.unit == "N" else np.full_like(f.vectors[k], np.nan) for f in wanted.forces]
        assert np.array_equal(forces["force [N]"], np.concatenate(pushed), equal_nan=True)
        frame = grid(steps(tmp_path / "out", "frames")[k][1])
        tips = frame["points"][-6:].reshape(3, 2, 3)
        assert tips[:, 0] == pytest.approx(np.tile(wanted.frames[0].origin[k], (3, 1)), abs=1e-12)
        axes = tips[:, 1] - tips[:, 0]
        assert axes @ axes.T == pytest.approx(np.eye(3) * (0.25 * wanted.reach) ** 2, abs=1e-9)
    text = (tmp_path / "out" / "about.txt").read_text()
    assert "status: success" in text
    assert run.attrs["case"] in text


@pytest.mark.parametrize("name", SYSTEMS)
def test_vtk_itself_reads_lines_vectors_and_times(runs, tmp_path, name):
    pyvista = pytest.importorskip("pyvista", reason="VTK's own reader is half a gigabyte and is not installed here")
    wanted = motion(runs[name]).in_body()
    vtk.write(runs[name], str(tmp_path), Request(axes="body", frames=4))
    reader = pyvista.get_reader(tmp_path / "lines.pvd")
    times = runs[name].time.values[np.linspace(0, runs[name].sizes["time"] - 1, 4).round().astype(int)]
    assert reader.time_values == pytest.approx(times.tolist())
    reader.set_active_time_value(reader.time_values[-1])
    grid = reader.read()[0]
    assert grid.n_cells == len(wanted.lines)
    assert grid.n_lines == len(wanted.lines)
    for k, strand in enumerate(wanted.lines):
        assert np.array_equal(grid.get_cell(k).points, strand.points[-1])
        value = next(iter(strand.values))
        assert np.array_equal(
            grid.point_data[value][grid.get_cell(k).point_ids], strand.values[value][-1], equal_nan=True
        )
    forces = pyvista.get_reader(tmp_path / "forces.pvd")
    forces.set_active_time_value(forces.time_values[-1])
    assert forces.read()[0].point_data["force [N]"].shape == (wanted.forces[0].points.shape[1], 3)
    frames = pyvista.get_reader(tmp_path / "frames.pvd").read()[0]
    assert sorted(set(frames.cell_data["axis"])) == [-1, 0, 1, 2]


def test_vtk_of_several_bodies(runs, tmp_path, monkeypatch):
    """Strips as surfaces of their width, solids where their bodies are, moments beside forces, marks with a size."""
    wanted = many_bodies(runs["rib"].sizes["time"])
    monkeypatch.setattr(vtk, "motion_of", lambda run: wanted)
    vtk.write(runs["rib"], str(tmp_path), Request())
    k = 7
    strip = grid(steps(tmp_path, "strips")[k][1])
    assert pieces(steps(tmp_path, "strips")[k][1]) == (26, 0, 0)
    assert len(strip["offsets"]) == 12
    corners = strip["points"][strip["connectivity"].reshape(-1, 4)]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    long = np.linalg.norm(np.diff(wanted.lines[0].points[k], axis=0), axis=1)
    assert area == pytest.approx(0.12 * long, rel=1e-9)  # it bends in its plane's normal: no shear
    assert np.array_equal(strip["moment [N m]"][:13], wanted.lines[0].values["moment [N m]"][k])
    bodies = grid(steps(tmp_path, "bodies")[k][1])
    assert sorted(set(bodies["body"])) == [1, 2, 3]
    used = bodies["connectivity"].reshape(-1, 4)[bodies["body"] == 3]
    away = np.linalg.norm(bodies["points"][used] - wanted.frames[2].origin[k], axis=-1)
    assert away == pytest.approx(np.full(away.shape, 0.15))
    forces = grid(steps(tmp_path, "forces")[k][1])
    assert np.array_equal(forces["force [N]"][0], wanted.forces[0].vectors[k, 0])
    assert np.array_equal(forces["moment [N m]"][1], wanted.forces[1].vectors[k, 0])
    assert np.isnan(forces["force [N]"][1]).all()
    marks = grid(steps(tmp_path, "marks")[k][1])
    assert marks["size [m]"].tolist() == [0.0, 0.15]
    text = (tmp_path / "about.txt").read_text()
    assert "boom with their width" in text
    assert "solids of bus, panel, ball" in text


def test_vtk_ends_with_the_symbols_and_marks_of_a_released_joint(released, tmp_path):
    vtk.write(released, str(tmp_path), Request())
    drawn, closed = motion(released), released["pin"].closed.values > 0.5
    assert 2 < closed.sum() < closed.size - 2
    of = {name: 1 + list(dict.fromkeys(x.name for x in drawn.symbols)).index(name) for name in ("pin", "clamp")}
    mark = 1 + [x.name for x in drawn.marks].index("pin")
    for k, holds in enumerate(closed):
        symbols, marks = (grid(tmp_path / "data" / f"{kind}-{k:05d}.vtp") for kind in ("symbols", "marks"))
        assert [number in symbols["part"] for number in of.values()] == [holds, True]
        assert (mark in marks["kind"]) == holds
        assert np.isfinite(marks["points"]).all()
    without = vtk.Grid(vtp.POLYS)
    without.write(str(tmp_path / "none.vtp"))
    assert pieces(tmp_path / "none.vtp") == (0, 0, 0)


def test_vtk_again_leaves_nothing_old(runs, tmp_path):
    (tmp_path / "mine.txt").write_text("stays")
    vtk.write(runs["stand"], str(tmp_path), Request(frames=20))
    vtk.write(runs["stand"], str(tmp_path), Request(frames=1))
    assert sorted(p.name for p in (tmp_path / "data").iterdir()) == [
        f"{kind}-00000.vtp" for kind in ("bodies", "forces", "frames", "lines", "marks")
    ]
    assert (tmp_path / "mine.txt").read_text() == "stays"


def test_five_boxes_are_one_small_file_a_sample(tmp_path, runs, monkeypatch):
    """Six faces a box, once in the file of a sample, compressed: 31 kB a sample of bodies before."""
    count = 40
    time = np.linspace(0.0, 1.0, count)
    turn = np.stack([0.3 * time, time, 0.0 * time], axis=1)
    frames = [
        Frame(
            name=f"box {n}",
            origin=np.stack([2.0 * n + time, time**2, 0.0 * time], axis=1),
            attitude=from_rotation_vectors((n + 1.0) * turn),
            solids=[Solid.box((1.0, 0.5, 0.3))],
        )
        for n in range(5)
    ]
    wanted = Motion(title="boxes", time=time, frames=frames)
    monkeypatch.setattr(vtk, "motion_of", lambda run: wanted)
    vtk.write(of_size(count).assign_attrs(runs["rib"].attrs), str(tmp_path), Request())
    files = steps(tmp_path, "bodies")
    assert len(files) == count
    assert [time for time, _ in files] == time.tolist()
    assert max(path.stat().st_size for _, path in files) < 4000
    body = grid(files[-1][1])
    assert len(body["offsets"]) == 30
    corners = body["points"][body["connectivity"].reshape(-1, 4)]
    across = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    areas = 0.5 * np.linalg.norm(across, axis=1)
    assert sorted(areas) == pytest.approx(sorted([0.5, 0.5, 0.3, 0.3, 0.15, 0.15] * 5))
    for n, frame in enumerate(frames, 1):
        own = corners[body["body"] == n]
        assert own.reshape(-1, 3).mean(axis=0) == pytest.approx(frame.origin[-1])
        outward = np.sum(across[body["body"] == n] * (own.mean(axis=1) - frame.origin[-1]), axis=1)
        assert np.all(outward > 0.0)


def test_a_collection_names_files_of_its_own_folder(tmp_path):
    """Texts are escaped, paths relative with '/', so that a folder can be moved."""
    vtp.write_collection(str(tmp_path / "a.pvd"), [(0.1, str(tmp_path / "data" / 'a & "b".vtp'))])
    (entry,) = ElementTree.parse(tmp_path / "a.pvd").getroot().iter("DataSet")
    assert (entry.get("timestep"), entry.get("file")) == ("0.1", 'data/a & "b".vtp')


# ------------------------------------------------------------------------------------------------ tables


@pytest.mark.parametrize("name", SYSTEMS)
def test_tables_hold_the_run(runs, tmp_path, name):
    run, wanted = runs[name], motion(runs[name])
    table.write(run, str(tmp_path), Request())
    series = pandas.read_csv(tmp_path / "series.csv")
    assert np.array_equal(series["time [s]"], run.time.values)
    assert np.array_equal(series["energy_kinetic [J]"], run.energy_kinetic.values)
    for heading, values in {
        "heliogyro": {"deployed_length blade 2 [m]": lambda: run.deployed_length.values[:, 1]},
        "stand": {"spring-3.force [N]": lambda: run["spring-3"].force.values},
        "rib": {
            "energy_losses mass damping [J]": lambda: run.energy_losses.values[:, 0],
            "momentum y [kg m s-1]": lambda: run.momentum.values[:, 1],
        },
    }[name].items():
        assert np.array_equal(series[heading], values())
    shapes = pandas.read_csv(tmp_path / "shapes.csv")
    one = shapes[(shapes["line"] == wanted.lines[-1].name) & (shapes["time [s]"] == run.time.values[-1])]
    strand = wanted.lines[-1]
    assert np.array_equal(one[["x [m]", "y [m]", "z [m]"]], strand.points[-1])
    for value, expected in strand.values.items():
        assert np.array_equal(one[value], expected[-1], equal_nan=True)
    bodies = pandas.read_csv(tmp_path / "bodies.csv")
    assert np.array_equal(bodies[[f"quaternion {c}" for c in "wxyz"]], wanted.frames[0].attitude)
    columns = pandas.read_csv(tmp_path / "columns.csv").set_index("name")
    assert columns.loc["energy_kinetic", "unit"] == "J"
    about = pandas.read_csv(tmp_path / "about.csv").set_index("what")["text"]
    assert (about["status"], about["case"]) == ("success", run.attrs["case"])
    listed = pandas.read_csv(tmp_path / "results.csv").set_index("name")
    assert listed["value"].dtype.kind == "f"
    for number in cases.system(run.attrs["system"]).numbers(run):
        assert listed["text"][number.label] == number.value
        for one in number.quantities:
            row = listed.loc[f"{number.label}: {one.what}" if one.what else number.label]
            assert (row["value"], row["unit"]) == (one.value, one.unit)


#: Results that are words; all others have a number.
WORDS = {"warning", "method", "more variables"}


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_result_has_the_numbers_of_its_text(runs, name):
    """With their units: each number of a text is a quantity, but for a factor of a prefix, within its digits."""
    for number in cases.system(runs[name].attrs["system"]).numbers(runs[name]):
        if number.label in WORDS:
            continue
        assert number.quantities, number
        first = re.match(r"-?[\d,]+(?:\.\d+)?(?:e-?\d+)?", number.value)
        if first is not None and not number.quantities[0].what:
            own, shown = number.quantities[0].value, float(first[0].replace(",", ""))
            scaled = [abs(own), 1e3 * abs(own), 1e6 * abs(own)]
            assert shown == own == 0.0 or any(shown == pytest.approx(x, rel=6e-2) for x in scaled), number
        assert all(one.unit for one in number.quantities)


def test_a_table_with_decimal_commas(runs, tmp_path):
    """A spreadsheet of most of Europe: commas for decimals, semicolons between columns, the same numbers."""
    table.write(runs["rib"], str(tmp_path / "point"), Request())
    table.write(runs["rib"], str(tmp_path / "comma"), Request(decimal=","))
    names = sorted(path.name for path in (tmp_path / "point").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "comma").iterdir())
    for name in names:
        one = pandas.read_csv(tmp_path / "point" / name)
        other = pandas.read_csv(tmp_path / "comma" / name, sep=";", decimal=",")
        pandas.testing.assert_frame_equal(one, other)
    raw = (tmp_path / "comma" / "series.csv").read_text(encoding="utf-8-sig").splitlines()
    assert "." not in raw[3]
    assert "," in raw[3]
    with pytest.raises(InputError, match=r"decimal is ';'; it must be '\.' or ','"):
        Request(decimal=";")


def test_events_are_a_table(latching, tmp_path):
    table.write(latching, str(tmp_path), Request())
    (row,) = pandas.read_csv(tmp_path / "events.csv").to_numpy().tolist()
    assert row == [latching.ev.latches.time.item(), "hinge", "latched"]


@pytest.mark.parametrize("decimal", [".", ","])
def test_our_reader_reads_our_tables(runs, tmp_path, decimal):
    run = runs["heliogyro"]
    table.write(run, str(tmp_path), Request(decimal=decimal))
    found = signals.read(tmp_path / "series.csv")
    assert found.units[:2] == ("s", "J")
    for name, values in (("time", run.time), ("energy_kinetic", run.energy_kinetic)):
        assert np.array_equal(found.column(name), values.values)


def test_every_number_of_a_run_is_in_some_table(runs, tmp_path):
    run = variables.flat(runs["heliogyro"])
    table.write(runs["heliogyro"], str(tmp_path), Request())
    held = {path.stem for path in tmp_path.iterdir()}
    heads = {heading.partition(" ")[0] for heading in pandas.read_csv(tmp_path / "series.csv").columns}
    covered = {
        f"blade-1.{name}" for name in ("line", "line_tension", "line_signed_lag", "line_curvature")
    }  # shapes.csv
    covered |= {"blade-1.tension", "blade-1.signed_lag"}
    assert {str(n) for n, v in run.variables.items() if v.dims[:1] == ("time",)} == (heads | held | covered) & set(
        run.variables
    )
    velocity = pandas.read_csv(tmp_path / "blade-1.velocity.csv")
    wanted = run["blade-1.velocity"].values[:, 3, 1]
    assert np.array_equal(velocity["blade-1.velocity blade-1.node 3 y [m s-1]"], wanted)


# ------------------------------------------------------------------------------------------------ MATLAB


@pytest.mark.parametrize("name", SYSTEMS)
def test_mat_holds_the_run(runs, tmp_path, name):
    run, wanted = runs[name], motion(runs[name])
    matlab.write(run, str(tmp_path / "run.mat"), Request())
    found = loadmat(tmp_path / "run.mat", squeeze_me=True, struct_as_record=False)["run"]
    for full, variable in variables.flat(run).variables.items():
        key = re.sub(r"\W", "_", str(full).replace(".", "__"))
        values = getattr(found.data, key)
        if variable.dtype.kind in "biuf":
            assert np.array_equal(values, np.squeeze(variable.values), equal_nan=True), key
        else:
            assert list(values) == list(variable.values)
        unit = getattr(found.units, key)
        assert (unit if isinstance(unit, str) else "") == variable.attrs.get("units", "")
    assert found.case == run.attrs["case"]
    assert found.about.status == "success"
    assert found.meaning.energy_kinetic == run.energy_kinetic.attrs["long_name"]
    lines = np.atleast_1d(found.lines)
    assert [line.name for line in lines] == [s.name for s in wanted.lines]
    assert np.array_equal(lines[-1].points, wanted.lines[-1].points)
    assert hasattr(lines[0].values, {"stand": "force_N", "rib": "axial_force_N"}.get(name, "tension_N"))
    body = np.atleast_1d(found.bodies)[0]
    assert np.array_equal(body.position, wanted.frames[0].origin)
    assert np.array_equal(body.quaternion, wanted.frames[0].attitude)
    assert np.atleast_1d(found.forces)[0].unit == "N"
    raw = loadmat(tmp_path / "run.mat")["run"]["data"][0, 0]["time"][0, 0]
    assert raw.shape == (run.sizes["time"], 1)


def test_mat_has_latches_events_and_results(tmp_path, latching):
    """As struct arrays, with the values that the run itself has."""
    matlab.write(latching, str(tmp_path / "run.mat"), Request())
    found = loadmat(tmp_path / "run.mat", squeeze_me=True, struct_as_record=False)["run"]
    latch, wanted = found.latches, latching.ev.latches
    assert (latch.name, latch.time, latch.peak) == ("hinge", wanted.time.item(), wanted.peak.item())
    assert (latch.rate_unit, latch.peak_unit, latch.work) == ("rad/s", "N m", wanted.work.item())
    assert (found.events.part, found.events.what) == ("hinge", "latched")
    assert found.events.time == pytest.approx(wanted.time.item(), rel=1e-12)
    assert found.statistics.steps == latching.ev.statistics["steps"]
    rows = {row.name: (row.value, row.unit) for row in found.results}
    assert rows["hinge, latch: time"] == (latch.time, "s")
    assert rows["hinge, latch: rate"] == (pytest.approx(np.degrees(abs(latch.rate))), "deg/s")
    assert {row.name for row in np.atleast_1d(found.marks)} == {mark.name for mark in motion(latching).marks}
    assert found.names.hinge__angle == "hinge.angle"


def test_mat_of_a_run_without_latches_has_empty_tables(runs, tmp_path):
    matlab.write(runs["rib"], str(tmp_path / "run.mat"), Request())
    found = loadmat(tmp_path / "run.mat", squeeze_me=True, struct_as_record=False)["run"]
    assert np.size(found.latches) == 0
    assert "latched" not in {str(one.what) for one in np.atleast_1d(found.events)}


def test_fields_of_structs_are_names_of_matlab():
    long = f"{'a very long name of a part ' * 3}.energy_kinetic"
    names = ["1.rate", "Träger 1.rate", "end", "a b.c", "a_b.c", "A_b.c", long, f"{long}_2", "_x", "tip 1.position", ""]
    found = matlab._fields(names)
    assert list(found) == names
    assert len(set(found.values())) == len(names)
    for field in found.values():
        assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", field)
    assert found["end"] == "x_end"
    assert found["tip 1.position"] == "tip_1__position"
    assert found[long].endswith("__energy_kinetic")


# ------------------------------------------------------------------------------------------------ films


@pytest.mark.slow
def test_gif_opens_again(runs, tmp_path):
    path = str(tmp_path / "a.gif")
    said = moving.gif(runs["rib"], path, Request(frames=9, speed=2.0))
    assert "9 frames in 2 s, 2 times real time" in said
    film = imageio.imread(path)
    assert film.shape == (9, 600, 800, 3)
    moved = [np.abs(film[k + 1].astype(int) - film[k]).max() for k in range(8)]
    assert min(moved) > 50
    # 8 intervals in 2 s, and the last picture for as long
    assert imageio.immeta(path)["duration"] == pytest.approx(250, abs=10)


# the reader leaves the pipes of its ffmpeg to the collector
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:Exception ignored in:pytest.PytestUnraisableExceptionWarning")
def test_mp4_opens_again(runs, tmp_path):
    path = str(tmp_path / "a.mp4")
    moving.mp4(runs["stand"], path, Request(frames=12, speed=1.0, axes="inertial"))
    with imageio.imopen(path, "r") as file:
        film = file.read()
    assert film.shape == (12, 720, 1280, 3)
    assert np.abs(film[6].astype(int) - film[0]).max() > 50
    frames, duration = imageio_ffmpeg.count_frames_and_secs(path)
    assert (frames, duration) == (12, pytest.approx(12 / 11 * 3.0, rel=0.05))


def test_a_film_without_ffmpeg_is_refused_in_a_sentence(runs, tmp_path, monkeypatch):
    def none():
        raise RuntimeError("no ffmpeg")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", none)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"--to mp4 needs ffmpeg.*evolvent\[export\].*--to gif does without"):
        moving.mp4(runs["stand"], str(tmp_path / "a.mp4"), Request())
    assert not (tmp_path / "a.mp4").exists()


def test_ffmpeg_that_fails_is_told_in_a_sentence(runs, tmp_path, monkeypatch):
    bad = tmp_path / "ffmpeg"
    bad.write_text("#!/bin/sh\necho 'no such encoder' >&2\nexit 3\n")
    bad.chmod(0o755)
    monkeypatch.setattr(moving, "ffmpeg", lambda: str(bad))
    with pytest.raises(InputError, match="ffmpeg says: no such encoder"):
        moving.mp4(runs["stand"], str(tmp_path / "a.mp4"), Request(frames=5))
    assert [p.name for p in tmp_path.iterdir()] == ["ffmpeg"]


def test_html_keeps_frames_and_speed(runs, tmp_path):
    said = page.write(runs["rib"], str(tmp_path / "a.html"), Request(frames=7, speed=3.0))
    assert f"7 frames of {runs['rib'].sizes['time']} samples" in said
    text = (tmp_path / "a.html").read_text()
    assert '"speed":3.0' in text
    assert '{"name":"time","shape":[7]' in text


# ------------------------------------------------------------------------------------------------ sizes and labels


def test_nothing_enormous_without_being_told():
    with pytest.raises(InputError, match=r"may take up to 201 MB; write fewer \(--frames\), or everything"):
        Request().allow(LARGE + 1e6, "this")
    Request(large=True).allow(1e12, "this")


def of_size(count, fine=()):
    """A run with so many samples, some of them fine ones."""
    marks = {"fine_sample": ("time", np.isin(np.arange(count), fine).astype(np.int8))} if fine else {}
    return xr.Dataset(marks, {"time": np.linspace(0.0, 1.0, count)})


def test_samples_of_a_request():
    assert Request().samples(of_size(5)).tolist() == [0, 1, 2, 3, 4]
    assert Request().samples(of_size(1000), most=3).tolist() == [0, 500, 999]
    assert Request(frames=4).samples(of_size(1000), most=3).size == 4
    assert Request(frames=1).samples(of_size(9)).tolist() == [8]
    assert Request().samples(of_size(9, fine=[2, 3, 5])).size == 9
    assert Request(frames=4).samples(of_size(9, fine=[2, 3, 5])).tolist() == [0, 4, 6, 8]


@pytest.mark.parametrize("kind", ["vtk", "table", "matlab", "page"])
def test_a_run_that_failed_is_written_with_its_label(failed, tmp_path, kind):
    module = {"vtk": vtk, "table": table, "matlab": matlab, "page": page}[kind]
    path = tmp_path / "out"
    module.write(failed, str(path), Request())
    if kind == "vtk":
        assert (path / "lines-failed.pvd").exists()
        assert "status: failed" in (path / "about.txt").read_text()
    elif kind == "table":
        series = pandas.read_csv(path / "series.csv")
        assert len(series) == failed.sizes["time"]
        assert series["run status"].str.startswith("FAILED: the energy balance is off").all()
    elif kind == "matlab":
        found = loadmat(path, appendmat=False, squeeze_me=True, struct_as_record=False)["run"]
        assert (found.about.status, found.about.message) == ("failed", failed.attrs["message"])
    else:
        assert "- FAILED: the energy balance is off" in path.read_text()


@pytest.mark.slow
def test_a_film_of_a_failed_run_is_labelled(runs, failed, tmp_path):
    moving.gif(failed, str(tmp_path / "a.gif"), Request(frames=2))
    moving.gif(runs["heliogyro"], str(tmp_path / "b.gif"), Request(frames=2))

    def red(path: pathlib.Path) -> int:
        film = imageio.imread(path)[-1].astype(int)
        return int(((film[..., 0] > 140) & (film[..., 1] < 60)).sum())

    # forces are drawn in a red of their own
    assert red(tmp_path / "a.gif") > red(tmp_path / "b.gif") + 500


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_single_sample_has_tables_and_no_animation(runs, tmp_path, name):
    one = runs[name].isel(time=[0])
    with pytest.raises(InputError, match="a single sample, which makes no animation; --to vtk, csv and mat accept it"):
        page.write(one, str(tmp_path / "a.html"), Request())
    assert ": 1 sample, " in vtk.write(one, str(tmp_path / "v"), Request())
    table.write(one, str(tmp_path / "t"), Request())
    matlab.write(one, str(tmp_path / "a.mat"), Request())
    vtk.write(one, str(tmp_path / "v"), Request())
    assert len(pandas.read_csv(tmp_path / "t" / "series.csv")) == 1
