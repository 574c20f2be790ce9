"""What a solver returns."""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent.solvers import balance as eb

if TYPE_CHECKING:
    from evolvent.builder import Assembly

Array = np.ndarray


class Sampled(NamedTuple):
    """What follows from the states at the samples: kept by implicit and static solvers, evaluated of explicit runs.

    Attributes
    ----------
    acceleration : (nt, nv) float
    la : (nt, nj) float, multipliers of the joints, in the order of `names`; NaN of constraints under explicit methods
    balance : (nt,) records of the energy balance, J (see `evolvent.solvers.balance`)
    cylinders : (nt, nc, 9) float, of each: force (N) and torque (N m) on its body at the body's origin, inertial axes;
        sum of normal forces (N), its impulse (N s), points that touch
    wrenches : (nt, nb, 6) float, N and N m, all that acts on each body at its origin, inertial axes; torques of free
        bodies less the gyroscopic w x J w
    """

    acceleration: Array
    la: Array
    balance: Any
    cylinders: Array
    wrenches: Array


class Momentum(NamedTuple):
    """Momentum balance.

    Attributes
    ----------
    linear, angular : (nt, 3) float, kg m/s and kg m2/s about the inertial origin, of all that the model moves
    jumps_linear, jumps_angular : (nt, 3) float, what events brought in since the start (nodes that leave a spool)
    """

    linear: Array
    angular: Array
    jumps_linear: Array
    jumps_angular: Array

    @property
    def drift_linear(self) -> Array:
        """(nt, 3) linear momentum less that at the start and less the jumps: zero where nothing acts from outside."""
        return (self.linear - self.linear[0]) - (self.jumps_linear - self.jumps_linear[0])

    @property
    def drift_angular(self) -> Array:
        """(nt, 3) angular momentum less that at the start and less the jumps: zero where nothing acts from outside."""
        return (self.angular - self.angular[0]) - (self.jumps_angular - self.jumps_angular[0])


class Path(NamedTuple):
    """What a static solution has of its own.

    Attributes
    ----------
    factor : (nt,) float, load factors along the path
    loads : (nt, nv) float, N, generalised loads on beams, and weights
    spin : (6,) float, rad/s and m, rate and centre of the steady turn
    free : list of str, parts that move without any resistance at the end; the equilibrium is then one of many
    unstable : int, independent directions in which the energy falls at the end; -1 where they were not counted
    """

    factor: Array
    loads: Array
    spin: Array
    free: list[str]
    unstable: int


@dataclasses.dataclass
class Solution:
    """What every solver returns; it prints nothing.

    Attributes
    ----------
    assembly : Assembly, what was solved; its model is the solver's own copy
    method : str, "rk4", "heun", "dopri5", "generalized-alpha" or "static"
    t : (nt,) float, s, times of the samples; of a static solution the time at which drives and loads stand
    y, s : (nt, ny) float and (nt, ns) int, states [q | v | accounts] and switches there
    status : {"success", "stopped by event", "interrupted", "failed"}
    message : str, one sentence; for a failure: what, where, when, what to try
    statistics : dict of steps, rejected_steps, events, step (s), energy_defect (largest, of the largest energy and the
        work) and what else a method counts
    event_times, event_kinds : (ne,) float and int
    wall_time, compile_time : float, s
    kept : Sampled, what the method has kept at its samples; None of explicit methods
    path : Path, of a static solution; None of a motion
    """

    assembly: Assembly
    method: str
    t: Array
    y: Array
    s: Array
    status: str
    message: str
    statistics: dict[str, float]
    event_times: Array
    event_kinds: Array
    wall_time: float
    compile_time: float
    kept: Sampled | None = None
    path: Path | None = None

    @property
    def success(self) -> bool:
        """Whether the run reached its end, or the event that was to stop it."""
        return self.status in ("success", "stopped by event")

    @functools.cached_property
    def sampled(self) -> Sampled:
        """Accelerations, multipliers, energy balance, contact forces and wrenches at the samples."""
        if self.kept is not None:
            return self.kept
        from evolvent.solvers.sampled import evaluate

        return evaluate(self.assembly, self.t, self.y, self.s)

    @property
    def acceleration(self) -> Array:
        """See `Sampled`."""
        return self.sampled.acceleration

    @property
    def la(self) -> Array:
        """See `Sampled`."""
        return self.sampled.la

    @functools.cached_property
    def balance(self) -> Any:
        """See `Sampled`."""
        from evolvent.solvers.sampled import balances

        return self.sampled.balance if self._is_split else balances(self.assembly.model, self.t, self.y, self.s)

    @property
    def _is_split(self) -> bool:
        """Whether energies of contacts and joints stand apart from the others."""
        return self.kept is not None or bool(
            self.assembly.model.flexible.beams.size or self.assembly.model.info.penalties
        )

    @property
    def cylinders(self) -> Array:
        """See `Sampled`."""
        return self.sampled.cylinders

    @property
    def wrenches(self) -> Array:
        """See `Sampled`."""
        return self.sampled.wrenches

    @property
    def energy(self) -> Array:
        """(nt,) kinetic and potential energy, J."""
        return np.asarray(eb.energy(self.balance))

    @property
    def energy_defect(self) -> Array:
        """(nt,) energy less that at the first sample and less work, plus losses, J; below zero: numerical damping."""
        found = np.asarray(eb.defect(self.balance, 0.0))
        return found - found[:1]

    @functools.cached_property
    def momentum(self) -> Momentum:
        """Linear and angular momentum at the samples, and what events brought in."""
        from evolvent.solvers.sampled import momentum

        return momentum(self.assembly, self.t, self.y, self.s)

    def chosen(self, samples: Any) -> Solution:
        """The solution at some of its samples: (nt,) bool, or indices."""
        kept = None if self.kept is None else Sampled(*(values[samples] for values in self.kept))
        return dataclasses.replace(self, t=self.t[samples], y=self.y[samples], s=self.s[samples], kept=kept)
