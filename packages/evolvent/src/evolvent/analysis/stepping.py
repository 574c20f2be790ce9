"""Steps on demand: an assembled system that is stepped from outside, through forces on its bodies."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.analysis import feedback
from evolvent.analysis.step_inputs import load_slices
from evolvent.analysis.step_results import ResultAddress as ResultAddress, StepResults
from evolvent.assembly import families, needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations.rhs import rhs
from evolvent.kernels import rigid
from evolvent.parts.checks import positive, vector
from evolvent.results.rotations import quaternions
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.laws import law_failure, refusing_laws
from evolvent.solvers.common.limits import limitation_of
from evolvent.solvers.common.sampled import Sampled, bristles
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import plan as implicit
from evolvent.solvers.time.implicit.releases import write_accounts
from evolvent_base.errors import EvolventError, InputError, RunFailed, naming_keys, nearest

#: Implicit methods that step: those whose forces are of the ends of steps, which an input is held over.
IMPLICIT = tuple(name for name, of in implicit.METHODS.items() if not of.flags["midpoint"])


class BodyState(NamedTuple):
    """Where a body is.

    Attributes
    ----------
    position, velocity : (3,) float, m and m/s, of its origin, inertial axes
    quaternion : (4,) float, body to inertial, scalar first
    rate : (3,) float, rad/s, angular velocity, inertial axes
    """

    position: np.ndarray
    velocity: np.ndarray
    quaternion: np.ndarray
    rate: np.ndarray


class SteppedAssembly:
    """An assembled system that is stepped.

    Parameters
    ----------
    assembly : Assembly, with a force and a torque on every one of the inputs
    method, start, until, step, tolerance, spectral_radius : as of `evolvent.Stepper`
    inputs : names of bodies on which forces and torques will be set
    absolute_tolerance : float, of dopri5; a hundredth of `tolerance` if left out
    """

    def __init__(
        self, assembly: Assembly, *, method: str, start: float, until: float, inputs: tuple[str, ...] = (),
        step: float | None = None, tolerance: float = 1e-4, absolute_tolerance: float | None = None,
        spectral_radius: float = 1.0,
    ) -> None:  # fmt: skip
        self.method, self.time, self.until, self.inputs = method, start, until, inputs
        self._changed = False
        self._held: dict[str, np.ndarray] = {}
        self._failed = ""
        self._keys: Mapping[str, str] = {}
        self._events: list[tuple[np.ndarray, np.ndarray]] = []
        times = np.array([start, until])
        if families.reacts(assembly.model):
            feedback.method_of(assembly, method)
        assembly, loops = feedback.with_tables(assembly, self.time, self.until)
        if method in IMPLICIT:
            self._run = implicit.ImplicitRun(
                implicit.plan(
                    assembly,
                    samples=times,
                    method=method,
                    step=step,
                    tolerance=tolerance,
                    spectral_radius=spectral_radius,
                )
            )
            # samples are ends of steps: their momenta follow from the states
            self._run.work = self._run.work._replace(out_momenta=np.zeros((0, 6)))
            self.assembly = self._run.assembly
            self._begin()
        else:
            self._plan = explicit_plan.plan(
                assembly, samples=times, method=method, step=step, rtol=tolerance,
                atol=1e-2 * tolerance if absolute_tolerance is None else absolute_tolerance,
            )  # fmt: skip
            self.assembly = self._plan.assembly
            self._y, self._s = assembly.y.copy(), assembly.s.copy()
        self._results = StepResults(self.assembly, self._solution)
        self._first = self._sample()
        self._loops = feedback.Loops(self, loops)
        with refusing_laws(self.assembly):
            self._look()
        try:
            self._loops.act(self.time)
        except RunFailed as error:
            raise InputError(str(error)) from None

    # -------------------------------------------------------------------------------------------- in and out

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all bodies but the ground."""
        rows = self.assembly.names.items()
        return tuple(name for name, (family, _) in rows if family == "bodies" and name != "ground")

    def set_wrench(self, body: str, force: Sequence[float] = (0, 0, 0), torque: Sequence[float] = (0, 0, 0)) -> None:
        """Force (N) at a body's origin and torque (N m) from now on, inertial axes."""
        if body not in self.inputs:
            raise InputError(f"{body!r} is not among the inputs; {nearest(str(body), self.inputs)}")
        given = np.concatenate([vector("force", force), vector("torque", torque)])
        if np.array_equal(given, self._input(body)):
            return
        for entries, value in zip(load_slices(self.assembly, body), (given[:3], given[3:]), strict=True):
            self.assembly.model.parameters[entries] = value
        self._changed = True

    def body(self, name: str) -> BodyState:
        """State of a body now."""
        row = self._row(name)
        return BodyState(row["x"].copy(), row["v"].copy(), quaternions(row["R"]), row["w"].copy())

    def wrench(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Force (N) and torque about the body's origin (N m), inertial axes, of the structure on a body.

        All that acts on it but inputs and weight: threads, beams, springs, joints, contacts and fields, at the end of
        the last step, with the inputs of that step. Wound thread that is carried counts as a part of the body.
        """
        row = self._row(name)
        found = row["F"].copy()
        if name in self.inputs:
            found -= self._held[name]
        if row["motion"] == rigid.FREE:  # whose record holds the gyroscopic torque as well
            found[3:] += np.cross(row["w"], row["R"] @ (row["inertia"] @ (row["R"].T @ row["w"])))
            if self.method not in IMPLICIT:
                found[:3] -= row["mass"] * self.assembly.model.info.gravity
        return found[:3], found[3:]

    def result(self, name: str) -> float | np.ndarray:
        """A result of a part now, by the name that it has in a run.

        Parameters
        ----------
        name : str, such as 'hub.rate.z', 'boom.tip.velocity', 'boom[5].position', 'hinge.angle'

        Raises
        ------
        InputError
            If there is none, or it adds up over all samples of a run, such as the work of a load.

        Notes
        -----
        Forces of joints are the multipliers of the last step. With steps by tolerance they oscillate from step to step.
        """
        return self.value(self.address(name))

    def value(self, address: ResultAddress) -> float | np.ndarray:
        """A result now, by the address that `address` has found for its name."""
        return self._results.value(address)

    @property
    def warning(self) -> str:
        """What the state now is beyond (`evolvent.solvers.common.limits`), one text; '' for nothing."""
        return limitation_of(self._solution())

    def results(self) -> dict[str, tuple[tuple[str, ...], str]]:
        """Names of all that `result` gives, without components and entries: name -> (dimensions, unit)."""
        return self._results.names()

    def describe(self, name: str) -> tuple[str, str]:
        """Unit and meaning of a result."""
        return self._results.describe(name)

    def address(self, name: Any) -> ResultAddress:
        """Where a result is found; of the same system it stays the same.

        Raises
        ------
        InputError
            As of `result`.
        """
        return self._results.address(name)

    def _sample(self) -> _Sample:
        """State and what the method has kept of it, at the last sample."""
        if self.method not in IMPLICIT:
            return _Sample(self.time, self._y.copy(), self._s.copy(), None)
        work, n = self._run.work, int(self._run.work.loop.sample) - 1
        one = slice(n, n + 1)
        balance = work.out_balance[one].copy().view(eb.BALANCE).reshape(1).view(np.recarray)
        y = work.out_y[one].copy()
        write_accounts(self.assembly.model, y, balance)
        kept = Sampled(work.out_a[one].copy(), work.out_la[one].copy(), balance, work.out_forces[one].copy())
        return _Sample(self.time, y[0], work.out_s[n].copy(), kept)

    def _solution(self) -> Solution:
        """The state at the start and now, as a run of two samples."""
        one, two = self._first, self._sample()
        kept = None
        if one.kept is not None and two.kept is not None:
            pairs: Any = zip(one.kept, two.kept, strict=True)
            both: list[Any] = [None if a is None else np.concatenate([a, b]) for a, b in pairs]
            kept = Sampled(*both)
            kept = kept._replace(balance=kept.balance.view(np.recarray))
        if self.method in IMPLICIT:
            times, kinds = self._run._events()
        else:
            times = np.concatenate([np.zeros(0), *(times for times, _ in self._events)])
            kinds = np.concatenate([np.zeros(0, dtype=np.int64), *(kinds for _, kinds in self._events)])
        return Solution(
            assembly=dataclasses.replace(self.assembly, model=self.assembly.model.copy()),
            method=self.method,
            t=np.array([one.time, two.time]),
            y=np.stack([one.y, two.y]),
            s=np.stack([one.s, two.s]),
            status="success",
            message="",
            statistics={},
            event_times=times,
            event_kinds=kinds,
            wall_time=0.0,
            compile_time=0.0,
            kept=kept,
        )

    @property
    def state(self) -> np.ndarray:
        """State vector [q | v | accounts] now."""
        if self.method not in IMPLICIT:
            return self._y.copy()
        y: np.ndarray = self._run.work.y.copy()
        write_accounts(self.assembly.model, y[None], self._run.work.balance)
        return y

    def _row(self, name: str) -> Any:
        """Record of a body, or of the ground."""
        return self.assembly.model.bodies[self._index(name)]

    def _index(self, name: str) -> int:
        """Row of a body, or of the ground."""
        if name not in (*self.bodies, "ground"):
            raise InputError(f"no body is called {name!r}; {nearest(str(name), self.bodies)}")
        return self.assembly.index(name, "bodies")

    def _input(self, body: str) -> np.ndarray:
        """Force and torque (6,) that are set on a body."""
        return np.concatenate([self.assembly.model.parameters[entries] for entries in load_slices(self.assembly, body)])

    # -------------------------------------------------------------------------------------------- time

    def step(self, dt: float) -> None:
        """Go on by `dt` s.

        Raises
        ------
        InputError
            For a `dt` that is not above 0, or beyond the end of the stepper's time.
        RunFailed
            Where the method fails, and from then on; the state is that of the last step that was taken.
        """
        positive("dt", dt)
        if self._failed:
            raise RunFailed(f"the stepper has failed at t = {self.time:.6g} s ({self._failed}); make a new one", self)
        end = self.time + dt
        if end > self.until * (1.0 + 1e-12):
            raise InputError(f"dt is {dt:g} s, which leads to {end:g} s, beyond the stepper's end at {self.until:g} s")
        for stop in self.stops(end):
            self.go_to(stop)

    def stops(self, end: float) -> Iterator[float]:
        """Times from now to `end` at which loops of feedback sample or command, then `end`, s."""
        return self._loops.stops(self.time, end)

    @property
    def loops(self) -> list[feedback.Loop]:
        """Loops of feedback."""
        return self._loops.loops

    def place(self, y: np.ndarray) -> None:
        """Look at another state of an explicit method, at the time now."""
        self._y = y
        self._look()

    def moved(self, y: np.ndarray, s: np.ndarray, length: float) -> np.ndarray:
        """The state that follows from y and s, `length` s from now, by an explicit method; the stepper's own stays."""
        own = y.copy()
        own[int(self.assembly.model.info.nq + self.assembly.model.info.nv) :] = 0.0
        found = self._plan.going_on(np.array([self.time, self.time + length]), own, s.copy()).run()
        if found.status != "success":
            raise RunFailed(found.message, self)
        return found.y[-1]

    @property
    def measured(self) -> dict[str, dict[str, tuple[np.ndarray, np.ndarray, str]]]:
        """What loops of feedback have measured, as of `evolvent.solvers.Solution`."""
        return self._loops.measured

    def go_to(self, end: float) -> None:
        """Go on to `end` (s), at most the next one of `stops`."""
        try:
            with naming_keys(self._keys):
                self._advance(end)
                self.time = end
                self._changed = False
                self._look()
                self._loops.act(end)
        except RunFailed as error:
            self._failed = str(error)
            if self.method in IMPLICIT:  # which may have come a part of the way
                self.time = self._run.reached
            raise

    def _advance(self, end: float) -> None:
        try:
            if self.method in IMPLICIT:
                self._continue_to(end)
            else:
                self._solve(end)
        except EvolventError:
            raise
        except Exception as error:
            raise self._law_failed(error) from error

    def _law_failed(self, error: Exception) -> RunFailed:
        """What a user's law has raised in a step of generalized-alpha; the state is that of the step's start again."""
        run = self._run
        failure = law_failure(self.assembly, error, run.moments())
        run.work.y[:] = run.work.y0
        rigid.kinematics(run.reached, run.work.y, run.model)
        return RunFailed(failure, self)

    def _begin(self) -> None:
        with refusing_laws(self.assembly):
            failure = self._run.begin()
        if failure:
            raise RunFailed(failure, self)

    def _continue_to(self, end: float) -> None:
        run, loop = self._run, self._run.work.loop
        run.work.samples[:] = self.time, end
        loop.sample = 1
        changed, near = self._changed, 10.0 * float(run.work.options.smallest)
        while loop.stop < run.work.stops.size and run.work.stops[loop.stop] <= self.time + near:
            loop.stop += 1  # at the end of the step before, but for round-off
            changed = True
        if changed:  # loads that jump
            failure = run.restart()
            if failure:
                raise RunFailed(failure, self)
        goes_on, failure = True, ""
        while goes_on and not failure:
            goes_on, failure = run.advance(1000)
        if run.is_stopped:
            failure = f"an event stopped the run at t = {run.reached:.9g} s"
        if failure:
            raise RunFailed(failure, self)

    def _solve(self, end: float) -> None:
        model = self.assembly.model
        accounts = int(model.info.nq) + int(model.info.nv)
        y, states = self._y.copy(), bristles(model)
        y[accounts:] = 0.0
        y[states] = self._y[states]
        found = self._plan.going_on(np.array([self.time, end]), y, self._s).run()
        if found.status != "success":
            raise RunFailed(found.message, self)
        self._y[states] = 0.0
        kept = self._y[accounts:]
        self._y, self._s = found.y[-1].copy(), found.s[-1].copy()
        self._y[accounts:] += kept
        if found.event_times.size:
            self._events.append((found.event_times, found.event_kinds))

    def _look(self) -> None:
        """Fill the bodies' records with the state now, as generalized-alpha leaves them after every step."""
        self._held = {body: self._input(body) for body in self.inputs}
        self._results.forget()
        if self.method not in IMPLICIT:
            model, dy = self.assembly.model, np.zeros_like(self._y)
            needs.load(model, rhs)
            rhs(self.time, self._y, self._s, model, dy)


class _Sample(NamedTuple):
    """A state, and what generalized-alpha has kept of it."""

    time: float
    y: np.ndarray
    s: np.ndarray
    kept: Sampled | None
