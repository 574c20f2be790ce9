"""Wheels that spin in frames that turn: orbital frames, steady turns; equilibria and modes of bodies with wheels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.kernels.blocks import displace
from evolvent.solvers.modal.modes import Where, at_equilibrium
from evolvent.solvers.static.equilibrium import unbalance

Array = np.ndarray

#: Inertia of a body that is alike about all axes, of its wheel, rate of the wheel and of the frame.
J, S, W, N = 2.0, 0.1, 30.0, 0.8


def ball(axis: Any = (0.0, 0.0, 1.0), *, orbit: bool = False, **body: Any) -> System:
    """A ball with a wheel."""
    system = System()
    if orbit:
        system.add(parts.Field(type="orbit", rate=N), "orbit")
    system.add(parts.RigidBody(mass=4.0, inertia=J, **body), "ball")
    system.add(parts.ReactionWheel(body="ball", axis=axis, inertia=S, rate=W), "wheel")
    return system


def turned(attitude: Array, vector: Array) -> Array:
    """Vectors (n, 3) in body axes, in those of the frame; attitude : (n, 4)."""
    w, v = attitude[:, :1], attitude[:, 1:]
    across = np.cross(v, vector)
    return vector + 2.0 * (w * across + np.cross(v, across))


@pytest.mark.parametrize("method", ["rk4", "dopri5", "generalized-alpha", "energy-momentum"])
def test_a_ball_with_a_wheel_keeps_its_angular_momentum_in_space(method: str) -> None:
    """J (w + w0) + S W n turns backwards in the orbital frame, and the wheel's own part n . w + W is kept."""
    axis = np.array([2.0, 1.0, 2.0]) / 3.0
    system = ball(tuple(axis), orbit=True, angular_velocity=(0.3, -0.5, 0.7))
    options: dict[str, Any] = {"step": 2e-3} if method != "dopri5" else {"tolerance": 1e-10}
    run = system.simulate(until=4.0, every=0.5, fine=False, method=method, **options)
    q, w = run["ball/attitude"].values, run["ball/rate"].values
    frame = np.array([0.0, 0.0, N])
    spin = S * run["wheel/rate"].values[:, None] * axis
    found = turned(q, J * w + spin) + J * frame
    for t, H in zip(run["time"].values, found, strict=True):
        c, s = math.cos(N * t), math.sin(N * t)
        back = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(back @ H, found[0], atol=2e-5 * np.abs(found[0]).max())
    own = turned(q, np.broadcast_to(axis, w.shape)) @ frame + w @ axis + run["wheel/rate"].values
    np.testing.assert_allclose(own, own[0], rtol=1e-6)


@pytest.mark.parametrize("frame", ["space", "turn", "orbit"])
def test_nutation(frame: str) -> None:
    """J w' + w x h = 0: i h/J; an attitude that is kept in space turns at the rate of the frame."""
    system = ball(orbit=frame == "orbit")
    found = system.modes(count=9, **({"rotating": (0.0, 0.0, N)} if frame == "turn" else {})).pole
    attitude = [] if frame == "space" else [N]
    translation = {"space": [], "turn": [N, N], "orbit": [N, N]}[frame]
    wanted = sorted([S * W / J, *attitude, *translation])
    assert found.real == pytest.approx(0.0, abs=1e-6)
    assert np.sort(found.imag[found.imag > 1e-6]) == pytest.approx(wanted, rel=1e-7)


def test_a_wheel_with_momentum_stands_against_a_turn() -> None:
    """In a frame that turns about y, a wheel about z is held by springs with the moment w x h about x."""
    k, rate = 400.0, 0.05
    system = System()
    system.add(parts.RigidBody(mass=4.0, inertia=J), "ball")
    system.add(parts.ReactionWheel(body="ball", axis=(0.0, 0.0, 1.0), inertia=S, rate=W), "wheel")
    system.add(parts.RigidBody(motion="driven", axis=(0.0, 1.0, 0.0), rate=rate), "frame")
    for n, end in enumerate(np.vstack([np.eye(3), -np.eye(3)])):
        for m, direction in enumerate(np.eye(3)):
            far = ("frame", tuple(end + 50.0 * direction))
            system.add(parts.Spring(a=("ball", tuple(end)), b=far, stiffness=k, length=50.0), f"spring {n} {m}")
    found = system.equilibrium(rotating=(0.0, rate, 0.0))
    q = found["ball/attitude"].values.reshape(-1, 4)[-1]
    assert found.attrs["status"] == "success"
    # each direction across x has four springs at the distance 1: those along y and z of the ends on the other two
    stiffness = 4.0 * k
    assert 2.0 * q[1] == pytest.approx(-rate * S * W / stiffness, rel=2e-3)


@pytest.mark.parametrize("body", [{}, {"motion": "spin", "axis": (0.0, 0.6, 0.8)}], ids=["free", "about-an-axis"])
def test_the_tangent_has_the_frames_torque_on_a_wheel(body: dict[str, Any]) -> None:
    """Central differences of the forces at an equilibrium whose axes are all askew to the orbit."""
    system = System()
    system.add(parts.Field(type="orbit", rate=N), "orbit")
    system.add(parts.RigidBody(mass=4.0, inertia=(2.0, 3.0, 4.5), **body), "ball")
    system.add(parts.ReactionWheel(body="ball", axis=(2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0), inertia=S, rate=W), "wheel")
    _, _, work, (_, _, K, _) = at_equilibrium(system.assemble(), Where(None, None, 0.0, None, None), damped=False)
    b, step, rest = work.balance, 1e-4, work.balance.y.copy()

    def forces(at: int, by: float) -> Array:
        b.d[:] = 0.0
        b.d[at] = by
        b.y[:] = rest
        displace(b.y, b.d, False, work.model, b.y)
        unbalance(work.time, work.step, 1.0, 1.0, work.model, b, b.r)
        return b.r[: work.n_v].copy()

    found = np.array([(forces(at, step) - forces(at, -step)) / (2.0 * step) for at in range(work.n_v)]).T
    np.testing.assert_allclose(K.toarray(), found, atol=1e-6 * np.abs(found).max())
