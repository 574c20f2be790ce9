"""The table of coordinates by kind of an assembled model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.kernels import rigid
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.blocks import (
    ANGLE,
    BEAM,
    BODY,
    POINT,
    POSITION,
    RATE,
    REDUCED,
    ROTATION,
    SCALAR,
    SLOPE,
    TAPE,
    THREAD,
    THRUSTER,
    WHEEL,
)

Array = np.ndarray
#: Numbers of velocities, by kind.
_SIZES = {POSITION: 3, SLOPE: 3, ROTATION: 3, ANGLE: 1, SCALAR: 1, RATE: 1}
#: Node of a block that belongs to a thread's spool.
SPOOL = -1


def blocks_of(families: Mapping[str, Array], pools: Mapping[str, Any]) -> Array:
    """Records `blocks` of all coordinates, by the order of `kernels.blocks.OWNERS`."""
    rows = list(_rows(families, pools))
    found = mdl.zeros("blocks", len(rows))
    for k, (kind, iq, iv, family, owner, node, inertia) in enumerate(rows):
        size = _SIZES[kind]
        found[k] = (kind, iq, iv, size, family, owner, node, np.where(np.arange(3) < size, inertia, 0.0))
    return found


def _rows(families: Mapping[str, Array], pools: Mapping[str, Any]) -> Iterator[tuple[Any, ...]]:
    """Kind, iq, iv, family, owner, node and inertia of each block."""
    for b, beam in enumerate(families["beams"]):
        vectors = NODE_VECTORS[beam["kind"]]
        for i, mass in enumerate(_nodal_masses(beam, families["elements"], pools)):
            kind = SLOPE if i % vectors else POSITION
            yield kind, beam["iq"] + 3 * i, beam["iv"] + 3 * i, BEAM, b, i // vectors, mass
    for p, thread in enumerate(families["threads"]):
        for i, mass in enumerate(families["nodes"]["mass"][thread["node"] :][: thread["n"]]):
            yield POSITION, thread["iq"] + 3 * i, thread["iv"] + 3 * i, THREAD, p, i, mass
    for p, thread in enumerate(families["threads"]):
        if thread["spool_q"] >= 0:
            yield SCALAR, thread["spool_q"], thread["spool_v"], THREAD, p, SPOOL, thread["spool_inertia"]
    for k, point in enumerate(families["points"]):
        if point["mass"] > 0.0:  # the others are nodes of beams
            yield POSITION, point["iq"], point["iv"], POINT, k, 0, point["mass"]
    nodes = _rod_nodes(families["rods"])
    for k, body in enumerate(families["bodies"]):
        q, v, node = body["iq"], body["iv"], nodes.get(k, 0)
        if body["motion"] == rigid.FREE:
            yield POSITION, q, v, BODY, k, node, body["mass"]
            yield ROTATION, q + 3, v + 3, BODY, k, node, np.diag(body["inertia"])
        elif body["motion"] == rigid.SPIN:
            yield ANGLE, q, v, BODY, k, node, body["spin_inertia"]
    for k, wheel in enumerate(families["wheels"]):
        yield SCALAR, wheel["iq"], wheel["iv"], WHEEL, k, 0, wheel["inertia"]
    for k, reduced in enumerate(families["reduced_bodies"]):
        for i in range(int(reduced["modes"])):
            yield SCALAR, reduced["iq"] + i, reduced["iv"] + i, REDUCED, k, 0, reduced["mass"]
    for k, tape in enumerate(families["tapes"]):
        for i, node in enumerate(families["tape_nodes"][tape["first_node"] :][: tape["nodes"]]):
            yield SCALAR, node["iq"], node["iv"], TAPE, k, i, node["mass"]
    for k, thruster in enumerate(families["thrusters"]):
        yield RATE, -1, thruster["iv"], THRUSTER, k, 0, 0.0


def note_inertia(family: str, row: int, model: Any) -> None:
    """Take over the inertia of a body or a point mass whose record has changed into the blocks of its coordinates."""
    owned = {"bodies": BODY, "points": POINT}
    if family not in owned:
        return
    own, blocks = getattr(model, family)[row], model.blocks
    for k in np.flatnonzero((blocks["family"] == owned[family]) & (blocks["owner"] == row)):
        kind = blocks["kind"][k]
        if kind == ROTATION:
            blocks["inertia"][k] = np.diag(own["inertia"])
        else:
            blocks["inertia"][k, : _SIZES[kind]] = own["spin_inertia" if kind == ANGLE else "mass"]


def _nodal_masses(beam: np.record, elements: Array, pools: Mapping[str, Any]) -> Array:
    """Diagonal of a beam's mass matrix, a number for each nodal vector, kg and so on."""
    vectors = NODE_VECTORS[beam["kind"]]
    found = np.zeros(vectors * int(beam["nodes"]))
    for i, element in enumerate(elements[beam["first_element"] :][: beam["elements"]]):
        found[vectors * i :][: 2 * vectors] += np.diag(pools["M"][element["mass"]])
    return found


def _rod_nodes(rods: Array) -> dict[int, int]:
    """Numbers of the nodes of rods, by their bodies."""
    return {int(rod["first_body"]) + i: i for rod in rods for i in range(int(rod["elements"]) + 1)}
