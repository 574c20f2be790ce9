"""Steps on demand: a model that another simulator drives, time after time, through forces on its bodies."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.builder import Assembly
from evolvent.errors import InputError, RunFailed, nearest
from evolvent.flow import bind_rates
from evolvent.kernels import rigid
from evolvent.parts import Force, Torque
from evolvent.parts.checks import positive, vector
from evolvent.solvers import alpha
from evolvent.solvers.drive import METHODS, choose_step, solve
from evolvent.solvers.implicit import prepared, reason
from evolvent.solvers.releases import reason_of_outrun
from evolvent.system import System

IMPLICIT = "generalized-alpha"


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


class Stepper:
    """A system that is stepped from outside, for co-simulation.

    Parameters
    ----------
    system : System, which is left as it is
    inputs : names of bodies on which forces and torques will be set
    method : {"generalized-alpha", "rk4", "heun", "dopri5"}
    start : float, s
    until : float, s, the end of the time that may be stepped through
    step : float, s, of a fixed-step method; None: by tolerance, or from the highest frequency
    tolerance : float, of adaptive methods
    spectral_radius : float, of generalized-alpha

    Raises
    ------
    InputError
        For an unknown body or method, or a system that the method cannot carry.

    Notes
    -----
    A wrench is held over the steps until it is set anew. The explicit methods start anew at every step.
    """

    def __init__(
        self,
        system: System,
        *,
        inputs: Sequence[str] = (),
        method: str = IMPLICIT,
        start: float = 0.0,
        until: float = 1e4,
        step: float | None = None,
        tolerance: float = 1e-4,
        spectral_radius: float = 0.9,
    ) -> None:
        known = [IMPLICIT, *METHODS]
        if method not in known:
            raise InputError(f"method is {method!r}; {nearest(str(method), known)}")
        if not (math.isfinite(start) and math.isfinite(until) and until > start):
            raise InputError(f"until is {until!r} s; it must be after the start, {start!r} s")
        self.method, self.time, self.until = method, float(start), float(until)
        self.assembly = _with_inputs(system, inputs)
        self.inputs = tuple(inputs)
        self._changed = False
        times = np.array([self.time, self.until])
        if method == IMPLICIT:
            self._run = prepared(self.assembly, times, step=step, tolerance=tolerance, spectral_radius=spectral_radius)
            self._fixed = step
            self._begin()
        else:
            fixed = method != "dopri5"
            self._fixed = choose_step(self.assembly, method, step, until - start)[0] if fixed else None
            self._tolerance = tolerance
            self._y, self._s = self.assembly.y.copy(), self.assembly.s.copy()
        self._look()

    # -------------------------------------------------------------------------------------------- in and out

    def set_wrench(self, body: str, force: Sequence[float] = (0, 0, 0), torque: Sequence[float] = (0, 0, 0)) -> None:
        """Force (N) at a body's origin and torque (N m) from now on, inertial axes."""
        if body not in self.inputs:
            raise InputError(f"{body!r} is not among the inputs; {nearest(body, self.inputs)}")
        parameters, loads = self.assembly.model.parameters, self.assembly.model.loads
        for kind, value in (("force", force), ("torque", torque)):
            first = int(loads["first"][self.assembly.index(f"{body}-input-{kind}", "loads")])
            parameters[first : first + 3] = vector(kind, value)
        self._changed = True

    def body(self, name: str) -> BodyState:
        """State of a body now."""
        row = self.assembly.model.bodies[self.assembly.index(name, "bodies")]
        return BodyState(row["x"].copy(), row["v"].copy(), _quaternion(row["R"]), row["w"].copy())

    def wrench(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Force (N) and torque about the body's origin (N m), inertial axes, of the structure on a body.

        All that acts on it but inputs and weight: threads, beams, springs, joints and contacts.
        """
        index = self.assembly.index(name, "bodies")
        row = self.assembly.model.bodies[index]
        found = row["F"].copy()
        if name in self.inputs:
            for k, kind in enumerate(("force", "torque")):
                load = self.assembly.model.loads[self.assembly.index(f"{name}-input-{kind}", "loads")]
                found[3 * k : 3 * k + 3] -= self.assembly.model.parameters[int(load["first"]) :][:3]
        if self.method != IMPLICIT and row["motion"] == rigid.FREE:
            found[:3] -= row["mass"] * self.assembly.model.info["gravity"][0]
        return found[:3], found[3:]

    @property
    def state(self) -> np.ndarray:
        """State vector [q | v | accounts] now."""
        y: np.ndarray = self._run.march.y if self.method == IMPLICIT else self._y
        return y.copy()

    # -------------------------------------------------------------------------------------------- time

    def step(self, dt: float) -> None:
        """Go on by `dt` s.

        Raises
        ------
        InputError
            For a `dt` that is not above 0, or beyond the end of the stepper's time.
        RunFailed
            Where the method fails; the state is that of the last step that held.
        """
        positive("dt", dt)
        end = self.time + dt
        if end > self.until * (1.0 + 1e-12):
            raise InputError(f"dt is {dt:g} s, which leads to {end:g} s, beyond the stepper's end at {self.until:g} s")
        if self.method == IMPLICIT:
            self._go_on(end)
        else:
            self._solve(end)
        self.time = end
        self._changed = False
        self._look()

    def _begin(self) -> None:
        run = self._run
        if run.releases is not None and run.releases.fire(self.time, run.march.y) < 0:
            raise RunFailed(reason_of_outrun(self.time), self)
        code = alpha.begin(run.calls, run.model, run.matrix, run.options, run.march)
        if code != alpha.DONE:
            raise RunFailed(reason(code, run.march, self._fixed, run.options, self.assembly), self)

    def _go_on(self, end: float) -> None:
        run = self._run
        march = run.march
        march.samples[:] = self.time, end
        march.tally[alpha.SAMPLE] = 1
        if self._changed:  # loads that jump
            h = float(march.clock[alpha.STEP])
            code = alpha.anew(run.calls, self.time, h, run.model, run.matrix, run.options, march)
            if code != alpha.DONE:
                raise RunFailed(reason(code, march, self._fixed, run.options, self.assembly), self)
        while True:
            code = alpha.advance(run.calls, run.model, run.matrix, run.options, march, 1000)
            if code == alpha.AT_STOP and run.releases is not None:
                if run.releases.resume(run.calls, march) < 0:
                    raise RunFailed(reason_of_outrun(float(march.clock[alpha.TIME])), self)
            elif code != alpha.BUDGET:
                break
        if code != alpha.DONE:
            raise RunFailed(reason(code, march, self._fixed, run.options, self.assembly), self)

    def _solve(self, end: float) -> None:
        model = self.assembly.model
        accounts = int(model.info["nq"][0]) + int(model.info["nv"][0])
        kept = self._y[accounts:].copy()
        self._y[accounts:] = 0.0
        now = dataclasses.replace(self.assembly, y=self._y, s=self._s)
        found = solve(
            now, samples=[self.time, end], method=self.method, step=self._fixed, rtol=self._tolerance,
            atol=1e-2 * self._tolerance,
        )  # fmt: skip
        if not found.success:
            raise RunFailed(found.message, self)
        self._y, self._s = found.y[-1].copy(), found.s[-1].copy()
        self._y[accounts:] += kept

    def _look(self) -> None:
        """Fill the bodies' records with the state now, as generalized-alpha leaves them after every step."""
        if self.method != IMPLICIT:
            model, dy = self.assembly.model, np.zeros_like(self._y)
            bind_rates(model)[0][0](self.time, self._y, self._s, model, dy)


def _with_inputs(system: System, inputs: Sequence[str]) -> Assembly:
    """The system with a force and a torque, none so far, on each of some bodies."""
    known = [name for name, (family, _) in system.assemble().names.items() if family == "bodies"]
    copy = system.copy()
    for body in inputs:
        if body not in known:
            raise InputError(f"inputs name {body!r}, which is no body; {nearest(str(body), known)}")
        copy.add(Force(at=body, force=(0.0, 0.0, 0.0)), f"{body}-input-force")
        copy.add(Torque(at=body, force=(0.0, 0.0, 0.0)), f"{body}-input-torque")
    return copy.assemble()


def _quaternion(R: Any) -> np.ndarray:
    """Quaternion of a rotation matrix, scalar first and not below zero."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(R).as_quat()
    return np.array([w, x, y, z]) * (1.0 if w >= 0.0 else -1.0)
