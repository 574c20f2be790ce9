"""The graph of a model: blocks of unknowns, and which of them couple in the implicit equations.

Unknowns are the velocities of the model in their order, then one multiplier for each row of constraint.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.algebra.ordering import Pattern
from evolvent.assembly.blocks import owner_of
from evolvent.assembly.constraints import family_of
from evolvent.assembly.ends import ends_of
from evolvent.kernels.blocks import ANGLE
from evolvent.kernels.drive import FREE
from evolvent.model.registry import asked, families

Array = np.ndarray


class _Graph:
    """Blocks and pairs as they are collected."""

    def __init__(self, model: mdl.Model) -> None:
        self.model = model
        self.n_q, self.n_v = int(model.info.nq), int(model.info.nv)
        self.blocks: list[Array] = []
        self.pairs: set[tuple[int, int]] = set()
        #: Block of each velocity, and of each body (-1 of driven ones).
        self.block = np.full(self.n_v, -1, dtype=np.int64)
        self.body = np.full(model.bodies.size, -1, dtype=np.int64)
        self.fixed: set[int] = set()
        self.stiff: set[int] = set()

    def add(self, first: int, size: int) -> int:
        """Make a block of velocities, the first given by its index in the state."""
        at = first - self.n_q
        self.block[at : at + size] = len(self.blocks)
        self.blocks.append(np.arange(at, at + size))
        return len(self.blocks) - 1

    def couple(self, *blocks: int) -> None:
        """Couple all of these blocks; -1 stands for what has no unknowns."""
        found = sorted({int(b) for b in blocks if b >= 0})
        self.pairs.update((a, b) for i, a in enumerate(found) for b in found[i + 1 :])

    def records(self, name: str) -> Any:
        """Records of a family."""
        return getattr(self.model, name)

    def ends(self, name: str, row: Any) -> Iterator[tuple[str, int]]:
        """What a record of a family acts on."""
        return ends_of(name, row, self.records)

    def end(self, what: str, index: int) -> int:
        """Block of what a record acts on (`assembly.ends`); -1 of what has no unknowns."""
        if what == "bodies":
            return int(self.body[index])
        if what == "reduced_bodies":
            row = self.model.reduced_bodies[index]
            return self.of(int(row["iv"])) if row["modes"] > 0 else -1
        return self.of(index)

    def of(self, iv: int) -> int:
        """Block of a velocity, given by its index in the state."""
        return int(self.block[iv - self.n_q])


def pattern_of(model: mdl.Model, *, layers: bool = False) -> Pattern:
    """Blocks of a model's unknowns and their couplings.

    Parameters
    ----------
    layers : bool, whether turns that lie on one another are coupled where they do so at present
        (`kernels.surfaces.measure_turns`); else they are left to inner unknowns
    """
    graph = _Graph(model)
    _add_coordinates(graph)
    _couple_forces(graph)
    if layers:
        for touches in asked("coupling.touches").values():
            for ends in touches(graph.model):
                graph.couple(*(graph.end(*end) for end in ends))
    size = len(graph.blocks)
    owner, carried = _add_multipliers(graph)
    return Pattern(
        blocks=graph.blocks,
        multipliers=np.arange(len(graph.blocks)) >= size,
        pairs=np.array(sorted(graph.pairs), dtype=np.int64).reshape(-1, 2),
        fixed=np.isin(np.arange(len(graph.blocks)), sorted(graph.fixed)),
        owner=owner,
        stiff=frozenset(graph.stiff),
        carried=carried,
    )


def _add_coordinates(graph: _Graph) -> None:
    """A block for each node of beams and threads, each point and each body that moves."""
    model = graph.model
    for (_, _, node), rows in itertools.groupby(model.blocks, key=lambda b: (b["family"], b["owner"], b["node"])):
        own = list(rows)
        name, owner = owner_of(own[0])
        at = graph.add(int(own[0]["iv"]), sum(int(row["count"]) for row in own))
        if node > 0:
            graph.couple(at - 1, at)
        if name == "bodies":
            graph.body[owner] = at
        if own[0]["kind"] == ANGLE:
            graph.fixed.add(at)
        if name == "reduced_bodies":
            graph.stiff.add(at)
        if families()[name].coupling.within:
            graph.couple(at, *(graph.end(*end) for end in graph.ends(name, graph.records(name)[owner])))


def _spool(graph: _Graph, thread: Any) -> int:
    """Block of a free spool, -1 of one that a drive turns."""
    return graph.of(int(thread["spool_v"])) if thread["drive"] == FREE else -1


def _couple_forces(graph: _Graph) -> None:
    """What records couple by their ends, but for turns on one another and multipliers."""
    for family in families().values():
        if family.ends is None or family.coupling.through or family.coupling.within:
            continue
        couples = family.coupling.couples
        for row in family.records(graph.model):
            for ends in [family.ends(row, graph.records)] if couples is None else couples(row, graph.records):
                graph.couple(*(graph.end(*end) for end in ends))


def _segment_ends(graph: _Graph, row: np.record) -> list[int]:
    """Blocks that a segment of fixed length acts on, its own node first, at the spool and when it has left it."""
    i = int(row["last"])
    thread = graph.model.threads[int(row["first"])]
    nodes = [graph.of(int(thread["iv"]) + 3 * j) for j in range(i, min(i + 2, int(thread["n"])))]
    return [*nodes, int(graph.body[thread["body"]]), _spool(graph, thread)]


def _add_multipliers(graph: _Graph) -> tuple[dict[int, int], dict[int, int]]:
    """A block for the multipliers of all joints between the same two blocks; the nodes that they belong to.

    A segment pulls its own node, and others further in: the rows of segments have full rank in their nodes alone. So
    have those that carry a node, the second side, by a frame and its modes; they are returned apart.
    """
    groups: dict[tuple[int, ...], list[int]] = {}
    seconds: dict[tuple[int, ...], int] = {}
    owner: dict[int, int] = {}
    carried: dict[int, int] = {}

    def add(rows: list[int], blocks: Iterable[int]) -> int:
        group = len(graph.blocks)
        graph.blocks.append(graph.n_v + np.array(rows, dtype=np.int64))
        for block in blocks:
            graph.couple(group, block)
        return group

    for k, held in enumerate(graph.model.constraints):
        family, index = family_of(graph.model, k)
        row = getattr(graph.model, family)[index]
        if held["alone"]:
            ends = _segment_ends(graph, row)
            owner[add([k], ends)] = ends[0]
        else:
            ends = [graph.end(*end) for end in graph.ends(family, row)]
            blocks = tuple(sorted({b for b in ends if b >= 0}))
            groups.setdefault(blocks, []).append(k)
            if graph.stiff & set(blocks):
                seconds[blocks] = ends[1]
        if held["couples"]:  # the force turns with the other side
            graph.couple(*ends)
    for blocks, rows in groups.items():
        group = add(rows, blocks)
        if blocks in seconds and len(rows) == len(graph.blocks[seconds[blocks]]):
            carried[group] = seconds[blocks]
    return owner, carried
