"""Sheets that fold: the case `miura-sheet`, rigid and flexible facets, what is conserved."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import parts
from evolvent.elements import fold_files
from evolvent_base.errors import InputError

WALL: dict[str, Any] = {
    "thickness": "2 mm", "material": {"young_modulus": 60e9, "poisson_ratio": 0.3, "density": 1600.0},
}  # fmt: skip
CREASE: dict[str, Any] = {"stiffness": 0.4, "damping": 0.4, "rest": "20 deg", "fold_angle": "150 deg"}


@pytest.fixture
def path(tmp_path: pathlib.Path) -> str:
    found = str(tmp_path / "sheet.fold")
    fold_files.write_miura(found, facets=(2, 2), sides=(0.125, 0.125), angle=60.0)
    return found


def sheet(path: str, **keys: Any) -> ev.System:
    system = ev.System()
    system.add(parts.Origami(**({"file": path} | WALL | CREASE | keys)), "sheet")
    return system


def spreads(run: Any, pattern: fold_files.Pattern) -> np.ndarray:
    """Largest difference (nt,) of the fold angles of a class of creases, rad."""
    angles = np.abs(run["sheet"]["fold_angle"].values)
    zigzag = np.array([abs(one.begin - one.end) == 1 for one in pattern.creases])
    return np.maximum(*(np.ptp(angles[:, own], axis=1) for own in (zigzag, ~zigzag)))


def test_case_unfolds_and_latches() -> None:
    """64 rigid panels: creases of a class are equal to 5e-9, and latch together; the energy balance closes."""
    run = ev.run("miura-sheet", {"simulate.until": 2.9, "simulate.step": 0.02})
    pattern = fold_files.read("miura-8x8", "")
    assert len(pattern.facets) == 64
    angles = np.degrees(np.abs(run["sheet"]["fold_angle"].values)).max(axis=1)
    assert angles[0] == pytest.approx(150.0, abs=1e-9)
    assert angles[-1] == pytest.approx(30.0, abs=1.0)
    springs = [run[f"sheet crease {one.edge} spring"] for one in pattern.creases]
    locked = np.array([float(one["latch_time"].values[-1]) for one in springs])
    assert np.ptp(locked) < 1e-9
    before, spread = run["time"].values < locked[0] - 0.02, spreads(run, pattern)
    assert spread[before].max() < 5e-9
    assert spread[-1] < 5e-9
    assert spread.max() < 1e-6  # samples between ends of steps, which are interpolated
    assert springs[0]["angle"].values == pytest.approx(run["sheet"]["fold_angle"].values[:, 0], abs=1e-12)
    moved = float(run["energy_moved"].values.max())
    assert np.abs(run["energy_defect"].values).max() < 1e-9 * moved
    stored = float(run["sheet"]["crease_energy"].values[0])
    assert stored == pytest.approx(sum(float(one["energy_elastic"].values[0]) for one in springs), rel=1e-12)


def test_energy_of_creases_is_that_of_the_closed_form(path: str) -> None:
    """k l (angle - rest)^2/2 over four creases, with the angles of the closed form; of seams of flexible facets too."""
    first, rest = (np.radians(value) * 0.5 for value in (150.0, 20.0))
    straight = [2.0 * np.arctan(np.cos(np.radians(60.0)) * np.tan(one)) for one in (first, rest)]
    wanted = 2.0 * 0.5 * 0.4 * 0.125 * ((2.0 * (first - rest)) ** 2 + (straight[0] - straight[1]) ** 2)
    for facets in ("rigid", "flexible"):
        run = sheet(path, facets=facets).simulate(until=1e-3, step=1e-3, method="energy-momentum")
        assert float(run["sheet"]["crease_energy"].values[0]) == pytest.approx(wanted, rel=1e-10), facets
        assert np.degrees(np.abs(run["sheet"]["fold_angle"].values[0]).max()) == pytest.approx(150.0, abs=1e-7)


def test_flexible_facets_approach_rigid_ones(path: str) -> None:
    """Free sheets of the same mass per area: the stiffer the facets, the nearer to the rigid ones."""
    settings: Any = {"until": 0.2, "every": 0.02, "method": "energy-momentum", "spectral_radius": 0.5}
    rigid = sheet(path).simulate(step=0.01, **settings)["sheet"]["fold_angle"].values
    off = []
    for modulus in (60e5, 60e7, 60e9):
        wall = {"thickness": "2 mm", "material": {"young_modulus": modulus, "poisson_ratio": 0.3, "density": 1600.0}}
        run = sheet(path, facets="flexible", stiffness_damping="1 ms", **wall).simulate(tolerance=1e-3, **settings)
        off.append(float(np.abs(run["sheet"]["fold_angle"].values[-1] - rigid[-1]).max()))
        assert np.abs(run["momentum"].values).max() < 1e-6
    assert off[0] > 2.0 * off[1] > 2.0 * off[2]
    assert off[2] < 0.02


def test_flexible_sheet_latches_crease_by_crease(path: str) -> None:
    """All nodes of a crease lock at once, when those of rigid facets do; no constraints repeat; energy is kept."""
    latch: Any = {"latch": "30 deg", "latch_stiffness": 5.0, "latch_damping": 0.3, "held": [0]}
    settings: Any = {"until": 2.9, "every": 0.1, "method": "energy-momentum", "spectral_radius": 0.5}
    flexible = sheet(path, facets="flexible", stiffness_damping="0.5 ms", **latch)
    run = flexible.simulate(tolerance=1e-3, **settings)
    rigid = sheet(path, **latch).simulate(step=0.01, **settings)
    assert "redundant" in rigid.attrs["message"]
    assert "redundant" not in run.attrs["message"]
    for crease in fold_files.read(path, "").creases:
        name = f"sheet crease {crease.edge}"
        wanted = float(rigid[f"{name} spring"]["latch_time"].values[-1])
        times = [float(run[f"{name} spring {node}"]["latch_time"].values[-1]) for node in range(3)]
        assert times == pytest.approx([times[0]] * 3, abs=0.0)
        assert times[0] == pytest.approx(wanted, rel=1e-2)
        assert run[name]["latched"].values[-1] == 1.0
        ends = (one["sheet"]["fold_angle"].sel(crease=crease.edge).values[-1] for one in (run, rigid))
        assert next(ends) == pytest.approx(next(ends), abs=np.radians(0.05))
    assert np.abs(run["energy_defect"].values).max() < 1e-4 * float(run["energy_moved"].values.max())


def test_facets_that_touch_do_not_pass_one_another(tmp_path: pathlib.Path) -> None:
    """Three panels that fold like a Z: with contacts they stop before h/l from half a turn, without they pass it."""
    path = tmp_path / "three.fold"
    path.write_text(
        """{"frame_unit": "m", "vertices_coords": [[0, 0], [0.2, 0], [0.4, 0], [0.6, 0], [0, 0.1], [0.2, 0.1],
        [0.4, 0.1], [0.6, 0.1]],
        "edges_vertices": [[0, 1], [1, 2], [2, 3], [4, 5], [5, 6], [6, 7], [0, 4], [1, 5], [2, 6], [3, 7]],
        "edges_assignment": ["B", "B", "B", "B", "B", "B", "B", "M", "V", "B"]}""",
        "utf-8",
    )
    keys: Any = {"facets": "flexible", "elements": 4, "stiffness_damping": "0.5 ms", "rest": "175 deg"}
    largest = []
    for touches in (False, True):
        system = sheet(str(path), **(keys | {"stiffness": 0.2, "damping": 0.02}))
        for k in range(2 if touches else 0):
            pair = {"a": f"sheet facet {k}", "b": f"sheet facet {k + 1}", "apart": "30 mm"}
            system.add(parts.Contact(**pair, stiffness="2e4 N/m", damping="2 s/m"), f"touch {k}")
        run = system.simulate(until=0.6, method="energy-momentum", tolerance=1e-3, spectral_radius=0.5)
        largest.append(np.degrees(np.abs(run["sheet"]["fold_angle"].values).max()))
        assert np.abs(run["momentum"].values).max() < 1e-6
    assert largest[0] > 183.0
    assert 177.0 < largest[1] < 180.0 - np.degrees(0.002 / 0.2)


def test_free_sheet_keeps_its_momenta(path: str) -> None:
    """Rigid facets and flexible ones, at rest at the start; energy is that of the start but for what dampers take."""
    for keys in ({}, {"facets": "flexible", "elements": 1}):
        run = sheet(path, **keys).simulate(until=0.1, step=0.01, method="energy-momentum", spectral_radius=1.0)
        moved = float(run["energy_moved"].values.max())
        assert np.abs(run["momentum"].values).max() < 1e-9
        assert np.abs(run["angular_momentum"].values).max() < 1e-9
        assert np.abs(run["energy_defect"].values).max() < 1e-6 * moved


def test_mass_of_flexible_facets(path: str) -> None:
    """Both kinds have the mass of the area; a facet that stays rigid beside flexible ones joins them."""
    area = 4 * 0.125**2 * np.sin(np.radians(60.0))
    for keys in ({}, {"facets": "flexible"}, {"facets": "flexible", "rigid": [0], "elements": 1}):
        bodies = sheet(path, **keys).assemble().model.bodies
        assert bodies["mass"][1:].sum() == pytest.approx(area * 0.002 * 1600.0, rel=1e-12)


def test_polygon_has_the_inertia_of_its_area(tmp_path: pathlib.Path) -> None:
    """A rectangle of two triangles and a rectangle: moments of the whole about its centre."""
    content = """{"frame_unit": "cm", "vertices_coords": [[0, 0], [30, 0], [30, 20], [0, 20], [60, 0], [60, 20]],
        "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2], [1, 4], [4, 5], [5, 2]],
        "edges_assignment": ["B", "M", "B", "B", "F", "B", "B", "B"]}"""
    path = tmp_path / "two.fold"
    path.write_text(content, "utf-8")
    bodies = sheet(str(path), fold_angle=0.0, rest=0.0).assemble().model.bodies[1:]
    assert len(bodies) == 3
    m, x = bodies["mass"], bodies["x0"]
    centre = m @ x / m.sum()
    assert centre == pytest.approx([0.3, 0.1, 0.0])
    whole = sum(
        J + one * ((r @ r) * np.eye(3) - np.outer(r, r))
        for J, one, r in zip(bodies["inertia"], m, x - centre, strict=True)
    )
    h = 0.002
    wanted = m.sum() / 12.0 * np.diag([0.2**2 + h**2, 0.6**2 + h**2, 0.2**2 + 0.6**2 + 2.0 * h**2])
    assert whole == pytest.approx(wanted, rel=1e-12, abs=1e-15)


def test_other_parts_refer_to_facets(path: str) -> None:
    """Also before the sheet is added; names that it does not write are refused."""
    system = ev.System()
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="sheet facet 3", type="clamp"), "root")
    system.add(parts.Origami(file=path, **WALL, **CREASE), "sheet")
    assert "sheet crease 2" in system.assemble().parts
    system.replace("root", parts.Joint(a=(0.0, 0.0, 0.0), b="sheet facet 9", type="clamp"))
    with pytest.raises(InputError, match="no body, point, beam or rod is called 'sheet facet 9'"):
        system.assemble()


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"fold_angle": 0.0}, "sheet starts flat with rigid facets"),
        ({"fold_angle": "180 deg"}, "sheet.fold_angle is 180 deg; it must be from 0 deg"),
        ({"rest": "-5 deg"}, "sheet.rest is -5 deg"),
        ({"latch": "30 deg"}, "sheet.latch_stiffness is 0.0"),
        ({"held": [4]}, r"sheet.held has the facet 4; .* has facets from 0 to 3"),
        ({"length_unit": "1 mm"}, "sheet.length_unit is 0.001 m, but frame_unit of .* is 1.0 m"),
        ({"thickness": None}, "sheet.thickness is missing"),
        ({"file": "nothing"}, "'nothing' is no file of a crease pattern; .* shipped one: miura-8x8"),
    ],
)
def test_bad_keys_are_refused(path: str, keys: dict[str, Any], why: str) -> None:
    """Each with one sentence that names the key."""
    with pytest.raises(InputError, match=why):
        sheet(path, **keys).assemble()
