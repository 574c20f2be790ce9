"""Rotated and mirrored cases, copies: the same motion in other words (issue 2)."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import parts
from evolvent.analysis.system import System
from evolvent.assembly.assembled import Assembly
from evolvent.parts.base import unit
from helpers import L0, RHO, SPOOL, TIP, W0, J, L, R, heliogyro, rotation, run

OPTIONS = {"rtol": 1e-10, "atol": 1e-12}
TIMES = np.linspace(0.0, 16.0, 81)
#: Of springs, whose steps are shorter.
SHORT = TIMES[TIMES < 11.0]


def compose(
    *,
    motion: str = "free",
    turned: np.ndarray | None = None,
    mirror: bool = False,
    segments: str = "inextensible",
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Assembly:
    """Two unequal blades on a body that wobbles; turned by a quaternion, or mirrored through the plane y = 0."""
    quaternion = np.array([1.0, 0.0, 0.0, 0.0]) if turned is None else turned
    Q = rotation(quaternion)
    M = np.diag([1.0, -1.0, 1.0]) if mirror else np.eye(3)
    axial = np.linalg.det(M) * M  # how angular velocities are mirrored
    system = System(gravity=Q @ M @ gravity)
    system.add(
        parts.RigidBody(
            motion=motion,
            mass=1.0,
            inertia=(0.003, 0.0035, J),
            velocity=Q @ M @ (0.01, 0.02, -0.01),
            orientation=quaternion,
            angular_velocity=axial @ (0.02, -0.03, W0),
            rate=(axial @ (0.0, 0.0, W0))[2],
        ),
        "hub",
    )
    for k, side in enumerate((1.0, -1.0)):
        system.add(
            parts.Reel(
                body="hub",
                centre=M @ (side * L0, 0.0, 0.0),
                payout_axis=M @ (side, 0.0, 0.0),
                spool_axis=axial @ (0.0, side, 0.0),
                radius=R,
                drive=parts.ConstantDrive(rate=SPOOL * (1.0 - 0.3 * k)),
            ),
            f"reel-{k}",
        )
        system.add(
            parts.Thread(
                reel=f"reel-{k}",
                length=L,
                line_density=RHO,
                tip_mass=TIP,
                damping=1e-3,
                segments=segments,
                wound_mass="carried",
            ),
            f"blade-{k}",
        )
    return system.assemble()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("motion", "segments"), [("free", "inextensible"), ("spin", "inextensible"), ("free", "springs")]
)
def test_rotated_case(rng: np.random.Generator, motion: str, segments: str) -> None:
    """The whole set-up turned at random, its gravity too: everything turns with it."""
    quaternion = unit(rng.normal(size=4))
    Q = rotation(quaternion)
    times, method, options = (SHORT, "rk4", {}) if segments == "springs" else (TIMES, "dopri5", OPTIONS)
    plain, turned = (
        run(
            compose(motion=motion, turned=q, segments=segments, gravity=(0.001, -0.002, 0.003)),
            times,
            method,
            **options,
        )
        for q in (None, quaternion)
    )
    assert plain.solution.event_times.size == (4 if segments == "springs" else 5)
    for name in ("position", "velocity", "body_position", "body_velocity", "body_rate"):
        a, b = getattr(plain.seen, name), getattr(turned.seen, name)
        assert b == pytest.approx(np.einsum("ij,tnj->tni", Q, a), abs=1e-7), name
    assert turned.seen.tension == pytest.approx(plain.seen.tension, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("motion", "segments"), [("free", "inextensible"), ("spin", "inextensible"), ("free", "springs")]
)
def test_mirrored_case(motion: str, segments: str) -> None:
    """Mirrored through y = 0: the body spins the other way, everything else is the mirror image."""
    times, method, options = (SHORT, "rk4", {}) if segments == "springs" else (TIMES, "dopri5", OPTIONS)
    plain, mirrored = (
        run(compose(motion=motion, mirror=m, segments=segments), times, method, **options) for m in (False, True)
    )
    for name in ("position", "velocity", "body_position", "body_velocity"):
        assert getattr(mirrored.seen, name) == pytest.approx(getattr(plain.seen, name) * (1.0, -1.0, 1.0), abs=1e-7), (
            name
        )
    assert mirrored.seen.body_rate == pytest.approx(plain.seen.body_rate * (-1.0, 1.0, -1.0), abs=1e-7)
    assert mirrored.seen.body_rate[-1, 1, 2] < 0.0


def test_mirrored_drive() -> None:
    """The blade paid out to the other side, mirrored through x = 0, from a body that spins the other way."""

    def blade(side: float) -> Assembly:
        system = System()
        system.add(parts.RigidBody(motion="spin", inertia=J, rate=side * W0), "hub")
        # the mirror image of the spool's frame keeps Z = X x Y only with the axis turned as an axial vector
        reel = parts.Reel(
            body="hub",
            centre=(side * L0, 0.0, 0.0),
            payout_axis=(side, 0.0, 0.0),
            spool_axis=(0.0, side, 0.0),
            radius=R,
            drive=parts.ConstantDrive(rate=SPOOL),
        )
        system.add(reel, "reel")
        thread = parts.Thread(reel="reel", length=L, line_density=RHO, tip_mass=TIP, segments="inextensible")
        system.add(thread, "blade")
        return system.assemble()

    a, b = (run(blade(side), TIMES, **OPTIONS) for side in (1.0, -1.0))
    assert b.seen.position == pytest.approx(a.seen.position * (-1.0, 1.0, 1.0), abs=1e-10)
    assert b.rate() == pytest.approx(-a.rate(), abs=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize(("segments", "wound_mass"), [("inextensible", "ignored"), ("springs", "carried")])
def test_copies_are_threads(segments: str, wound_mass: str) -> None:
    """multiplicity=2 is two threads half a turn apart, in motion, momentum and energy."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=J, rate=W0), "hub")
    for k, side in enumerate((1.0, -1.0)):
        system.add(
            parts.Reel(
                body="hub",
                centre=(side * L0, 0.0, 0.0),
                payout_axis=(side, 0.0, 0.0),
                spool_axis=(0.0, side, 0.0),
                radius=R,
                drive=parts.ConstantDrive(rate=SPOOL),
            ),
            f"reel-{k}",
        )
        given = {"length": L, "line_density": RHO, "tip_mass": TIP, "damping": 1e-3}
        if segments == "springs":
            given["boundary_segment"] = "constant"  # as the heliogyro has it
        system.add(parts.Thread(reel=f"reel-{k}", segments=segments, wound_mass=wound_mass, **given))
    method, options = ("rk4", {"step": 1e-4}) if segments == "springs" else ("dopri5", OPTIONS)
    two = run(system.assemble(), TIMES, method, **options)
    one = run(heliogyro(segments=segments, wound_mass=wound_mass), TIMES, method, **options)
    tolerance = 1e-9 if segments == "inextensible" else 1e-8
    assert one.rate() == pytest.approx(two.rate(), abs=tolerance)
    assert one.seen.position == pytest.approx(two.seen.position[:, :20], abs=tolerance)
    assert one.seen.position * (-1.0, -1.0, 1.0) == pytest.approx(two.seen.position[:, 20:], abs=tolerance)
    assert one.energy == pytest.approx(two.energy, abs=tolerance)
    # kinetic and elastic energy, axial momentum: of all copies
    assert one.momentum[:, 2] == pytest.approx(two.momentum[:, 2], abs=tolerance)
    assert one.accounts[:, :8] == pytest.approx(two.accounts[:, :8], abs=tolerance)
