"""Nodes of beams, as other parts refer to them."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location
from evolvent.kernels import ancf_beams as kernels
from evolvent.parts.base import unit
from evolvent_base.dense import dot, inverse, product
from evolvent_base.errors import InputError


def across(e1: np.ndarray) -> np.ndarray:
    """The unit vector across e1 that is nearest to y; to z, where e1 is along y."""
    near = np.array([0.0, 1.0, 0.0])
    if abs(e1[1]) > 1.0 - 1e-9:
        near = np.array([0.0, 0.0, 1.0])
    return unit(near - dot(near, e1) * e1)


def node_of(builder: Builder, where: Any, key: str = "node") -> tuple[int, int, int, int]:
    """Index of a beam, its kind, and indices of coordinates and velocities (as the builder counts) of one of its nodes.

    `where` is a reference such as "boom.root", "boom.tip" or "boom[5]"; `key` says what it is given for.
    """
    at = builder.location(where, key)
    if at.family != "beams":
        raise InputError(f"{key} is {where!r}; it must be a node of a beam, such as 'boom.tip' or 'boom[5]'")
    return at.row, at.beam, at.iq, at.iv


def node_rate(builder: Builder, at: Location) -> np.ndarray:
    """Angular velocity of a beam's node at the start, rad/s, inertial axes; of a cable without that about its axis."""
    count = 3 * kernels.NODE_VECTORS[at.beam]
    node = np.array(builder.q[at.iq : at.iq + count]).reshape(-1, 3)
    rates = np.array(builder.v[at.iv : at.iv + count]).reshape(-1, 3)
    if at.beam != kernels.BEAM:
        turn: np.ndarray = np.cross(node[1], rates[1]) / dot(node[1], node[1])
        return turn
    # least squares of w x r = r' for both directions across
    A = sum(dot(r, r) * np.eye(3) - np.outer(r, r) for r in node[2:])
    return product(inverse(A), sum(np.cross(r, rate) for r, rate in zip(node[2:], rates[2:], strict=True)))
