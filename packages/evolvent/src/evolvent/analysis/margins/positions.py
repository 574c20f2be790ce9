"""A mechanism at a position, the direction in which it moves there, and the models by which both are evaluated."""

from __future__ import annotations

import abc
import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.analysis.margins.mass import Mass
from evolvent.analysis.margins.shares import coordinate_names, measured, ties_of, unforced
from evolvent.assembly.assembled import Assembly
from evolvent.equations.implicit import residual, residuals
from evolvent.kernels import axial
from evolvent.kernels.axial import QUARTER
from evolvent.model.powers import N_POWERS
from evolvent.model.registry import asked, forget_steps, motions, motions_of
from evolvent.model.shares import Tie

Array = np.ndarray


@dataclasses.dataclass(frozen=True)
class Direction:
    """How a mechanism moves with a coordinate.

    Attributes
    ----------
    v : (nv,) float, velocities by that of the coordinate, which is 1 or -1
    rates : (nc,) float, of all coordinates
    inertia : float, kg m2 or kg, v.M v
    """

    v: Array
    rates: Array
    inertia: float


class Position:
    """A mechanism at a time and a state, with what its constraints and coordinates are there.

    Attributes
    ----------
    t : float, s; y : (n,) float, the state
    zero : (nv,) float, left side of the equations without any force of a part
    G : (nj, nv) float, gradients of the joints; gaps : (nj,) float; penalties hold as constraints do
    J : (nc, nv) float, gradients of the coordinates: the force of a spring with a torque of 1
    x : (nc,) float, rad or m, values of the coordinates
    """

    def __init__(self, mechanism: MechanismModels, t: float, y: Array) -> None:
        self._mechanism, self.t, self.y = mechanism, t, y
        bare, n_v = mechanism.bare, mechanism.n_v
        r = mechanism.left(t, y, bare)
        self.zero, self.gaps = r[:n_v], r[n_v:]
        self.x = motions_of(bare)["angle"].copy()
        self.G = mechanism.lefts(t, y, la=np.eye(mechanism.n_j))[:, :n_v] - self.zero
        self.J = np.zeros((self.x.size, n_v))
        for k, one in enumerate(mechanism.with_torque):
            motions_of(one)["rest"] = self.x[k] - 1.0
            self.J[k] = mechanism.left(t, y, one)[:n_v] - self.zero

    @functools.cached_property
    def mass(self) -> Mass:
        """Mass matrix, (nv, nv)."""
        one = self._mechanism
        found = None if one.elastic is None else one.elastic.mass(self)
        if found is not None:
            return Mass(found)
        whole = one.lefts(self.t, self.y, a=np.eye(one.n_v))[:, : one.n_v] - self.zero
        return Mass(0.5 * (whole + whole.T))


class MechanismModels(abc.ABC):
    """Models of an assembled system with some of its forces, and what is evaluated of them at a position.

    Parameters
    ----------
    assembly, spin, opened, relaxed : as of `mechanism.Mechanism`
    """

    #: Equilibria of elastic parts, None without any.
    elastic: Any

    def __init__(self, assembly: Assembly, spin: Array, opened: Sequence[int] = (), *, relaxed: bool = False) -> None:
        model = assembly.model.copy()
        for memory in asked("statics.memory").values():
            memory(model).pass_over(math.inf if relaxed else 0.0, {})
        model.constraints["until"] = model.constraints["latest"]
        model.constraints["until"][list(opened)] = model.constraints["latest"][list(opened)] = -np.inf
        self.assembly, self.spin = assembly, spin
        self.n_v, self.n_j, self.n_q = int(model.info.nv), int(model.constraints.size), int(model.info.nq)
        model.info.exact = 1
        model.switches[:] = assembly.s
        forget_steps(model)
        self.names = coordinate_names(assembly)
        #: Rows of coordinates by which bearings measure alone, and which have no margin of their own.
        self.measured = measured(model)
        self.whole, self.ties = model, ties_of(model)
        weightless = model.info.copy()
        weightless["gravity"] = 0.0
        #: The model without any force but those of constraints.
        self.bare = model._replace(info=weightless, **unforced(model))
        still = motions_of(self.bare)
        #: The same with one coordinate, whose spring has a torque or force of 1 where `rest` is the value less 1.
        self.with_torque = [self.bare._replace(**{motions(): still[k : k + 1].copy()}) for k in range(still.size)]
        for one in self.with_torque:
            motions_of(one)["stiffness"] = 1.0
            motions_of(one)["prony_end"] = motions_of(one)["prony"]  # nothing relaxes
        self._models: dict[str, Any] = {}
        #: Word of the key `pace` of positions at rest, '' without viscoelastic parts.
        self.pace = ("slow" if relaxed else "fast") if assembly.relaxations else ""
        #: A model of its own in which the strains of a state are measured.
        self._measuring: Any = None
        self.powers = np.zeros(N_POWERS)
        self.none = np.zeros(self.n_v), np.zeros(self.n_j)

    @abc.abstractmethod
    def move(self, targets: dict[int, float], at: Position) -> Position:
        """The position in which coordinates have the values `targets`, at rest, from another one."""

    def left(
        self, t: float, y: Array, model: Any, *, a: Any = None, la: Any = None, step: float = 0.0, factor: float = 0.0
    ) -> Array:
        """Residual of a model: generalised forces on the left of the equations, then gaps."""
        r = np.empty(self.n_v + self.n_j)
        a, la = self.none[0] if a is None else a, self.none[1] if la is None else la
        residual(t, y, a, la, step, factor, model, r, self.powers)
        return r

    def lefts(self, t: float, y: Array, *, a: Array | None = None, la: Array | None = None) -> Array:
        """`left` of the bare model with several accelerations (k, nv), or multipliers (k, nj): a row of each."""
        count = max(len(rows) for rows in (a, la) if rows is not None)
        a, la = (np.zeros((count, size)) if rows is None else rows for rows, size in ((a, self.n_v), (la, self.n_j)))
        r = np.empty((count, self.n_v + self.n_j))
        residuals(t, y, a, la, self.bare, r, self.powers)
        return r

    def remember(self, t: float, y: Array | None) -> None:
        """Let the branches of viscoelastic parts have the strains of a state at a time (s); of None, of the start."""
        if not self.assembly.relaxations:
            return
        source = self.assembly.model
        if y is not None:
            if self._measuring is None:
                self._measuring = self.whole.copy()
            source = self._measuring
            source.switches[:] = self.bare.switches
            self.left(t, y, source)
        for memory in asked("statics.memory").values():
            if y is not None:
                memory(source).resume(y)
            memory(source).give(self.whole)

    def at(self, t: float, y: Array) -> Position:
        """The mechanism at a time (s) and a state."""
        return Position(self, t, y)

    def once(self, label: str, **changes: Any) -> Any:
        """The bare model with some arrays of its own, made once."""
        if label not in self._models:
            self._models[label] = self.bare._replace(**changes)
        return self._models[label]

    def tied(self, J: Array) -> Array:
        """Gradients of the sums of coordinates that loops of cables keep: (n, nv)."""
        return np.array([self._sum(tie, J) for tie in self.ties]).reshape(len(self.ties), self.n_v)

    def stretch(self, x: Array) -> Array:
        """How far coordinates are off those sums: (n,)."""
        return np.array([self._sum(tie, x) - tie.value for tie in self.ties])

    @staticmethod
    def _sum(tie: Tie, values: Array) -> Any:
        return sum(ratio * values[k] for k, ratio in zip(tie.motions, tie.ratios, strict=True))

    def count_turns(self) -> None:
        """Keep the last angles as those from which whole turns are counted."""
        rows = motions_of(self.bare)
        angles = rows["kind"] == axial.ANGLE
        quarters = np.floor(rows["angle"] / QUARTER + 0.5).astype(np.int64)
        self.bare.switches[rows["switch"][angles]] = quarters[angles]

    def unit(self, k: int) -> str:
        """Unit of coordinate k."""
        return "rad" if motions_of(self.whole)["kind"][k] == axial.ANGLE else "m"
