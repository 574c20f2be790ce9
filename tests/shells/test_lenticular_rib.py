"""A lenticular rib of two shells, flat on a hub: energy, forces that hold it, release, and the lens beside a rod's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from book import Book
from evolvent import System, cases, parts
from evolvent.elements import Lenticular
from evolvent.solvers.modal.modes import modes
from shells.test_shell_kernels import energy

Array = np.ndarray
CASE, CHAPTER = "rib-lenticular-shell", "Statics of shells"
WALLS = ("outer wall", "inner wall")
#: Of the case: length, radius and angle of the arcs, radius of the coil, thickness of a wall, pressure of the belt; SI.
L, R, A, C, T, P = 0.6, 0.1, 0.6, 0.15016, 1.6e-4, 8000.0
WIDTH, TURN = R * A, L / C


def run_of(elements: tuple[int, int], **keys: Any) -> Any:
    """The case with another mesh, without the event at a node."""
    content = cases.content_of(CASE)
    del content["parts"]["out"]
    for wall in WALLS:
        content["parts"][wall]["elements"] = list(elements)
    for key, value in keys.items():
        cases.set_value(content, key.replace("__", "."), value)
    return ev.run(content).ev.regular()


def wall() -> Any:
    """Stiffness and mass of the wall."""
    return cases.load(CASE).parts["outer wall"].wall()


def test_energy_of_flattening_and_winding(book: Book) -> None:
    """At the start: bent along the outer wall in equal sense, the inner in opposite, and strained by their distance."""
    own, off = wall().stiffness, 4.0 * np.linspace(0.0, 1.0, 5) * np.linspace(1.0, 0.0, 5)
    D, along, across = own[3:6, 3:6], 1.0 / C, 1.0 / R - 4.0 * T / WIDTH**2
    bent, turned = 0.5 * (D[0, 0] * along**2 + D[1, 1] * across**2), D[0, 1] * along * across
    squares = float(np.mean(off[1:] ** 2 + off[1:] * off[:-1] + off[:-1] ** 2)) / 3.0  # of strains, T/2C in the middle
    strained = 0.5 * own[0, 0] * (0.5 * T / C) ** 2 * squares
    for name, turn, sense in zip(WALLS, (-turned, turned), ("equal", "opposite"), strict=True):
        system = System()
        system.add(cases.load(CASE).parts[name], "wall")
        assembly = system.assemble()
        book(
            CHAPTER, f"Wall of a lens, flattened and wound in {sense} sense (30 x 4): energy",
            reference="bending and membrane stiffness of the laminate", source="closed form",
            error=abs(energy(assembly, assembly.y) / ((bent + turn + strained) * L * WIDTH) - 1.0), allowed=0.01,
        )  # fmt: skip


@pytest.mark.slow
def test_forces_while_held(book: Book) -> None:
    """The hub carries the belt's pressure but on the root's nodes; its mount has the resultant over the arc."""
    run = run_of((10, 4), simulate__until=6e-3, simulate__step=1e-3, simulate__every=1e-3)
    pressed, arc = float(run["coil"]["normal_force"][-1]), np.array([1.0 - math.cos(TURN), -math.sin(TURN), 0.0])
    book(
        "Contact", "Lens held flat on a hub by a belt (10 x 4): force on the hub", reference="pressure times area",
        source="closed form", error=abs(pressed / (P * L * WIDTH * 19.0 / 20.0) - 1.0), allowed=0.05,
    )  # fmt: skip
    force, wanted = run["mount"]["force"].values[-1], P * WIDTH * C * arc
    book(
        "Contact", "Lens held flat on a hub by a belt (10 x 4): force on the hub's mount",
        reference="resultant over the arc", source="closed form",
        error=float(np.abs(force - wanted).max() / np.linalg.norm(wanted)), allowed=0.05,
    )  # fmt: skip


def test_release_keeps_energy() -> None:
    """Steps without numerical damping: what the walls dissipate closes the balance to round-off."""
    times = {"simulate__until": 3e-3, "simulate__step": 5e-4, "simulate__every": 5e-4, "simulate__spectral_radius": 1}
    run = run_of((8, 2), parts__belt__until="0.5 ms", **times)
    moved = float(run["energy_moved"][-1])
    assert moved > 1e-3
    assert np.abs(run["energy_defect"]).max() < 1e-7 * moved


def lens(elements: tuple[int, int]) -> System:
    """The rib as a lens that is clamped at its root."""
    system, lensed = System(), {"start_formula": None, "constants": {"L": L, "R": R, "A": A}}
    for name in WALLS:
        own = cases.load(CASE).parts[name]
        system.add(own.model_copy(update={"elements": elements, "clamped": ("x0",), **lensed}), name)
    for edge in ("y0", "y1"):
        system.add(parts.Seam(a=f"outer wall.{edge}", b=f"inner wall.{edge}"), f"seam {edge}")
    return system


def test_lens_has_the_stiffness_of_its_section(book: Book) -> None:
    """First mode of the lens as a cantilever, whose section stays as it is: that of a rod with the section."""
    own, t = wall(), 1.6e-4
    along, mass = 1.0 / np.linalg.inv(own.stiffness[:3, :3])[0, 0], 2.0 * WIDTH * own.mass
    Iz = Lenticular(radius=R, angle=A, thickness=t).properties(0.0).Iz
    wanted = 1.875104**2 * math.sqrt(along / t * Iz / (mass * L**4))
    found = modes(lens((12, 8)).assemble(), count=1).frequency[0]
    book(
        "Modes", "Lenticular rib of two shells, clamped: first mode (12 x 8)", reference="beam of the thin section",
        source="closed form", error=abs(found / wanted - 1.0), allowed=0.02,
    )  # fmt: skip


def test_walls_that_are_pressed_flat_do_not_pass() -> None:
    """Nodes of equal meshes come down over edges and corners of the faces opposite, near the seams too."""
    system = lens((6, 4))
    for name, sense in zip(WALLS, (-1.0, 1.0), strict=True):
        press = {"ramp": {"final": 4e3, "duration": 0.02}}
        system.add(parts.Load(over=name, frame="body", direction=(0.0, 0.0, sense), profile=press), f"press {name}")
    law = {"stiffness": 1e7, "damping": 1.0, "apart": 1e-3, "initial_overlap": 3.0}
    system.add(parts.Contact(a=WALLS[0], b=WALLS[1], **law), "layers")
    run = system.simulate(until=0.03, every=1e-3, method="energy-momentum", step=1e-3, fine=False)
    outer, inner = (run[name].position.values.reshape(run.sizes["time"], 7, 5, 3)[:, :, 1:4] for name in WALLS)
    normal = run[WALLS[1]].normal.values.reshape(run.sizes["time"], 7, 5, 3)[:, :, 1:4]
    height = np.sum((outer - inner) * normal, axis=-1)
    height = height * np.sign(height[0, 3, 1])
    assert 0.0 < height.min() < 1.6e-4
    assert height[-1, 2:].max() < 3e-4
