r"""Heliogyro: thin blades, taken as threads, pay out from spools on a spinning body.

A thread of length L is wound on a spool of radius r that turns by a given law phi(t), on a body that spins about Z at
the rate W. The spool's axis is Y, at the distance L0 from the spin axis; X points outwards, the nominal feed; the
thread leaves at Q = (0, 0, r). The thread is n equal segments of length l0 = L / n with lumped masses; node 1 is the
tip and leaves first. v = r phi', dphi = l0 / r, e_ab the unit vector from a to b, c and d a segment's stiffness and
damping.

Equations (Tenenbaum 2014, numbered as there; spool frame, which turns with the body)::

    (1)   node i is released when phi reaches dphi (i - 1)
    (2)   on the spool, phi_i = phi - dphi (i - 1):
          x'' = -r (phi'^2 sin phi_i - phi'' cos phi_i), y'' = 0, z'' = -r (phi'^2 cos phi_i + phi'' sin phi_i)
    (3)   spring force on a free node: c (|X_k - X_i| - l0) e_ik, k = i - 1 and i + 1
    (4)   damping force: d ((V_k - V_i) . e_ik) e_ik; node 1 has no node 0
    (5)   m_i X_i'' is the sum of the forces on node i
    (6)   m_i = rho l0; the tip m_1 = m_k + rho l0 / 2
    (7,8) boundary node (the last one released): as (3, 4) with Q in the place of node i + 1,
    (9)   V_Q = (r phi', 0, 0)
    (10)  and the rest length l00 = r (phi - dphi (i - 1))
    (11)  where |Q - X_i| is below a tiny length, e = (-1, 0, 0)
    (12)  at its release the velocity of a node is turned along the thread: V_i = |V_i| e_(i,i-1)  (blade.velocity_turn)
    (13)  loads of the user's, f(x, v, t) per length, act on every released node
    (14)  inertial forces of the rotating frame on every released node:
          F_x = m (W' y + W^2 (x + L0) + 2 W y'), F_y = m (-W' (x + L0) + W^2 y - 2 W x')
    (15)  torque of two blades on the body: M = -2 L0 F_y
    (16)  J W' = M
    (17)  at the start the nodes lie on the spool at x = r sin(-dphi (i - 1)), z = r cos(-dphi (i - 1))
    (18)  W = J W0 / (J + 2 rho l^3 / 3 + 2 m_k l^2), l the deployed length
    (19)  lag angle of node i: acos(x / sqrt(x^2 + y^2 + (z - r)^2))

Where the paper is in error, or silent:

- (15) as printed takes the whole boundary force (7, 8) for F_y; that destroys the balance of angular momentum (the body
  would end at 5 rad/s). Only the terms that pull at Q act on the body, and so it is done here.
- (18) leaves out L0. `body_rate_corrected` puts it right: W = I(start) W0 / I with
  I = J + N [rho ((L0 + l)^3 - L0^3) / 3 + m_k (L0 + l)^2], N the number of blades. Both take the blade as straight and
  radial.
- Wound thread does not act on the body (blade.wound_mass: ignored), so every node appears at its release with momentum
  that had not been counted: 0.15 % in all. `angular_momentum_jumps` books it. With `carried` the wound thread's mass
  turns (and, on a free body, moves) with the body, I has the term N rho (L - l) L0^2 more, and momentum is kept.
- (14) is used in inertial axes here, which is the same in exact arithmetic and needs no W' at the nodes.
- A stiffness of 1e7 N/m may be a slip of units: the film itself has about 2e3 N/m at n = 20. It hardly matters: the lag
  differs from that of links of fixed length by 0.0016 deg at 1e4 N/m, the default, and by 2e-5 deg at 1e7 N/m.

`segments: inextensible` is the limit of infinite stiffness: links of fixed length, whose tensions follow from one
tridiagonal solve at every stage. In steady feed the hub's lag is sin(delta) = 2 v / (L0 W), whatever the masses.

Source: Tenenbaum (2014), deployment of the heliogyro sail BMSTU-Sail.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from evolvent import cases, units
from evolvent.cases import Section
from evolvent.errors import InputError, nearest

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.figures import Figure, Number, Scene
    from evolvent.solvers import Solution
    from evolvent.system import System

#: Laws of the user's that `run` knows how to place.
LAWS = ("event", "feed", "force")
#: Largest number of values of the state that a run may keep.
MOST_VALUES = 200_000_000
_WINDOWS = (0.05, 0.14, 0.42, 0.7, 1.0)  # of the duration: the paper's 7, 20, 60, 100, 142 s


class Body(Section):
    """The spinning body."""

    inertia: units.Inertias = Field(
        description="about every axis (only the spin axis counts unless free), or three principal moments; no thread"
    )
    rate: units.AngularRate = Field(description="spin about Z at the start")
    spool_offset: units.Length = Field(description="L0, from the spin axis to the axis of each spool")
    blades: Annotated[int, units.Whole(least=1, most=64)] = Field(2, description="evenly spaced about Z")
    motion: Literal["spin", "free", "driven"] = Field(
        "spin", description="spin about a fixed axis, free in six degrees of freedom, or driven at a constant rate"
    )
    mass: units.Mass | None = Field(None, description="without the thread; needed for motion: free")

    @model_validator(mode="after")
    def _check(self) -> Body:
        if isinstance(self.inertia, tuple) and len(self.inertia) != 3:
            raise InputError(f"body.inertia has {len(self.inertia)} values; it must be one, or three principal moments")
        if self.motion == "free" and self.mass is None:
            raise InputError("body.mass is missing; a body with motion 'free' needs it, such as '2 kg'")
        return self

    @property
    def spin_inertia(self) -> float:
        """J, kg m2."""
        return self.inertia[2] if isinstance(self.inertia, tuple) else self.inertia


class Blade(Section):
    """Every blade, a thread."""

    length: units.Length
    line_density: units.LineDensity
    tip_mass: units.MassOrZero = 0.0
    nodes: Annotated[int, units.Whole(least=1, most=10_000)] = 20
    segments: Literal["springs", "inextensible"] = "springs"
    stiffness: units.Stiffness = Field(1e4, description="of one segment (springs)")
    damping: units.DampingOrZero = Field(1e-3, description="of one segment (springs)")
    velocity_turn: bool = Field(True, description="turn a released node's velocity along the thread, eq. 12 (springs)")
    wound_mass: Literal["ignored", "carried"] | None = Field(
        None, description="whether wound thread acts on the body; left out: ignored, but carried on a free body"
    )
    lets_go: bool = Field(False, description="whether the thread leaves the spool when it is all out")
    width: units.Length | None = Field(None, description="chord of the blade, needed for sunlight")


class Change(Section):
    """A change of the spools' rate."""

    time: units.DurationOrZero = Field(description="when it begins")
    rate: units.AngularRates = Field(description="the new rate: 0 stops, a negative one reels in")
    ramp: units.DurationOrZero = Field(0.0, description="time that the smooth change takes")


class Spool(Section):
    """The spools and their law of turning: `rate` with `ramp` and `changes`, or a `table`."""

    radius: units.Length
    rate: units.AngularRates | None = Field(None, description="positive pays out")
    ramp: units.DurationOrZero = Field(0.0, description="time in which the rate is smoothly reached from rest")
    changes: tuple[Change, ...] = Field((), description="later changes of the rate, in order of time")
    table: tuple[tuple[units.Time, units.AngularRate], ...] | None = Field(
        None, description="pairs (time, rate) in place of rate, with a smooth monotone curve through them"
    )
    start_length: units.LengthOrZero = Field(0.0, description="thread already out at the start")
    start_lag: units.Angle = Field(0.0, description="lag angle of the thread already out")

    @model_validator(mode="after")
    def _check(self) -> Spool:
        if self.table is not None:
            for key in ("rate", "ramp", "changes"):
                if key in self.model_fields_set and getattr(self, key) != type(self).model_fields[key].default:
                    raise InputError(f"spool.{key} and spool.table are both given; give the rate or the table")
            if len(self.table) < 2:
                raise InputError(f"spool.table has {len(self.table)} rows; it needs two or more pairs (time, rate)")
            for k in range(1, len(self.table)):
                if self.table[k][0] <= self.table[k - 1][0]:
                    raise InputError(
                        f"spool.table.{k} is at {self.table[k][0]:g} s, not after the row before it, "
                        f"at {self.table[k - 1][0]:g} s"
                    )
        end = self.ramp
        for k, change in enumerate(self.changes):
            if change.time < end:
                raise InputError(
                    f"spool.changes.{k}.time is {change.time:g} s; it must not be before {end:g} s, when the rate "
                    f"before it has been reached"
                )
            end = change.time + change.ramp
        if self.start_lag != 0.0 and self.start_length == 0.0:
            raise InputError("spool.start_lag is given, but spool.start_length is 0; give the length already out")
        return self


class Sunlight(Section):
    """Radiation pressure on the blades, whose chord keeps the direction of their spool's axis."""

    pressure: units.PressureOrZero = Field(4.56e-6, description="of light that is wholly absorbed, normal incidence")
    direction: tuple[units.Number, units.Number, units.Number] = Field(
        (0.0, 0.0, 1.0), description="in which the light travels, inertial axes"
    )
    reflectivity: units.Fraction = Field(1.0, description="0 absorbs all, 1 is a mirror")

    @model_validator(mode="after")
    def _check(self) -> Sunlight:
        if not any(self.direction):
            raise InputError("sunlight.direction is zero; it must point somewhere")
        return self


class Solver(Section):
    """The time integration."""

    method: Literal["rk4", "heun", "dopri5"] = "rk4"
    step: units.DurationOrAuto = Field("auto", description="of rk4 and heun")
    rtol: units.Tolerance = Field(1e-8, description="relative tolerance of dopri5")
    atol: units.Tolerance = Field(1e-10, description="absolute tolerance of dopri5")
    duration: units.DurationOrAuto = Field("auto", description="auto: until the first blade is all out")

    @model_validator(mode="after")
    def _check(self) -> Solver:
        if self.method == "dopri5" and self.step != "auto":
            raise InputError(f"solver.step is {self.step!r} s, but dopri5 chooses its steps; leave it out, or take rk4")
        return self


class Output(Section):
    """What is kept."""

    every: units.Duration = Field(0.1, description="time between samples")


class Case(Section):
    """A case of the system `heliogyro`."""

    system: Literal["heliogyro"] = "heliogyro"
    body: Body
    blade: Blade
    spool: Spool
    sunlight: Sunlight | None = None
    solver: Solver = Solver()
    output: Output = Output()

    @model_validator(mode="after")
    def _check(self) -> Case:
        given = [("spool.rate", self.spool.rate)]
        given += [(f"spool.changes.{k}.rate", change.rate) for k, change in enumerate(self.spool.changes)]
        for key, rate in given:
            if isinstance(rate, tuple) and len(rate) != self.body.blades:
                raise InputError(f"{key} has {len(rate)} values, but body.blades is {self.body.blades}")
        if self.body.motion == "free" and self.blade.wound_mass == "ignored":
            raise InputError("blade.wound_mass is 'ignored'; on a body with motion 'free' it must be 'carried'")
        if self.sunlight is not None and self.blade.width is None:
            raise InputError("blade.width is missing; sunlight needs it, such as '10 cm'")
        if self.spool.start_length > self.blade.length:
            raise InputError(
                f"spool.start_length is {self.spool.start_length:g} m, more than blade.length {self.blade.length:g} m"
            )
        return self

    @property
    def carried(self) -> bool:
        """Whether wound thread acts on the body."""
        return self.blade.wound_mass == "carried" or self.body.motion == "free"


# ------------------------------------------------------------------------------------------------ the system


def _law(laws: Mapping[str, Any], name: str) -> tuple[Any, tuple[float, ...]]:
    """A user's law and its parameters; (None, ()) if it is not given."""
    given = laws.get(name)
    if isinstance(given, tuple):
        if len(given) != 2:
            raise InputError(f"laws[{name!r}] has {len(given)} entries; it must be a law, or a law and its parameters")
        try:
            return given[0], tuple(float(p) for p in given[1])
        except (TypeError, ValueError):
            raise InputError(f"the parameters of laws[{name!r}] are {given[1]!r}; they must be numbers") from None
    return given, ()


def _feed(case: Case, laws: Mapping[str, Any], blade: int) -> Any:
    """The feed of one blade's spool."""
    from evolvent import parts

    spool = case.spool
    angle = spool.start_length / spool.radius
    law, parameters = _law(laws, "feed")
    if law is not None:
        if spool.start_length > 0.0:
            raise InputError("spool.start_length is given beside laws['feed'], whose angle at t = 0 says what is out")
        return parts.LawFeed(law=law, parameters=parameters)
    if spool.table is not None:
        time, rate = zip(*spool.table, strict=True)
        if time[0] > 0.0:
            raise InputError(f"spool.table starts at {time[0]:g} s; its first row must be at 0 s")
        return parts.TableFeed(time=time, rate=rate, start=angle)
    if spool.rate is None:
        raise InputError("spool.rate is missing; give it, such as '3.5 rad/s', or a spool.table")
    first = _of_blade(spool.rate, blade)
    steps = [(change.time, change.ramp, _of_blade(change.rate, blade)) for change in spool.changes]
    if spool.ramp > 0.0:
        return parts.RampFeed(rate=0.0, angle=angle, steps=[(0.0, spool.ramp, first), *steps])
    return parts.RampFeed(rate=first, angle=angle, steps=steps)


def _of_blade(rate: float | tuple[float, ...], blade: int) -> float:
    return rate[blade] if isinstance(rate, tuple) else rate


def _symmetric(case: Case, laws: Mapping[str, Any]) -> bool:
    """Whether all blades move alike, so that one thread stands for all."""
    rates = [case.spool.rate] + [change.rate for change in case.spool.changes]
    equal = all(not isinstance(rate, tuple) or len(set(rate)) == 1 for rate in rates)
    axial = case.sunlight is None or (case.sunlight.direction[0] == 0.0 and case.sunlight.direction[1] == 0.0)
    return case.body.motion != "free" and equal and axial and laws.get("force") is None


def build(case: Case, *, laws: Mapping[str, Any] | None = None) -> System:
    """The system of a case: the part "body", and "reel-1", "blade-1" and so on.

    Parameters
    ----------
    case : Case
    laws : mapping, see `run`

    Notes
    -----
    Where all blades move alike one thread, "blade-1", stands for all of them.
    """
    from evolvent import parts
    from evolvent.system import System

    laws = laws or {}
    body, blade, spool = case.body, case.blade, case.spool
    system = System()
    if body.motion == "free":
        own: dict[str, Any] = {"mass": body.mass, "angular_velocity": (0.0, 0.0, body.rate)}
    else:
        own = {"rate": body.rate}
    system.add(parts.RigidBody(motion=body.motion, inertia=body.inertia, **own), "body")
    symmetric = _symmetric(case, laws)
    for k in range(1 if symmetric else body.blades):
        turn = 2.0 * np.pi * k / body.blades
        X = np.array([np.cos(turn), np.sin(turn), 0.0])
        Y = np.array([-np.sin(turn), np.cos(turn), 0.0])
        lag = spool.start_lag if body.rate >= 0.0 else -spool.start_lag
        reel, name = f"reel-{k + 1}", f"blade-{k + 1}"
        system.add(
            parts.Reel(
                body="body",
                centre=tuple(body.spool_offset * X),
                feed_axis=tuple(X),
                spool_axis=tuple(Y),
                radius=spool.radius,
                feed=_feed(case, laws, k),
            ),
            reel,
        )
        system.add(
            parts.Thread(
                reel=reel,
                length=blade.length,
                line_density=blade.line_density,
                nodes=blade.nodes,
                tip_mass=blade.tip_mass,
                segments=blade.segments,
                stiffness=blade.stiffness,
                damping=blade.damping,
                direction=tuple(np.cos(lag) * X - np.sin(lag) * Y),
                velocity_turn=blade.velocity_turn,
                wound_mass="carried" if case.carried else "ignored",
                lets_go=blade.lets_go,
                copies=body.blades if symmetric else 1,
            ),
            name,
        )
        if case.sunlight is not None and blade.width is not None:
            light = case.sunlight
            system.add(
                parts.RadiationPressure(
                    thread=name,
                    pressure=light.pressure,
                    width=blade.width,
                    direction=light.direction,
                    reflectivity=light.reflectivity,
                )
            )
        law, parameters = _law(laws, "force")
        if law is not None:
            system.add(parts.LawLoad(thread=name, law=law, parameters=parameters))
    law, parameters = _law(laws, "event")
    if law is not None:
        system.add(parts.Event(law=law, parameters=parameters, stops=True))
    return system


def run(
    case: Case, *, laws: Mapping[str, Any] | None = None, progress: Callable[[float], None] | None = None
) -> xr.Dataset:
    """Run a case.

    Parameters
    ----------
    case : Case
    laws : mapping, optional, name -> law, or (law, parameters)
        "feed": ``@evolvent.feed_law`` of every spool, in place of rate and table; "force": ``@evolvent.force_law``,
        force per length on every blade, N/m, inertial axes; "event": ``@evolvent.event_law`` that ends the run where it
        rises through zero.
    progress : called with the time reached (s), a few times a second

    Returns
    -------
    xarray.Dataset
        Whatever its status; `evolvent.run` raises `RunFailed` for a failed one.

    Raises
    ------
    InputError
        If the case cannot be run, or a law raises.
    """
    from evolvent.solvers import solve

    laws = {name: law for name, law in (laws or {}).items() if law is not None}
    for name in laws:
        if name not in LAWS:
            raise InputError(f"no law is called {name!r}; {nearest(name, LAWS)}")
    try:
        assembly = build(case, laws=laws).assemble()
        samples = _samples(case, assembly, "feed" in laws)
        solver = case.solver
        step = solver.step if isinstance(solver.step, float) else None
        solution = solve(
            assembly,
            samples=samples,
            method=solver.method,
            step=step,
            rtol=solver.rtol,
            atol=solver.atol,
            progress=progress,
        )
        return _results(case, assembly, solution, laws)
    except InputError:
        raise
    except Exception as error:
        if not laws:
            raise
        names = " or ".join(repr(name) for name in sorted(laws))
        raise InputError(f"the law {names} raised {type(error).__name__}: {' '.join(str(error).split())}") from error


def duration(case: Case, *, laws: Mapping[str, Any] | None = None) -> float:
    """Time that a case runs over, s."""
    return float(_samples(case, build(case, laws=laws).assemble(), "feed" in (laws or {}))[-1])


def _turned(assembly: Assembly, times: np.ndarray) -> np.ndarray:
    """Angles of all spools, rad, (nt, threads)."""
    from evolvent.kernels.feed import feed

    model = assembly.model
    angles = np.empty((times.size, model.threads.size))
    for p, row in enumerate(model.threads):
        parameters = model.parameters[int(row["first"]) : int(row["last"])]
        for k, time in enumerate(times):
            angles[k, p] = feed(int(row["feed"]), parameters, int(row["law"]), float(time))[0]
    return angles


def _samples(case: Case, assembly: Assembly, by_law: bool) -> np.ndarray:
    """Times of the samples; refuses a feed that pays out more than there is, or less than nothing."""
    length, radius = case.blade.length, case.spool.radius
    end = _all_out(case, assembly) if case.solver.duration == "auto" else float(case.solver.duration)
    if end is None or (by_law and case.solver.duration == "auto"):
        raise InputError(
            "solver.duration is auto, but this feed does not tell when a blade is all out; give it, such as '60 s'"
        )
    breaks = assembly.model.breaks
    times = np.union1d(np.linspace(0.0, end, 2001), breaks[(breaks > 0.0) & (breaks < end)])
    out = radius * _turned(assembly, times)
    if not case.blade.lets_go and out.max() > length * (1.0 + 1e-9):
        k = int(np.flatnonzero(out.max(axis=1) > length * (1.0 + 1e-9))[0])
        raise InputError(
            f"the feed outruns the thread: it has paid out {out.max():.6g} m by t = {end:.6g} s, but blade.length is "
            f"{length:g} m, all out at about {times[k]:.6g} s; shorten solver.duration, slow spool.rate, "
            f"or set blade.lets_go"
        )
    if out.min() < -1e-9 * length:
        k = int(np.flatnonzero(out.min(axis=1) < -1e-9 * length)[0])
        raise InputError(f"the feed reels in more than is out at t = {times[k]:.6g} s; stop it before")
    if case.blade.segments == "inextensible":
        _check_inextensible(case, assembly)
    every = case.output.every
    count = end / every
    if count * assembly.y.size > MOST_VALUES:
        raise InputError(f"output.every is {every:g} s; that makes {count:.3g} samples over {end:g} s, too many")
    samples = every * np.arange(int(count + 1e-9) + 1)
    if end - samples[-1] > 1e-6 * every:
        return np.append(samples, end)
    samples[-1] = end
    return samples


def _check_inextensible(case: Case, assembly: Assembly) -> None:
    """Refuse what links of fixed length cannot follow."""
    first = case.spool.radius * np.diff(_turned(assembly, np.array([0.0, 1e-6])), axis=0)
    if case.spool.start_length == 0.0 and np.any(np.abs(first) < 1e-12):
        raise InputError(
            "spool.start_length is 0, but the feed starts at rest, where an inextensible thread has no direction; "
            "give a length that is already out, such as '5 mm'"
        )
    for k, change in enumerate(case.spool.changes):
        if change.ramp == 0.0:
            raise InputError(
                f"spool.changes.{k}.ramp is 0, but an inextensible thread cannot follow a jump of the feed; "
                f"give it a time, such as '1 s'"
            )


def _all_out(case: Case, assembly: Assembly) -> float | None:
    """Time at which the first blade is all out, s; None if that does not happen."""
    from scipy.optimize import brentq

    angle = case.blade.length / case.spool.radius
    last = float(assembly.model.breaks.max(initial=0.0))
    times = np.linspace(0.0, last, 2001) if last > 0.0 else np.zeros(1)
    turned = _turned(assembly, times).max(axis=1)
    beyond = np.flatnonzero(turned >= angle)
    if beyond.size:
        k = int(beyond[0])
        if k == 0:
            return None
        return float(brentq(lambda t: _turned(assembly, np.array([t])).max() - angle, times[k - 1], times[k]))
    end = _turned(assembly, np.array([last, last + 1.0]))
    rates = end[1] - end[0]
    with np.errstate(divide="ignore"):
        left = np.where(rates > 0.0, (angle - end[0]) / rates, np.inf)
    return last + float(left.min()) if np.isfinite(left.min()) else None


# ------------------------------------------------------------------------------------------------ results


def straight_inertia(case: Case, deployed: np.ndarray, *, corrected: bool) -> np.ndarray:
    """Moment of inertia of body and straight radial blades about the spin axis, kg m2.

    Parameters
    ----------
    deployed : (nt, blades) float, m
    corrected : bool, with the spools' distance from the spin axis and, where it is carried, the wound thread;
        without, as in (18)
    """
    rho, tip = case.blade.line_density, case.blade.tip_mass
    L0 = case.body.spool_offset if corrected else 0.0
    each = rho * ((L0 + deployed) ** 3 - L0**3) / 3.0 + tip * (L0 + deployed) ** 2
    if corrected and case.carried:
        each = each + rho * (case.blade.length - deployed) * L0**2
    return case.body.spin_inertia + each.sum(axis=1)


def _results(case: Case, assembly: Assembly, solution: Solution, laws: Mapping[str, Any]) -> xr.Dataset:
    """The run as a Dataset."""
    import xarray as xr

    from evolvent import model as mdl
    from evolvent.flow import observe
    from evolvent.results import label, variable

    model, n, N = assembly.model, case.blade.nodes, case.body.blades
    seen = observe(model, solution.t, solution.y, solution.s)
    b = assembly.index("body", "bodies")
    R, X, V, w = (a[:, b] for a in (seen.body_rotation, seen.body_position, seen.body_velocity, seen.body_rate))
    arm = seen.position - X[:, None]
    relative = seen.velocity - V[:, None] - np.cross(w[:, None], arm)
    position = _per_blade(np.einsum("tji,tnj->tni", R, arm), n, N)
    velocity = _per_blade(np.einsum("tji,tnj->tni", R, relative), n, N)
    threads = model.threads.size
    out = np.broadcast_to(solution.s[:, :threads], (solution.t.size, N))
    gone = np.broadcast_to(solution.s[:, threads : 2 * threads] != 0, (solution.t.size, N))
    released = np.arange(n) < out[:, :, None]
    tension = np.broadcast_to(seen.tension.reshape(solution.t.size, threads, n), released.shape)
    tension = np.where(released, tension, np.nan)
    deployed = np.clip(case.spool.radius * seen.spool[:, :, 0], 0.0, case.blade.length)
    deployed = np.where(gone, case.blade.length, np.broadcast_to(deployed, out.shape))
    rate = np.einsum("ti,ti->t", R[:, :, 2], w)
    slack = _slack(case, solution.t, tension)
    time, blade = ("time",), ("time", "blade")
    node = ("time", "blade", "node")
    data = {
        "position": variable((*node, "axis"), position, "m", "position of the node, body axes from the body's centre"),
        "velocity": variable((*node, "axis"), velocity, "m s-1", "velocity relative to the rotating body, body axes"),
        "tension": variable(
            node, tension, "N", "tension of the segment inwards of the node (NaN while wound)", slack=slack
        ),
        "lag_angle": variable(
            node, _lag(case, position, released), "rad", "lag angle in the frame of the blade's own spool, eq. 19"
        ),
        "released": variable(node, released, "1", "whether the node has left its spool"),
        "let_go": variable(blade, gone, "1", "whether the whole thread has left its spool"),
        "deployed_length": variable(blade, deployed, "m", "length of thread paid out"),
        "hub_tension": variable(blade, _hub(tension, out, gone), "N", "tension of the segment at the spool"),
        "body_rate": variable(time, rate, "rad s-1", "rate of the body about its spin axis"),
        "body_angle": variable(time, _angle(R, rate, solution.t), "rad", "angle of the body about Z, unwrapped"),
    }
    data |= _accounts(case, solution, seen.inventory, int(model.info["nq"][0] + model.info["nv"][0]), laws)
    if case.body.motion != "driven":
        for name, corrected, what in (
            ("body_rate_paper", False, "rate of the body by (18)"),
            ("body_rate_corrected", True, "rate of the body by (18) with the offset of the spools"),
        ):
            inertia = straight_inertia(case, deployed, corrected=corrected)
            start = np.full((1, N), case.spool.start_length)
            first = straight_inertia(case, start, corrected=corrected)[0]
            formula = np.where(np.any(gone, axis=1), np.nan, case.body.rate * first / inertia)
            data[name] = variable(time, formula, "rad s-1", what)
    if case.body.motion == "free":
        at = int(model.bodies["iq"][b])
        data["body_position"] = variable(("time", "axis"), X, "m", "position of the body's centre, inertial axes")
        data["body_quaternion"] = variable(
            ("time", "quaternion"), solution.y[:, at + 3 : at + 7], "1", "attitude, body to inertial, scalar first"
        )
        data["linear_momentum"] = variable(
            ("time", "axis"), seen.inventory[:, mdl.P_ALL : mdl.P_ALL + 3], "kg m s-1", "linear momentum of all parts"
        )
    dataset = xr.Dataset(
        data,
        {
            "time": variable(time, solution.t, "s", "time"),
            "blade": variable(("blade",), np.arange(1, N + 1), "1", "blade"),
            "node": variable(("node",), np.arange(1, n + 1), "1", "node, 1 is the tip"),
            "axis": ("axis", ["x", "y", "z"]),
        },
    )
    names = {name: getattr(_law(laws, name)[0], "__name__", repr(laws[name])) for name in laws}
    label(
        dataset,
        system="heliogyro",
        case=cases.to_yaml(case),
        method=case.solver.method,
        solution=solution,
        laws=names,
    )
    warnings = [text for text in (slack, _wraps(case, seen.spool)) if text]
    if warnings:
        dataset.attrs["warning"] = "; ".join(warnings)
    return dataset


def _per_blade(values: np.ndarray, n: int, blades: int) -> np.ndarray:
    """Vectors of all threads' nodes as (nt, blades, n, 3); copies of one thread are turned about Z."""
    shaped = values.reshape(values.shape[0], -1, n, 3)
    if shaped.shape[1] == blades:
        return shaped
    turns = 2.0 * np.pi * np.arange(blades) / blades
    c, s, one, zero = np.cos(turns), np.sin(turns), np.ones(blades), np.zeros(blades)
    turn = np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]])
    return np.einsum("ijb,tnj->tbni", turn, shaped[:, 0])


def _lag(case: Case, position: np.ndarray, released: np.ndarray) -> np.ndarray:
    """Lag angles by (19), rad; NaN for wound nodes and for one that is at Q."""
    turns = 2.0 * np.pi * np.arange(case.body.blades) / case.body.blades
    c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
    x = c * position[..., 0] + s * position[..., 1] - case.body.spool_offset
    y = c * position[..., 1] - s * position[..., 0]
    across = np.hypot(y, position[..., 2] - case.spool.radius)
    away = np.hypot(x, across) > 1e-9
    return np.where(released & away, np.arctan2(across, x), np.nan)


def _hub(tension: np.ndarray, out: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Tension at the spool, N; 0 with nothing out, or all gone."""
    last = np.maximum(out - 1, 0)[:, :, None]
    hub = np.take_along_axis(tension, last, axis=2)[:, :, 0]
    return np.where((out > 0) & ~gone, hub, 0.0)


def _slack(case: Case, time: np.ndarray, tension: np.ndarray) -> str:
    """A sentence on tensions below zero; '' if there are none."""
    least = np.nanmin(np.where(np.isnan(tension), np.inf, tension), axis=(1, 2))
    if not np.any(least < -1e-9):
        return ""
    k, count = int(np.argmin(least)), int(np.sum(least < -1e-9))
    which = "springs push" if case.blade.segments == "springs" else "links push"
    return (
        f"{which} where a thread would go slack: tension below zero in {count} of {time.size} samples, "
        f"at worst {least[k]:.3g} N at t = {time[k]:.6g} s"
    )


def _wraps(case: Case, spool: np.ndarray) -> str:
    """A sentence on a feed too fast for any steady lag; '' if it is not."""
    fastest = case.spool.radius * float(spool[:, :, 1].max())
    limit = 0.5 * case.body.spool_offset * abs(case.body.rate)
    if fastest < limit or limit == 0.0:
        return ""
    return (
        f"the feed of {fastest:.4g} m/s is not below L0 W0 / 2 = {limit:.4g} m/s: no steady lag exists, "
        f"the blade may wrap back onto the body, which the model does not see"
    )


def _angle(R: np.ndarray, rate: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Angle of the body about Z, unwrapped with the help of its rate, rad."""
    angle = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    about = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    turned = about + np.unwrap(angle - about)
    return turned - turned[0] + angle[0]


def _accounts(
    case: Case, solution: Solution, inventory: np.ndarray, at: int, laws: Mapping[str, Any]
) -> dict[str, xr.Variable]:
    """Energies, momenta and their balances."""
    from evolvent import model as mdl
    from evolvent.results import variable

    time = ("time",)
    booked = solution.y[:, at:] - solution.y[0, at:]
    kinetic, elastic = inventory[:, mdl.KINETIC], inventory[:, mdl.ELASTIC]
    energy = kinetic + elastic
    gained = booked[:, mdl.SPOOL] + booked[:, mdl.LOAD] + booked[:, mdl.DRIVE] + booked[:, mdl.RELEASE]
    defect = energy - energy[0] - gained + booked[:, mdl.DISSIPATED]
    largest = max(float(energy.max()), float(np.abs(booked[:, : mdl.JUMP_ANGULAR]).max()), 1e-300)
    body, thread, wound = (inventory[:, k : k + 3] for k in (mdl.H_BODY, mdl.H_RELEASED, mdl.H_WOUND))
    total = body + thread + (wound if case.carried else 0.0)
    jumps = booked[:, mdl.JUMP_ANGULAR : mdl.JUMP_ANGULAR + 3]
    J, H = "J", "kg m2 s-1"
    data = {
        "energy_kinetic": variable(time, kinetic, J, "kinetic energy of all that the model moves"),
        "energy_elastic": variable(time, elastic, J, "strain energy of the segments"),
        "energy_dissipated": variable(time, booked[:, mdl.DISSIPATED], J, "energy dissipated so far"),
        "energy_released": variable(
            time, booked[:, mdl.RELEASE], J, "energy that nodes brought in at their release so far"
        ),
        "spool_work": variable(
            time, booked[:, mdl.SPOOL], J, "work of the spools on the thread so far, negative where they hold it back"
        ),
        "load_work": variable(time, booked[:, mdl.LOAD], J, "work of the loads so far"),
        "drive_work": variable(time, booked[:, mdl.DRIVE], J, "work of what drives the body so far"),
        "energy_balance": variable(
            time, defect / largest, "1", "what the energy account lacks, over the largest energy"
        ),
        "angular_momentum": variable(time, total[:, 2], H, "angular momentum about Z of all that the model moves"),
        "angular_momentum_body": variable(time, body[:, 2], H, "angular momentum about Z of the body"),
        "angular_momentum_released": variable(time, thread[:, 2], H, "angular momentum about Z of the released thread"),
        "angular_momentum_wound": variable(
            time,
            wound[:, 2],
            H,
            "angular momentum about Z of the wound thread" + ("" if case.carried else " (ignored by the model)"),
        ),
        "angular_momentum_jumps": variable(time, jumps[:, 2], H, "angular momentum about Z that releases brought in"),
    }
    if case.body.motion == "free":
        data["angular_momentum_vector"] = variable(
            ("time", "axis"), total, H, "angular momentum about the inertial origin of all that the model moves"
        )
    if case.body.motion != "driven" and case.sunlight is None and "force" not in laws:
        lost = np.linalg.norm((total - total[0] - jumps)[:, 0 if case.body.motion == "free" else 2 :], axis=1)
        scale = float(np.linalg.norm(total[0]))
        data["momentum_balance"] = variable(
            time,
            lost / scale if scale > 0.0 else lost,
            "1",
            "what the account of angular momentum lacks, over the start",
        )
    return data


# ------------------------------------------------------------------------------------------------ on the screen


def case_of(run: xr.Dataset) -> Case:
    """The case that a run was made from."""
    loaded: Case = cases.load(cases.parse_yaml(run.attrs["case"], "the run's case"))
    return loaded


def numbers(run: xr.Dataset) -> list[Number]:
    """The results that a user wants to see at once."""
    from evolvent.figures import Number

    time, rate = run.time.values, run.body_rate.values
    found = [
        Number(label="time reached", value=f"{time[-1]:.6g} s"),
        Number(
            label="deployed length", value=" / ".join(f"{x:.6g}" for x in _distinct(run.deployed_length[-1])) + " m"
        ),
        Number(label="body rate at the end", value=f"{rate[-1]:.6g} rad/s (at the start {rate[0]:.6g})"),
    ]
    for name, label in (("body_rate_paper", "eq. (18)"), ("body_rate_corrected", "corrected formula")):
        if name in run and np.all(rate != 0.0):
            gap = (run[name].values - rate) / rate
            k = int(np.nanargmax(np.abs(gap)))
            text = f"{100.0 * abs(gap[k]):.3g} % at {time[k]:.6g} s"
            found.append(Number(label=f"largest gap to {label}", value=text))
    lag = np.where(run.let_go.values, np.nan, np.degrees(run.lag_angle.values[:, :, 0]))
    for low, high in itertools.pairwise(_WINDOWS):
        inside = (time >= low * time[-1]) & (time <= high * time[-1])
        window = lag[inside]
        if np.all(np.any(np.isfinite(window), axis=0)):
            means = [f"{np.nanmean(window[:, k]):.4g}" for k in _unlike(lag)]
            label = f"mean tip lag, {low * time[-1]:.4g} to {high * time[-1]:.4g} s"
            found.append(Number(label=label, value=" / ".join(means) + " deg"))
    if np.any(run.hub_tension.values):
        hub = run.hub_tension.values.max(axis=1)
        k = int(np.argmax(hub))
        text = f"{hub[k]:.4g} N at {time[k]:.6g} s"
        found.append(Number(label="largest hub tension", value=text))
    found.append(
        Number(label="energy balance", value=f"{np.abs(run.energy_balance.values).max():.2g} of the largest energy")
    )
    if "momentum_balance" in run:
        text = f"{run.momentum_balance.values.max():.2g} of the start"
        found.append(Number(label="angular momentum balance", value=text))
    if "linear_momentum" in run:
        drift = np.abs(run.linear_momentum.values - run.linear_momentum.values[0]).max()
        found.append(Number(label="drift of linear momentum", value=f"{drift:.2g} kg m/s"))
    if run.attrs.get("warning"):
        found.append(Number(label="warning", value=run.attrs["warning"]))
    statistics = json.loads(run.attrs["statistics"])
    steps = f"{statistics['steps']:,} of {run.attrs['solver']}"
    if statistics.get("rejected_steps"):
        steps += f", {statistics['rejected_steps']:,} rejected"
    if statistics.get("step"):
        steps += f", {statistics['step']:.4g} s each"
    found.append(Number(label="steps", value=steps))
    text = f"{run.attrs['wall_time_s']:.3g} s (compiling or loading compiled code: {run.attrs['compile_time_s']:.2g} s)"
    found.append(Number(label="time of the solve", value=text))
    return found


def _distinct(values: Any) -> list[float]:
    """Values without those equal to the first, if all are."""
    listed = [float(v) for v in np.asarray(values)]
    return listed[:1] if np.ptp(listed) <= 1e-9 * max(abs(listed[0]), 1e-300) else listed


def _unlike(values: np.ndarray) -> list[int]:
    """Blades to show: the first alone if all have the same (nt, blades) values."""
    first = values[:, :1]
    alike = np.allclose(values, first, rtol=1e-9, atol=1e-12, equal_nan=True)
    return [0] if alike else list(range(values.shape[1]))


def figures(run: xr.Dataset) -> list[Figure]:
    """What to draw of a run."""
    found = [_rate_figure(run), _lag_figure(run), _shape_figure(run), _tension_figure(run), _balance_figure(run)]
    if "body_position" in run:
        found.append(_body_figure(run))
    return found


def _rate_figure(run: xr.Dataset) -> Figure:
    """Body rate beside both formulas."""
    from evolvent.figures import Figure, Line, Panel

    time, rate = run.time.values, run.body_rate.values
    lines, gaps = [Line(x=time, y=rate, label="computed")], []
    for name, label, color in (
        ("body_rate_paper", "eq. (18)", 2),
        ("body_rate_corrected", "eq. (18) with spool offset", 1),
    ):
        if name in run:
            lines.append(Line(x=time, y=run[name].values, label=label, color=color, style="--"))
        if name in run and np.all(rate != 0.0):
            gaps.append(Line(x=time, y=100.0 * (run[name].values - rate) / rate, label=label, color=color))
    panels = [Panel(x_label="time, s", y_label="body rate, rad/s", lines=lines)]
    if gaps:
        panels.append(Panel(x_label="time, s", y_label="formula less computed, %", lines=gaps))
    size = (8.0, 6.5) if gaps else (8.0, 4.0)
    return Figure(name="body_rate", title="Rate of the body", panels=panels, size=size)


def _lag_figure(run: xr.Dataset) -> Figure:
    """Tip lag, whole and at the start."""
    from evolvent.figures import Figure, Line, Panel

    time, lag = run.time.values, np.degrees(run.lag_angle.values[:, :, 0])
    shown = _unlike(lag)

    def lines(upto: float) -> list[Line]:
        k = time <= upto
        marker = "." if k.sum() < 80 else ""
        return [
            Line(x=time[k], y=lag[k, b], label=f"blade {b + 1}" if len(shown) > 1 else "", color=c, marker=marker)
            for c, b in enumerate(shown)
        ]

    first = min(5.0, float(time[-1]))
    panels = [Panel(x_label="time, s", y_label="lag angle of the tip, deg", lines=lines(float(time[-1])))]
    if first < 0.5 * time[-1]:
        panels.append(
            Panel(
                x_label="time, s", y_label="lag angle of the tip, deg", lines=lines(first), title=f"first {first:g} s"
            )
        )
    return Figure(name="tip_lag", title="Lag of the tip (eq. 19)", panels=panels, size=(8.0, 3.3 * len(panels)))


def _moments(run: xr.Dataset, count: int) -> list[int]:
    """Samples evenly spread over a run, without the first."""
    return sorted({int(k) for k in np.linspace(0, run.sizes["time"] - 1, count + 1)[1:]})


def _blade_points(run: xr.Dataset, k: int, blade: int) -> np.ndarray:
    """Points of a blade at sample k from the tip to the spool, (n + 1, 3), m, body axes; wound nodes at the spool."""
    case = case_of(run)
    turn = 2.0 * np.pi * blade / case.body.blades
    L0 = case.body.spool_offset
    Q = np.array([L0 * np.cos(turn), L0 * np.sin(turn), case.spool.radius])
    x = run.position.values[k, blade][run.released.values[k, blade]]
    return x if run.let_go.values[k, blade] else np.vstack([x, Q])


def _shape_figure(run: xr.Dataset) -> Figure:
    """Shape at several times: from above, by the lag along blade 1 and, where it matters, from the side."""
    from evolvent.figures import Figure, Line, Panel

    case, time, blades = case_of(run), run.time.values, run.sizes["blade"]
    top, side, lag, height, reach = [], [], [], 0.0, 0.0
    for k in reversed(_moments(run, 7)):
        color = float(time[k] / time[-1])
        for b in range(blades):
            x = _blade_points(run, k, b)
            label = f"{time[k]:.4g} s" if b == 0 else ""
            distance = np.hypot(x[:, 0], x[:, 1])
            top.append(
                Line(x=x[:, 0], y=x[:, 1], label=label, color=color, marker=".", width=1.0 + 3.0 * (1.0 - color))
            )
            side.append(Line(x=distance, y=x[:, 2], label=label, color=color, marker="."))
            height, reach = max(height, float(np.ptp(x[:, 2]))), max(reach, float(distance.max()))
        out = run.released.values[k, 0]
        length = run.deployed_length.values[k, 0] - case.blade.length / case.blade.nodes * np.arange(out.sum())
        angle = np.degrees(run.lag_angle.values[k, 0, out])
        lag.append(Line(x=length, y=angle, label=f"{time[k]:.4g} s", color=color, marker="."))
    panels = [
        Panel(x_label="x, m", y_label="y, m", lines=top, title="from above, axes of the body", equal=True),
        Panel(x_label="length from the spool, m", y_label="lag angle (19), deg", lines=lag, title="nodes of blade 1"),
    ]
    if height > 0.01 * reach:
        panels.append(
            Panel(x_label="distance from the spin axis, m", y_label="z, m", lines=side, title="from the side")
        )
    heights = [2.2 if blades > 2 else 1.0] + [1.0] * (len(panels) - 1)
    size = (8.0, 3.5 * sum(heights))
    return Figure(name="shape", title="Shape of the blades", panels=panels, size=size, heights=heights)


def _tension_figure(run: xr.Dataset) -> Figure:
    """Tension at the hub over time, and along the thread at several times."""
    from evolvent.figures import Figure, Line, Panel

    case, time = case_of(run), run.time.values
    hub = run.hub_tension.values
    shown = _unlike(hub)
    lines = [
        Line(x=time, y=1e3 * hub[:, b], label=f"blade {b + 1}" if len(shown) > 1 else "", color=c, width=1.0)
        for c, b in enumerate(shown)
    ]
    along = []
    segment = case.blade.length / case.blade.nodes
    for k in _moments(run, 7):
        tension = run.tension.values[k, 0]
        count = int(np.sum(run.released.values[k, 0]))
        from_tip = segment * (np.arange(count) + 0.5)
        color = float(time[k] / time[-1])
        along.append(Line(x=from_tip, y=1e3 * tension[:count], label=f"{time[k]:.4g} s", color=color, marker="."))
    panels = [
        Panel(x_label="time, s", y_label="tension at the spool, mN", lines=lines),
        Panel(x_label="length from the tip, m", y_label="tension, mN", lines=along, title="along blade 1"),
    ]
    return Figure(name="tension", title="Tension of the thread", panels=panels, size=(8.0, 7.0))


def _balance_figure(run: xr.Dataset) -> Figure:
    """Energy, momentum, what releases bring in, and how well both accounts close."""
    from evolvent.figures import Figure, Line, Panel

    time = run.time.values

    def parts(names: list[tuple[str, str, float]]) -> list[Line]:
        lines = []
        for color, (name, label, sign) in enumerate(names):
            seen = name in run and np.abs(run[name].values).max() > 1e-4 * np.abs(run[names[0][0]].values).max()
            if seen or color < 2:
                lines.append(Line(x=time, y=1e3 * sign * run[name].values, label=label, color=color))
        return lines

    energy = [
        ("energy_kinetic", "kinetic", 1.0),
        ("spool_work", "taken by the spools", -1.0),
        ("energy_elastic", "elastic", 1.0),
        ("energy_dissipated", "dissipated", 1.0),
        ("load_work", "from loads", 1.0),
        ("drive_work", "from the drive", 1.0),
    ]
    momentum = [
        ("angular_momentum", "all that the model moves", 1.0),
        ("angular_momentum_body", "body", 1.0),
        ("angular_momentum_released", "released thread", 1.0),
        ("angular_momentum_wound", "wound thread", 1.0),
    ]
    releases, defects = [], []
    for color, kind, name, start in (
        (1, "energy", "energy_released", run.energy_kinetic.values[0] + run.energy_elastic.values[0]),
        (2, "angular momentum", "angular_momentum_jumps", run.angular_momentum.values[0]),
    ):
        if start != 0.0:
            releases.append(Line(x=time, y=100.0 * run[name].values / start, label=kind, color=color))
    for color, kind, name in ((1, "energy", "energy_balance"), (2, "angular momentum", "momentum_balance")):
        if name in run:
            values = np.abs(run[name].values)
            defects.append(Line(x=time, y=np.where(values > 0.0, values, np.nan), label=kind, color=color, width=1.0))
    panels = [
        Panel(x_label="", y_label="energy, mJ", lines=parts(energy)),
        Panel(x_label="", y_label="angular momentum,\n1e-3 kg m2/s", lines=parts(momentum)),
        Panel(x_label="", y_label="% of the start", lines=releases, title="brought in by nodes at their release"),
        Panel(x_label="time, s", y_label="relative defect", lines=defects, title="what the accounts lack", log=True),
    ]
    return Figure(name="balances", title="Energy and angular momentum", panels=panels, size=(8.0, 10.0))


def _body_figure(run: xr.Dataset) -> Figure:
    """Motion of a free body: its centre and the tilt of its axis."""
    from evolvent.figures import Figure, Line, Panel

    time, q = run.time.values, run.body_quaternion.values
    tilt = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (q[:, 1] ** 2 + q[:, 2] ** 2), -1.0, 1.0)))
    centre = [
        Line(x=time, y=1e3 * run.body_position.values[:, c], label=axis, color=c + 1) for c, axis in enumerate("xyz")
    ]
    panels = [
        Panel(x_label="time, s", y_label="centre of the body, mm", lines=centre, title="inertial axes"),
        Panel(x_label="time, s", y_label="tilt of the body's axis, deg", lines=[Line(x=time, y=tilt)]),
    ]
    return Figure(name="body", title="Motion of the body", panels=panels, size=(8.0, 6.5))


def scene(run: xr.Dataset) -> Scene:
    """The deployment in three dimensions."""
    from evolvent.figures import Scene

    case, time = case_of(run), run.time.values
    blades, n = run.sizes["blade"], run.sizes["node"]
    turns = 2.0 * np.pi * np.arange(blades) / blades
    L0, radius = case.body.spool_offset, case.spool.radius
    Q = np.stack([L0 * np.cos(turns), L0 * np.sin(turns), np.full(blades, radius)], axis=1)
    released = run.released.values
    points = np.empty((time.size, blades, n + 1, 3))
    points[:, :, :n] = np.where(released[..., None], run.position.values, Q[:, None])
    points[:, :, n] = np.where(run.let_go.values[..., None], points[:, :, n - 1], Q)
    angle = run.body_angle.values
    tilt = np.tile([1.0, 0.0, 0.0, 0.0], (time.size, 1))
    origin = np.zeros((time.size, 3))
    if "body_quaternion" in run:
        tilt, origin = _tilt(run.body_quaternion.values, angle), run.body_position.values
    around = np.linspace(0.0, 2.0 * np.pi, 25)
    hub = L0 * np.stack([np.cos(around), np.sin(around), np.zeros(25)], axis=1)
    numbers = {"body rate, rad/s": run.body_rate.values, "deployed, m": run.deployed_length.values[:, 0]}
    numbers["tip lag, deg"] = np.degrees(run.lag_angle.values[:, 0, 0])
    return Scene(
        title="Deployment of the heliogyro's blades",
        time=time,
        points=points,
        value=1e3 * run.tension.values,
        value_label="tension, mN",
        origin=origin,
        angle=angle,
        tilt=tilt,
        body=[hub],
        numbers=numbers,
    )


def _tilt(q: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """What is left of attitudes q once the turn by `angle` about Z is taken out: (angle about Z)^-1 q."""
    c, s = np.cos(0.5 * angle), -np.sin(0.5 * angle)
    left = np.stack(
        [c * q[:, 0] - s * q[:, 3], c * q[:, 1] - s * q[:, 2], c * q[:, 2] + s * q[:, 1], c * q[:, 3] + s * q[:, 0]],
        axis=1,
    )
    return np.where(left[:, :1] < 0.0, -left, left)
