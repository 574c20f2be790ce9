"""A motion of several bodies with all that a motion may hold: boxes, a strip, a rod, a spring, forces, marks."""

from __future__ import annotations

import numpy as np

from evolvent.results.motion import Forces, Frame, Line, Marks, Motion
from evolvent.results.rotations import from_rotation_vectors, product, turned
from evolvent.results.solids import Solid


def many_bodies(count: int = 121, *, drift: float = 0.0) -> Motion:
    """Two boxes joined by a bent boom, a ball on a spring, a reel that turns; all of it spins and moves along x."""
    time = np.linspace(0.0, 12.0, count)
    zero = np.zeros_like(time)
    origin = np.stack([drift * time, zero, 0.1 * np.sin(time)], axis=1)
    attitude = product(
        from_rotation_vectors(np.stack([0.2 * np.sin(time), zero, zero], axis=1)),
        from_rotation_vectors(np.stack([zero, zero, 0.8 * time], axis=1)),
    )

    def placed(points: np.ndarray) -> np.ndarray:
        return origin[:, None] + turned(attitude, np.broadcast_to(points, (count, *points.shape[-2:])))

    s = np.linspace(0.0, 1.0, 13)
    bend = 0.3 * np.sin(2.0 * time)[:, None] * s**2
    boom = np.stack([0.25 + 2.0 * s + 0.0 * bend, bend, 0.0 * bend], axis=-1)
    slope = 0.6 * np.sin(2.0 * time) / 2.0
    panel = product(attitude, from_rotation_vectors(np.stack([zero, zero, np.arctan(slope)], axis=1)))
    tip = placed(boom)[:, -1]
    ball = placed(np.stack([zero, zero, -1.0 - 0.3 * np.cos(3.0 * time)], axis=-1)[:, None])
    root = placed(np.array([[0.0, 0.0, -0.25]]))
    push = np.stack([zero, 4.0 * np.cos(time), zero], axis=1)[:, None]
    moment = np.stack([zero, zero, 0.05 * np.sin(time)], axis=1)[:, None]
    return Motion(
        title="Two bodies & a boom",
        time=time,
        frames=[
            Frame(
                name="bus",
                origin=origin,
                attitude=attitude,
                solids=[
                    Solid.box((0.5, 0.5, 0.5)),
                    Solid.revolution([(0.0, 0.1), (0.2, 0.25)], centre=(0.0, 0.0, 0.25)),
                    Solid.cylinder(0.12, 0.3, centre=(-0.4, 0.0, 0.0), axis=(0.0, 1.0, 0.0), turned=3.0 * time),
                ],
            ),
            Frame(
                name="panel",
                origin=tip,
                attitude=panel,
                outline=[np.array([[0.0, -0.5, 0.0], [1.0, -0.5, 0.0], [1.0, 0.5, 0.0], [0.0, 0.5, 0.0]])],
                solids=[Solid.box((1.0, 1.0, 0.03), centre=(0.5, 0.0, 0.0))],
            ),
            Frame(name="ball", origin=ball[:, 0], attitude=attitude, solids=[Solid.sphere(0.15)]),
        ],
        lines=[
            Line(
                name="boom",
                points=placed(boom),
                values={"moment [N m]": 2.0 * np.sin(2.0 * time)[:, None] * (1.0 - s), "strain": 1e-3 * bend},
                width=0.12,
                across=turned(attitude, np.broadcast_to([0.0, 0.0, 1.0], (count, 13, 3))),
            ),
            Line(name="strut", points=placed(np.array([[0.0, 0.25, 0.0], [0.0, 1.2, 0.0]])), kind="rod", width=0.06),
            Line(
                name="spring",
                points=np.concatenate([root, ball], axis=1),
                kind="spring",
                width=0.16,
                tip=None,
                values={"force [N]": np.repeat(10.0 * np.cos(3.0 * time)[:, None], 2, axis=1)},
            ),
        ],
        forces=[
            Forces(name="thrust", points=tip[:, None], vectors=push),
            Forces(name="torque on the bus", points=origin[:, None], vectors=moment, unit="N m"),
        ],
        marks=[
            Marks(name="hinge", points=tip[:, None]),
            Marks(name="tip mass", points=placed(np.array([[0.0, 1.2, 0.0]])), size=0.15),
        ],
        numbers={"spin [rad/s]": 0.8 + zero, "late [m]": np.where(time > 6.0, time, np.nan)},
    )
