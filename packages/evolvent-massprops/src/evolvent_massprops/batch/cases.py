"""Assembled systems of one free body on ground springs: integrated side by side, each one a case of the batch.

The numbers of a case are read from the assembled model, and its states become a `Solution` of that model, so that
all that applies to a run of the general engine applies to a case of the batch; tests compare the two.
"""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import constraint_rows, markers, rigid
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.solution import Solution
from evolvent_base.errors import InputError
from evolvent_massprops.batch.rates import DISSIPATED, Q, V, W, X
from evolvent_massprops.batch.suspended import Suspended, accurate_step, integrate, scheme, stability_limit, warm_up

Array = np.ndarray
#: Largest number of steps of a case: an hour.
MOST_STEPS = 100_000_000
#: Largest defect of the energy balance, of the motion's energy, of a run that has not failed.
ENERGY_LIMIT = 0.1
#: Energy, of the motion's, that the method takes or adds before there is a warning.
ENERGY_WARNED = 1e-3
#: Rounding errors of the energy over the size of what it is the difference of.
ROUNDING = 1e-13
#: Springs of one quantity each, as `Suspended` names them.
_OF_SPRING = ("stiffness", "damping", "length", "lateral_stiffness", "lateral_damping")
#: The three guides of a guided body: kind, direction (inertial axes) and axis (body axes).
_GUIDES = (
    (constraint_rows.CENTRE, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    (constraint_rows.CENTRE, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
    (constraint_rows.AXIS, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class BatchCase:
    """A system that the batch integrates.

    Attributes
    ----------
    assembly : Assembly
    suspended : Suspended, the numbers of its body and springs
    every : float, s, between samples
    samples : int, the start among them
    steps : int, of the method between two samples
    method : str, of `METHODS`
    frequency : float, rad/s, highest natural frequency
    """

    assembly: Assembly
    suspended: Suspended
    every: float
    samples: int
    steps: int
    method: str
    frequency: float

    @property
    def step(self) -> float:
        """Step, s."""
        return self.every / self.steps

    def run(self, progress: Callable[[float], None] | None = None) -> Solution:
        """The motion; the same bits alone as beside others."""
        return solve([self], progress)[0]


def suspended_of(assembly: Assembly) -> Suspended:
    """Numbers of the one free body of a system, on springs to the ground.

    Raises
    ------
    InputError
        For any other system; the sentence names the part.
    """
    model, names = assembly.model, {name: found for name, found in assembly.names.items() if name != "ground"}
    bodies = [index for family, index in names.values() if family == "bodies"]
    for name, (family, index) in names.items():
        if family not in ("bodies", "springs", "guides"):
            _refuse(name, "is of another kind")
        if family == "bodies" and index != bodies[0]:
            _refuse(name, "is a second body")
        if family == "bodies" and model.bodies[index]["motion"] != rigid.FREE:
            _refuse(name, "is not free")
    if not bodies or not model.springs.size:
        raise InputError(f"the system has no {'springs' if bodies else 'body'}; the batch integrates a body on springs")
    body, ground = model.bodies[bodies[0]], assembly.names["ground"][1]
    ends: dict[str, list[Array]] = {"ground": [], "attachment": []}
    for name in (name for name, (family, _) in names.items() if family == "springs"):
        row = model.springs[assembly.index(name)]
        a, b = model.markers[row["a"]], model.markers[row["b"]]
        if row["law"] != 0:
            _refuse(name, "has its own law")
        if row["slack"] != 0:
            _refuse(name, "has `slack`")
        on = [int(end["index"]) if end["kind"] == markers.ON_BODY else -1 for end in (a, b)]
        if sorted(on) != sorted([ground, bodies[0]]):
            _refuse(name, "does not join body and ground")
        first, second = (a, b) if on[0] == ground else (b, a)
        ends["ground"].append(first["local"].copy())
        ends["attachment"].append(second["local"].copy())
    iq, iv = int(body["iq"]), int(body["iv"])
    pose, own_rate = assembly.y[iq : iq + 7], assembly.y[iv + 3 : iv + 6]
    state = np.concatenate([pose, assembly.y[iv : iv + 3], body["R0"] @ own_rate])
    return Suspended(
        mass=float(body["mass"]), inertia=body["inertia"].copy(), gravity=np.array(model.info["gravity"]),
        guided=_is_guided(assembly), attachment=np.array(ends["attachment"]), ground=np.array(ends["ground"]),
        axis=model.springs["axis"].copy(), state=state, **{name: model.springs[name].copy() for name in _OF_SPRING},
    )  # fmt: skip


def _is_guided(assembly: Assembly) -> bool:
    """Whether guides hold x and z of the body and its yaw; refuses others."""
    guides = [(int(g["kind"]), tuple(g["direction"]), tuple(np.round(g["axis"], 12))) for g in assembly.model.guides]
    if guides and sorted(guides) != sorted(_GUIDES):
        name = next(name for name, (family, _) in assembly.names.items() if family == "guides")
        _refuse(name, "is not one of three that hold x and z of the centre of mass and the yaw")
    return bool(guides)


def _refuse(name: str, why: str) -> NoReturn:
    raise InputError(f"the batch integrates one free body on springs to the ground, but {name!r} {why}; use dopri5")


def plan(
    assembly: Assembly,
    times: Array,
    *,
    method: str,
    frequency: float,
    step: float | None = None,
    accuracy: float = 1e-8,
) -> BatchCase:
    """A system, prepared for the batch.

    Parameters
    ----------
    assembly : Assembly, of one free body on springs to the ground
    times : (nt,) float, s, evenly spaced
    method : str, of `METHODS`
    frequency : float, rad/s, highest natural frequency, by which steps are chosen and checked
    step : float, s, longest step; left out, the one that gives that frequency within `accuracy` of itself

    Raises
    ------
    InputError
        For another system, a step above the stability limit, or too many steps.
    """
    every = float(times[-1]) / (len(times) - 1)
    limit = stability_limit(method) / frequency
    wanted = accurate_step(method, accuracy) / frequency if step is None else step
    if step is not None and step > limit:
        raise InputError(
            f"step is {step:.6g} s, above the stability limit {limit:.6g} s of {method} (highest frequency "
            f"{frequency:.6g} rad/s); use a smaller step or auto"
        )
    count = every / wanted * len(times)
    if count > MOST_STEPS:
        raise InputError(f"step is {wanted:.3g} s; that makes {count:.2g} steps, too many; use a larger one")
    return BatchCase(
        assembly=assembly, suspended=suspended_of(assembly), every=every, samples=len(times),
        steps=max(1, int(np.ceil(every / wanted - 1e-9))), method=method, frequency=frequency,
    )  # fmt: skip


def solve(cases: Sequence[BatchCase], progress: Callable[[float], None] | None = None) -> list[Solution]:
    """The motion of each; those of as many springs, samples and steps are integrated together.

    Parameters
    ----------
    cases : sequence of BatchCase
    progress : called with the time reached (s), a few times a second
    """
    found: list[Any] = [None] * len(cases)
    groups: dict[tuple[Any, ...], list[int]] = {}
    for k, case in enumerate(cases):
        key = (
            case.steps,
            case.every,
            case.samples,
            case.method,
            len(case.suspended.stiffness),
        )
        groups.setdefault(key, []).append(k)
    for (steps, every, samples, method, _), members in groups.items():
        began = clock.perf_counter()
        warm_up()
        compiled = clock.perf_counter()
        states = integrate(
            [cases[k].suspended for k in members],
            every=every, samples=samples, steps=steps, method=method, progress=progress,
        )  # fmt: skip
        wall = (clock.perf_counter() - compiled) / len(members)
        for row, k in enumerate(members):
            found[k] = _checked(cases[k], solution_of(cases[k], states[row], wall, compiled - began))
    return found


def solution_of(case: BatchCase, states: Array, wall: float, compiling: float) -> Solution:
    """States (samples, N_STATE) of a case as a solution of its assembly, up to the last finite one."""
    assembly, own = case.assembly, case.suspended
    finite = np.all(np.isfinite(states), axis=1)
    kept = int(np.argmin(finite)) if not np.all(finite) else len(states)
    states = states[:kept]
    at = int(assembly.model.info["nq"] + assembly.model.info["nv"])
    y = np.zeros((kept, assembly.y.size))
    y[:, : V + 3] = states[:, : V + 3]
    y[:, W : W + 3] = _in_body_axes(states[:, Q : Q + 4], states[:, W : W + 3])
    y[:, at + mdl.LOAD] = own.mass * ((states[:, X : X + 3] - states[:1, X : X + 3]) @ own.gravity)
    y[:, at + mdl.DISSIPATED] = states[:, DISSIPATED]
    total = case.steps * (case.samples - 1)
    statistics = {
        "steps": float(total), "rhs_evaluations": float(total * scheme(case.method).evaluations), "step": case.step,
        "stability_limit": stability_limit(case.method) / case.frequency,
    }  # fmt: skip
    status, message = "success", "the run reached its end"
    if kept < len(finite):
        end, status = (kept - 1) * case.every, "failed"
        message = f"the state stopped being finite after t = {end:.6g} s with {case.method}; {_advice(case)}"
    return Solution(
        assembly=assembly, method=case.method, t=case.every * np.arange(kept), y=y,
        s=np.zeros((kept, assembly.s.size), dtype=assembly.s.dtype), status=status, message=message,
        statistics=statistics, event_times=np.zeros(0), event_kinds=np.zeros(0, dtype=int), wall_time=wall,
        compile_time=compiling,
    )  # fmt: skip


def _in_body_axes(q: Array, v: Array) -> Array:
    """Vectors (nt, 3) of inertial axes in those of a body with the quaternions q (nt, 4)."""
    q = q / np.linalg.norm(q, axis=1)[:, None]
    u = q[:, 1:]
    twice = 2.0 * np.cross(v, u)
    found: Array = v + q[:, :1] * twice + np.cross(twice, u)
    return found


def _advice(case: BatchCase) -> str:
    return f"use a smaller step than {case.step:.3g} s"


def _checked(case: BatchCase, solution: Solution) -> Solution:
    """The solution, failed where its energy balance is off.

    Notes
    -----
    The energy of the motion is the largest kinetic energy or the span of the potential energy: the springs hold a
    large energy at rest, beside which a defect would not show.
    """
    balance, own = solution.balance, case.suspended
    potential = balance.elastic - eb.work(balance)
    moving = max(float(balance.kinetic.max()), float(np.ptp(potential)), 1e-300)
    height = float(np.abs(solution.y[:, X : X + 3]).max() + own.length.max())
    fall = own.mass * float(np.linalg.norm(own.gravity)) * height
    worst = float(np.abs(solution.energy_defect).max()) / moving
    solution.statistics["energy_defect"] = worst
    if not solution.success or worst <= ENERGY_LIMIT:
        return solution
    message = (
        f"the energy balance is off by {worst:.2g} of the motion's energy by t = {float(solution.t[-1]):.6g} s; "
        f"{_advice(case)}"
    )
    if moving < ROUNDING * max(float(np.abs(potential).max()), fall):
        message = (
            f"the motion holds {moving:.2g} J at most, which is below the rounding of the potential energy at "
            f"equilibrium; "
            f"set the body in stronger motion"
        )
    return dataclasses.replace(solution, status="failed", message=message)


def warning_of(solution: Solution, energy: float) -> str:
    """A sentence where the method itself takes or adds more than `ENERGY_WARNED` of the motion's energy, J."""
    balance = solution.energy_defect / energy
    worst, step = float(np.abs(balance).max()), solution.statistics.get("step")
    if not solution.success or not worst > ENERGY_WARNED:
        return ""
    return (
        f"{solution.method} itself {'takes' if balance[-1] < 0.0 else 'adds'} {100.0 * worst:.2g} % of the energy at "
        f"this step, which decay rates show; use a smaller {f'step than {step:.3g} s' if step else '`tolerance`'}"
    )
