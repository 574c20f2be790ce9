"""Driven bodies carried along a line: tests on a shaker."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import InputError, System, elements, parts

METHODS: dict[str, dict[str, Any]] = {
    "dopri5": {"tolerance": 1e-9},
    "generalized-alpha": {"step": 2e-3},
    "energy-momentum": {"step": 2e-3, "spectral_radius": 1.0},
}


def table(amplitude: float, w: float) -> parts.RigidBody:
    drive = {"expression": "a*sin(w*t)", "constants": {"a": amplitude, "w": w}}
    return parts.RigidBody(motion="driven", drive=drive, direction=(0.0, 0.0, 1.0))


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_transmissibility(ratio: float, method: str, book: Book) -> None:
    """Steady motion of a mass on spring and damper on a table, from a start on it: (k + i c w)/(k + i c w - m w^2)."""
    m, k, c, a, length = 2.0, 30.0, 3.0, 0.05, 0.5
    w = ratio * math.sqrt(k / m)
    H = (k + 1j * c * w) / (k + 1j * c * w - m * w**2)
    system = System()
    system.add(table(a, w), "table")
    start, rate = a * H.imag, a * w * H.real
    system.add(parts.Point(mass=m, position=(0.0, 0.0, length + start), velocity=(0.0, 0.0, rate)), "mass")
    system.add(parts.Spring(a="table", b="mass", stiffness=k, damping=c, length=length), "spring")
    run = system.simulate(until=2.0, every=0.02, method=method, **METHODS[method])
    exact = length + a * np.imag(H * np.exp(1j * w * run["time"].values))
    book(
        "Dynamics", f"mass on spring and damper on a shaker, {ratio} of its frequency ({method})",
        reference="transmissibility", source="Den Hartog 1956",
        error=np.abs(run["mass/position"].values[:, 2] - exact).max() / (a * abs(H)),
        allowed=1e-6 if method == "dopri5" else 2e-4,
    )  # fmt: skip
    moved = run["table/position"].values[:, 2]
    np.testing.assert_allclose(moved, a * np.sin(w * run["time"].values), atol=1e-12)
    scale = float(run["energy_kinetic"].max())
    allowed = {"dopri5": 1e-6, "generalized-alpha": 1e-3, "energy-momentum": 1e-9}[method]
    assert float(np.abs(run["energy_defect"]).max()) < allowed * scale
    assert float(np.abs(run["work_drives"]).max()) > 0.01 * scale


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_a_cantilever_on_a_shaker(method: str, book: Book) -> None:
    """Its tip against its root: (cos b + cosh b)/(1 + cos b cosh b), b^4 = rho A w^2 L^4/(E I), of steady motion."""
    a, count, section = 1e-3, 8, elements.Rectangle(width=0.02, thickness=0.005)
    material = elements.Material(young_modulus=2e9, poisson_ratio=0.0, density=1000.0)
    stiffness = 2e9 * 0.02 * 0.005**3 / 12.0
    b = 1.5
    w = b**2 * math.sqrt(stiffness / (1000.0 * 0.02 * 0.005))
    # amplitude over the length: A cos + B sin + C cosh + D sinh, 1 at the clamp, without slope there, a free end
    s, c, S, C = math.sin(b), math.cos(b), math.sinh(b), math.cosh(b)
    A, B = np.linalg.solve([[-c - C, -s - S], [s - S, -c - C]], [-C, -S])
    factors = np.array([A, B, 1.0 - A, -B])
    x = np.linspace(0.0, 1.0, count + 1)
    shape = factors @ [np.cos(b * x), np.sin(b * x), np.cosh(b * x), np.sinh(b * x)]
    slope = b * factors @ [-np.sin(b * x), np.cos(b * x), np.sinh(b * x), np.cosh(b * x)]
    assert shape[-1] == pytest.approx((c + C) / (1.0 + c * C), rel=1e-9)
    rates = np.zeros((count + 1, 2, 3))
    rates[:, 0, 2], rates[:, 1, 2] = a * w * shape, a * w * slope
    system = System()
    system.add(table(a, w), "table")
    system.add(
        parts.Beam(length=1.0, section=section, material=material, elements=count, formulation="cable",
                   rates=rates.tolist()), "beam",
    )  # fmt: skip
    system.add(parts.Joint(a="table", b="beam.root", type="clamp"), "clamp")
    period = 2.0 * math.pi / w
    run = system.simulate(until=period, every=period / 40.0, method=method, step=period / 400.0, spectral_radius=0.9)
    exact = a * np.sin(w * run["time"].values) * shape[-1]
    book(
        "Dynamics", f"cantilever on a shaker (cable, {count} elements, {method})",
        reference="(cos b + cosh b)/(1 + cos b cosh b)", source="Bernoulli-Euler beam, steady motion",
        error=np.abs(run["beam/position"].values[:, -1, 2] - exact).max() / (a * abs(shape[-1])), allowed=2e-3,
    )  # fmt: skip


def test_an_inextensible_thread_follows_the_acceleration_of_its_reel() -> None:
    """A mass hangs on a reel that is lifted with s = c t^4: T = m (g + s'')."""
    system = System(gravity=(0.0, 0.0, -9.81))
    drive = {"expression": "c*t**4", "constants": {"c": 0.5}}
    system.add(parts.RigidBody(motion="driven", drive=drive, direction=(0.0, 0.0, 1.0)), "crane")
    system.add(
        parts.Reel(
            body="crane", radius=0.1, payout_axis=(0.0, 0.0, -1.0), drive=parts.ConstantDrive(rate=0.0, angle=10.0)
        ),
        "reel",
    )
    system.add(
        parts.Thread(reel="reel", length=1.0, line_density=1e-3, nodes=1, tip_mass=2.0, segments="inextensible"), "rope"
    )
    run = system.simulate(until=1.0, every=0.5, method="dopri5", tolerance=1e-9)
    exact = (2.0 + 0.5e-3) * (9.81 + 6.0 * run["time"].values ** 2)
    np.testing.assert_allclose(run["rope/tension"].values.max(axis=1), exact, rtol=1e-6)


def test_refusals() -> None:
    def refused(words: str, **fields: Any) -> None:
        system = System()
        system.add(parts.RigidBody(**{"motion": "driven", **fields}), "table")
        system.add(parts.Point(mass=1.0), "mass")
        with pytest.raises(InputError, match=words):
            system.assemble()

    refused("table.direction is given without table.drive", direction=(1.0, 0.0, 0.0))
    refused("table.drive needs a driven body, but table.motion is 'free'", motion="free", mass=1.0, inertia=1.0,
            drive=parts.ConstantDrive(rate=1.0))  # fmt: skip
    refused("table.drive is a free spool", drive=parts.FreeSpool(inertia=1.0))
    refused("table.drive.steps has a step of zero duration", drive=parts.RampDrive(steps=((1.0, 0.0, 2.0),)))
