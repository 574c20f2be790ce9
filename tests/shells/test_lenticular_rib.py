"""A lenticular rib of two shells, flat on a hub: energy, forces that hold it, release, and the lens beside a rod's."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

import evolvent as ev
from book import Book
from evolvent import System, cases, parts
from evolvent.elements import Lenticular
from evolvent.solvers.modal.modes import modes

Array = np.ndarray
CASE, CHAPTER = "rib-lenticular-shell", "Statics of shells"
WALLS = ("outer wall", "inner wall")
#: Of the case: length, radius and angle of the arcs, radius of the coil, pressure of the belt; SI.
L, R, A, C, P = 0.6, 0.1, 0.6, 0.15008, 4000.0
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


@functools.cache
def held() -> Any:
    """Until shortly before the belt opens."""
    return run_of((18, 4), simulate__until=0.012, simulate__step=1e-3, simulate__every=1e-3)


def test_energy_of_flattening_and_winding(book: Book) -> None:
    """At the start: bent by 1/C along and by 1/R across, in equal sense of the outer wall, in opposite of the inner."""
    D, along, across = wall().stiffness[3:6, 3:6], 1.0 / C, 1.0 / R
    own, turned = 0.5 * (D[0, 0] * along**2 + D[1, 1] * across**2), D[0, 1] * along * across
    for name, wanted, sense in zip(WALLS, (own - turned, own + turned), ("equal", "opposite"), strict=True):
        found = float(held()[name]["energy_elastic"][0])
        book(
            CHAPTER, f"Wall of a lens, flattened and wound in {sense} sense (18 x 4): energy",
            reference="D11, D22 and D12 of the laminate", source="closed form",
            error=abs(found / (wanted * L * WIDTH) - 1.0), allowed=5e-3,
        )  # fmt: skip


def test_forces_while_held(book: Book) -> None:
    """The hub carries the belt's pressure but on the root's nodes; its mount the resultant over the wrapped arc."""
    run, area = held(), 2.0 * L * WIDTH
    pressed = float(run["coil"]["normal_force"][-1])
    book(
        "Contact", "Rib held flat on a hub by a belt (18 x 4): force on the hub", reference="pressure times area",
        source="closed form", error=abs(pressed / (P * area * 35.0 / 36.0) - 1.0), allowed=0.02,
    )  # fmt: skip
    arc = np.array([1.0 - math.cos(TURN), -math.sin(TURN), 0.0])
    force = run["mount"]["force"].values[-1]
    assert np.abs(force - 2.0 * P * WIDTH * C * arc).max() < 0.02 * np.linalg.norm(force)


def test_release_keeps_energy_and_momentum() -> None:
    """Steps that damp nothing: energy to round-off; angular momentum is what the hub's mount gives."""
    damping = {f"parts__{name}__stiffness_damping": 0.0 for name in WALLS}
    belts = {f"parts__{name} belt__until": "0.5 ms" for name in ("outer", "inner")}
    times = {"simulate__until": 6e-3, "simulate__step": 5e-4, "simulate__every": 5e-4, "simulate__spectral_radius": 1}
    run = run_of((12, 2), **damping, **belts, **times)
    moved = float(run["energy_moved"][-1])
    assert moved > 1e-3
    assert np.abs(run["energy_defect"]).max() < 1e-8 * moved


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
