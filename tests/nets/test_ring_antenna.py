"""A net on a ring of pantographs that opens: kinematics, form, deployment; the case `ring-antenna` in small."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from book import Book
from evolvent import cases
from evolvent.families.coordinates.part_poses import Linkage
from evolvent_base.errors import InputError

CHAPTER = "Threads, reels, tethers"
#: Length of a bar, m, and elevations of the bars where the ring is folded and open, rad.
BAR, FOLDED, OPEN = 2.65, math.radians(85.0), math.radians(30.0)

#: Joints at the hubs, which are elastic.
HUBS = ("rise root", "rise tip", "fall root", "fall tip")


def radius(count: int, elevation: float) -> float:
    """Radius of the hubs of a ring of `count` pantographs, m."""
    return BAR * math.cos(elevation) / (2.0 * math.sin(math.pi / count))


def content(count: int = 8, **net: Any) -> dict[str, Any]:
    """The case with `count` bays and one ring of triangles; keys of the net in place of its own."""
    found: dict[str, Any] = cases.content_of("ring-antenna")
    parts = found["parts"]
    c, s, folded, opened = (
        math.cos(math.pi / count), math.sin(math.pi / count), radius(count, FOLDED), radius(count, OPEN),
    )  # fmt: skip
    high, deep = BAR * math.sin(FOLDED), BAR * math.sin(OPEN)
    for part in parts.values():
        if "repeat" in part:
            part["repeat"] = part["repeat"] | {"count": count}
        if part["kind"] == "joint" and part["type"] == "revolute":
            part["axis"] = [c, s, 0.0]
    parts["pivot"]["axis"] = [-c, -s, 0.0]
    parts["top"]["position"], parts["foot"]["position"] = [folded, 0.0, high], [folded, 0.0, 0.0]
    parts["boom"]["a"] = [folded, 0.0, 0.0]
    for name, sense in (("rise", -1.0), ("fall", 1.0)):
        parts[name] |= {
            "position": [folded * c * c, folded * c * s, 0.5 * high],
            "orientation": {"euler": [0.0, sense * FOLDED, 0.5 * math.pi + math.pi / count], "order": "xyz"},
        }
    sag = opened**2 / (4.0 * 4.8)
    parts["net"] |= {
        "position": [folded - opened, 0.0, deep - sag],
        "surface": {"paraboloid": {"focal_length": 4.8, "diameter": 2.0 * opened}},
        "topology": {"rings": {"rings": 2, "gores": count, "held": "corners"}},
        "ties": {"rear": {"gap": deep - 2.0 * sag, "stiffness": 5e3}},
    } | net
    return found


@pytest.mark.parametrize("count", [4, 7])
def test_radius_by_the_angle(count: int, book: Book) -> None:
    """One pivot that moves opens the whole ring: hubs on regular polygons of the radius of its elevation."""
    found = content(count)
    del found["parts"]["net"]
    for name in HUBS:
        for key in ("stiffness", "rotational_stiffness", "damping"):
            del found["parts"][name][key]
    assembly = ev.load(found).assemble()
    linkage = Linkage(assembly, [])
    off = 0.0
    for elevation in (math.radians(60.0), OPEN):
        angle = 2.0 * (elevation - OPEN)
        assert linkage.move({assembly.index("spring 2", "coordinates"): angle}) == ""
        x = assembly.model.bodies["x"]
        size = radius(count, elevation)
        for name, height in (("top", BAR * math.sin(elevation)), ("foot", 0.0)):
            hubs = np.array([x[assembly.index(f"{name} {k + 1}", "bodies")] for k in range(count)])
            turns = 2.0 * math.pi * np.arange(count) / count
            wanted = size * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
            wanted += [radius(count, FOLDED) - size, 0.0, height]
            off = max(off, float(np.abs(hubs - wanted).max()))
        np.testing.assert_allclose(linkage.values(), angle, atol=1e-9)
    book(
        CHAPTER, f"Ring of {count} pantographs, places of its hubs by the angle of one pivot", reference="closed form",
        source="geometry", error=off / BAR, allowed=1e-9,
    )  # fmt: skip


def small(**net: Any) -> dict[str, Any]:
    """A ring of five bays with one node between its hubs above and below, whose springs and dampers open it in 3 s."""
    found = content(5, topology={"rings": {"rings": 1, "gores": 5, "held": "corners"}}, damping=0.2, **net)
    found["parts"]["spring"] |= {"stiffness": 40.0, "damping": 120.0, "latch_damping": 5000.0}
    for name in HUBS:
        found["parts"][name] |= {"stiffness": 1e6, "rotational_stiffness": 1e4, "damping": 1e3}
    return found


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any]:
    """The small antenna as a reflector, and its run with the lengths of that."""
    path: pathlib.Path = tmp_path_factory.mktemp("cut") / "cut.json"
    found = ev.load(small()).reflector()
    found.save(path)
    return found, ev.load(small(cut=str(path))).simulate(until=8.0, every=0.1)


def test_deployment(opened: tuple[Any, Any], book: Book) -> None:
    """Slack at the start, latched and taut at the end, as the reflector has it; the energy balance is closed."""
    found, run = opened
    net = run["net"]
    assert int(net.slack_cords.values[0]) == len(found.tension)
    assert int(net.slack_cords.values[-1]) == 0
    assert len(run.attrs["latches"].split(";")) == 5
    book(
        CHAPTER, "Ring antenna after its deployment, tensions", reference="reflector", source="equilibrium",
        error=float(np.abs(net.tension.values[-1] - found.tension).max() / found.tension.max()), allowed=2e-2,
    )  # fmt: skip
    assert np.abs(found.net.seen(net.position.values[-1]) - found.x).max() < 1e-3
    moved, defect = float(run["energy_moved"].values[-1]), float(np.abs(run["energy_defect"].values).max())
    book(
        CHAPTER, "Ring antenna that deploys its nets, energy balance", reference="closed", source="invariant",
        error=defect / moved, allowed=1e-4,
    )  # fmt: skip


def test_symmetric_opening(opened: tuple[Any, Any]) -> None:
    """All pivots open alike, and nodes on both sides of the plane through the boom mirror one another."""
    _, run = opened
    angles = np.array([run[f"spring {k + 1}"].angle.values for k in range(5)])
    assert np.ptp(angles, axis=0).max() < 5e-3  # the joints at the hubs yield
    x = run["net"].position.values
    mirrored = x * [1.0, -1.0, 1.0]
    off = np.linalg.norm(mirrored[:, :, None] - x[:, None], axis=-1).min(axis=2)
    assert off.max() < 1e-3


def test_virtual_work(opened: tuple[Any, Any], book: Book) -> None:
    """Latches and springs of all pivots hold what the nets pull at the hubs."""
    found, run = opened
    a, b = np.array(found.to_dict()["cords"]).T
    x = found.net.seen(run["net"].position.values[-1])
    pull = (run["net"].tension.values / run["net"].length.values)[-1][:, None] * (x[b] - x[a])
    force = np.zeros_like(x)
    np.add.at(force, a, pull)
    np.add.at(force, b, -pull)
    rim, n = found.topology.rim, len(found.topology.plan)
    out = x[rim] / np.linalg.norm(x[rim, :2], axis=1)[:, None] * [1.0, 1.0, 0.0]
    # by the elevation f the radius grows by -R tan f, the height of the upper hubs over the lower ones by L cos f
    across = float(((force[rim] + force[n + rim]) * out).sum())
    along = 0.5 * float((force[rim, 2] - force[n + rim, 2]).sum())
    moment = -across * radius(5, OPEN) * math.tan(OPEN) + along * BAR * math.cos(OPEN)
    torque = sum(float(run[f"spring {k + 1}"].torque.values[-1]) for k in range(5))
    book(
        CHAPTER, "Moment of the nets at the pivots of a ring", reference="torque of latches and springs",
        source="virtual work", error=abs(abs(2.0 * torque / moment) - 1.0), allowed=2e-2,
    )  # fmt: skip


def test_a_rim_of_bodies_and_the_ground() -> None:
    """Several bodies hold the nodes that are nearest to theirs; the ground is not one of them."""
    with pytest.raises(InputError, match="one rigid body or the ground holds the whole rim, several rigid bodies"):
        ev.load(content(5, rim=["top", "ground"])).assemble()
