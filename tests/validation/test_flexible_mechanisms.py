"""Published benchmarks of flexible multibody dynamics, by rods and by 24-coordinate beams."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import System, parts
from validation import flexible_mechanisms as benchmarks, lee_frame

Array = np.ndarray
CHAPTER = "Dynamics"
BAUCHAU = "Bauchau et al. (2016)"


@functools.cache
def path(benchmark: str, kind: str, elements: int, part: str, *, until: float, every: float, step: float) -> Array:
    """Places of the nodes of a part over time, m : (nt, n + 1, 3)."""
    system = getattr(benchmarks, benchmark)(kind, elements)
    run = system.simulate(
        until=until, every=every, fine=False, method="energy-momentum", step=step, spectral_radius=0.9
    )
    found: Array = run[part].position.values
    return found


def bend(x: Array) -> Array:
    """Deflection of the middle node from the line between the ends in the x-y plane, m : (nt,)."""
    chord, middle = x[:, -1] - x[:, 0], x[:, x.shape[1] // 2] - x[:, 0]
    found: Array = (chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]) / np.hypot(chord[:, 0], chord[:, 1])
    return found


#: Slider's place and deflection of the rod's middle at 0.01, 0.02, 0.03 and 0.04 s (`slider_crank.py`), m.
SLIDER_CRANK = np.array(
    [[0.27064172, 0.00070319], [0.15073862, -7.79e-05], [0.23010368, -0.0006038], [0.44110087, -0.00096291]]
)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "elements", "allowed"), [("rod", 16, 1e-5), ("beam", 16, 3e-5)])
def test_slider_crank(kind: str, elements: int, allowed: float, book: Book) -> None:
    x = path("slider_crank", kind, elements, "rod", until=0.04, every=0.01, step=5e-6)[1:]
    book(
        CHAPTER, f"Slider-crank with a flexible rod at 150 rad/s, to 0.04 s ({kind}, {elements} elements, 0.005 ms)",
        reference="slider and deflection of 0.7 mm", source="finite volumes, SciPy DOP853; data of Simeon (1996)",
        error=np.abs(np.stack([x[:, -1, 0], bend(x)], axis=1) - SLIDER_CRANK).max(), allowed=allowed, unit="m",
    )  # fmt: skip


@pytest.mark.slow
def test_four_bar(book: Book) -> None:
    """It moves only because its bars bend, by 4 mm out of its plane."""
    keys = {"until": 12.0, "every": 1.0, "step": 5e-3}
    rod, beam = path("four_bar", "rod", 8, "BC", **keys)[:, -1], path("four_bar", "beam", 16, "BC", **keys)[:, -1]
    assert np.abs(rod[:, 1]).max() == pytest.approx(4.2e-3, abs=2e-4)
    book(
        CHAPTER, "Four-bar with a hinge off by 5 degrees, 12 s (rod, 8 elements, 5 ms)",
        reference="path of C, beam of 16 elements", source=f"{BAUCHAU}; other elements",
        error=np.abs(rod - beam).max(), allowed=5e-5, unit="m",
    )  # fmt: skip


@pytest.mark.slow
def test_rotating_shaft(book: Book) -> None:
    """An unbalanced shaft is driven past its critical speed."""
    keys = {"until": 2.5, "every": 0.05, "step": 1e-3}
    whirl = [np.hypot(*path("rotating_shaft", kind, n, "shaft", **keys)[:, n // 2, 1:].T)
             for kind, n in (("rod", 8), ("rod", 16), ("beam", 32))]  # fmt: skip
    assert whirl[0].max() > 0.2
    book(
        CHAPTER, "Rotating shaft through its critical speed, 2.5 s (rod, 8 elements, 1 ms)",
        reference="whirl, 16 elements", source=f"{BAUCHAU}; finer mesh", error=np.abs(whirl[0] - whirl[1]).max(),
        allowed=2e-3, unit="m",
    )  # fmt: skip
    early = slice(0, 11)
    book(
        CHAPTER, "Rotating shaft, the first 0.5 s (rod, 16 elements, 1 ms)", reference="whirl, beam of 32 elements",
        source=f"{BAUCHAU}; other elements", error=np.abs(whirl[1] - whirl[2])[early].max(), allowed=1e-3, unit="m",
    )  # fmt: skip


def test_lateral_buckling(book: Book) -> None:
    """A crank drives the tip of a thin beam, which buckles sideways."""
    keys = {"until": 0.25, "every": 1e-3, "step": 5e-4}
    onset = []
    for kind, n in (("rod", 24), ("beam", 24)):
        aside = np.abs(path("lateral_buckling", kind, n, "beam", **keys)[:, n // 2, 1])
        assert 0.04 < aside.max() < 0.055
        k = int(np.argmax(aside > 0.01))
        onset.append(1e-3 * (k - 1 + (0.01 - aside[k - 1]) / (aside[k] - aside[k - 1])))
    book(
        CHAPTER, "Lateral buckling under fast tip motion (rod, 24 elements, 0.5 ms)",
        reference="time at which the middle is 10 mm aside, beam of 24 elements", source=f"{BAUCHAU}; other elements",
        error=abs(onset[0] - onset[1]), allowed=1e-3, unit="s",
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "elements", "allowed"), [("rod", 20, 1e-4), ("beam", 40, 3e-3)])
def test_lee_frame(kind: str, elements: int, allowed: float, book: Book) -> None:
    wanted = lee_frame.displacement(1.5)
    found: Any = benchmarks.lee_frame(kind, elements, 1.5).equilibrium(load_steps=10)
    x = np.squeeze(found["beam"].position.values)[elements // 5, :2] - (lee_frame.POINT, lee_frame.SIDE)
    book(
        "Statics of beams", f"Lee's frame at 0.81 of its limit load ({kind}, {elements} elements a member)",
        reference=f"({wanted[0]:.5f}, {wanted[1]:.5f})", source="two Reissner beams, SciPy DOP853",
        error=float(np.linalg.norm(x - wanted) / np.linalg.norm(wanted)), allowed=allowed,
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ heavy top


def heavy_top() -> System:
    """The fast top of Arnold & Bruls (2007): its centre of mass 1 m from the pivot, spinning at 150 rad/s."""
    spin = (0.0, 150.0, -4.61538)
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(
        parts.RigidBody(mass=15.0, inertia=(0.234375, 0.46875, 0.234375), position=(0.0, 1.0, 0.0),
                        velocity=tuple(np.cross(spin, (0.0, 1.0, 0.0))), angular_velocity=spin), "top",
    )  # fmt: skip
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("top", (0.0, -1.0, 0.0))), "pivot")
    return system


def exact_top(times: Array) -> Array:
    """Places of its centre of mass by Euler's equations about the pivot."""
    J, g, arm = np.diag([15.234375, 0.46875, 15.234375]), np.array([0.0, 0.0, -9.81]), np.array([0.0, 1.0, 0.0])

    def rates(_: float, y: Array) -> Array:
        R, w = y[:9].reshape(3, 3), y[9:]
        hat = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
        turn = np.linalg.solve(J, 15.0 * np.cross(arm, R.T @ g) - np.cross(w, J @ w))
        return np.concatenate([(R @ hat).ravel(), turn])

    start = np.concatenate([np.eye(3).ravel(), [0.0, 150.0, -4.61538]])
    found: Array = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times, rtol=1e-11, atol=1e-12).y
    return found[[1, 4, 7]].T


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "options", "allowed"),
    [("energy-momentum", {"step": 2e-4}, 2e-2), ("generalized-alpha", {"step": 2e-4}, 2e-2)],
)
def test_fast_heavy_top(method: str, options: dict[str, float], allowed: float, book: Book) -> None:
    exact = exact_top(np.array([0.0, 0.5, 1.0, 1.5, 2.0]))
    assert exact[1] == pytest.approx((-0.7024683, -0.0211652, -0.7114003), abs=1e-5)
    run = heavy_top().simulate(until=2.0, every=0.5, method=method, **options)
    book(
        "Rigid bodies", f"Fast heavy top for 2 s ({method}, {1e3 * options['step']:g} ms)",
        reference="Euler's equations about the pivot", source="Arnold & Bruls (2007); SciPy DOP853",
        error=np.abs(run["top"].position.values - exact).max(), allowed=allowed, unit="m",
    )  # fmt: skip
