"""From a case to a system, a solution and a data set."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.errors import InputError, in_keys, naming_keys, nearest
from evolvent.systems._common import sample_times
from evolvent.systems.heliogyro.case import Case

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.solvers import Solution
    from evolvent.solvers.implicit import ImplicitSolution
    from evolvent.system import System


#: Laws of the user's that `run` knows how to place.
LAWS = ("event", "feed", "force")
#: Share of the energy at the start that its account may lack without a warning.
LARGEST_DEFECT = 1e-5
#: Step of generalized-alpha where none is given, s.
IMPLICIT_STEP = 2.5e-3
#: Largest number of steps that a run may take: some minutes to an hour.
MOST_STEPS = 100_000_000


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
        if time[0] != 0.0:
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
    from evolvent.solvers.implicit import solve_implicit

    if not isinstance(laws, Mapping | None):
        raise InputError(f"the laws are {laws!r}; they must be a mapping of names ({', '.join(LAWS)}) to laws")
    laws = {name: law for name, law in (laws or {}).items() if law is not None}
    for name in laws:
        if name not in LAWS:
            raise InputError(f"no law is called {name!r}; {nearest(str(name), LAWS)}")
    assembly, samples, step = _prepared(case, laws)
    solver = case.solver
    solution: Solution | ImplicitSolution
    keys = cases.solver_keys(case)
    with naming_keys(keys):
        if solver.method == "generalized-alpha":
            step = IMPLICIT_STEP if step is None else step
            solution = solve_implicit(assembly, samples=samples, step=step, progress=progress)
        else:
            solution = solve(
                assembly,
                samples=samples,
                method=solver.method,
                step=step,
                rtol=solver.rtol,
                atol=solver.atol,
                progress=progress,
            )
    solution = dataclasses.replace(solution, message=in_keys(solution.message, keys))
    return _results(case, assembly, solution, laws)


def stepping(case: Case) -> dict[str, Any]:
    """What the section ``solver`` asks of an `evolvent.Stepper`, by the names of its arguments."""
    solver = case.solver
    step = solver.step if isinstance(solver.step, float) else None
    if solver.method == "generalized-alpha" and step is None:
        step = IMPLICIT_STEP
    return {"method": solver.method, "step": step, "tolerance": solver.rtol, "spectral_radius": 0.3}


def plan(case: Case) -> cases.Plan:
    """What a run of a case takes; refuses what `run` would refuse, before anything long is compiled."""
    from evolvent.solvers.drive import choose_step

    assembly, samples, step = _prepared(case, {})
    if case.solver.method == "generalized-alpha":
        from evolvent import families

        families.check(assembly, families.IMPLICIT)
    elif step is not None:  # compiles a little, which a step of the solver's own choice need not wait for
        with naming_keys(cases.solver_keys(case)):
            choose_step(assembly, case.solver.method, step, float(samples[-1]))
    return cases.Plan(duration=float(samples[-1]), solver=case.solver.method)


def _prepared(case: Case, laws: Mapping[str, Any]) -> tuple[Assembly, np.ndarray, float | None]:
    """What the solver takes: assembly, times of the samples, step (None for one that it chooses)."""
    from evolvent.solvers.laws import refusing_laws

    assembly = build(case, laws=laws).assemble()
    with refusing_laws(assembly):
        samples = _samples(case, assembly, by_law="feed" in laws)
    step = case.solver.step if isinstance(case.solver.step, float) else None
    _check_steps(case, step, float(samples[-1]))
    return assembly, samples, step


def _check_steps(case: Case, step: float | None, end: float) -> None:
    """Refuse a run of too many steps."""
    blade = case.blade
    which, change = "solver.step", "take a longer solver.step"
    if step is None:
        if case.solver.method == "generalized-alpha":
            return
        if blade.segments == "inextensible":  # nothing says beforehand what steps these need
            return
        frequency = 2.0 * np.sqrt(blade.stiffness * blade.nodes / (blade.line_density * blade.length))
        step = float(2.8 / frequency)
        which, change = "the largest stable step", "lower blade.stiffness or blade.nodes"
    if end > MOST_STEPS * step:
        raise InputError(
            f"{which} is {step:.3g} s; that makes {end / step:.2g} steps over {end:.6g} s, more than {MOST_STEPS:.0e}; "
            f"{change}, or shorten solver.duration"
        )


def layout(case: Case) -> dict[str, dict[str, int | None]]:
    """Variables that every run has, with the sizes of their dimensions; None for any size."""
    time: dict[str, int | None] = {"time": None}
    blade = time | {"blade": case.body.blades}
    node = blade | {"node": case.blade.nodes}
    found = dict.fromkeys(("time", "body_rate", "body_angle", "energy_balance", "angular_momentum"), time)
    found |= dict.fromkeys(("energy_kinetic", "energy_elastic", "energy_dissipated", "energy_released"), time)
    found |= dict.fromkeys(("spool_work", "load_work", "drive_work"), time)
    found |= {f"angular_momentum_{name}": time for name in ("body", "released", "wound", "jumps")}
    found |= dict.fromkeys(("let_go", "deployed_length", "hub_tension"), blade)
    found |= dict.fromkeys(("tension", "lag_angle", "signed_lag", "released"), node)
    found |= {"position": node | {"axis": 3}, "velocity": node | {"axis": 3}}
    if case.body.motion != "driven":
        found |= dict.fromkeys(("body_rate_paper", "body_rate_corrected"), time)
    if case.body.motion == "free":
        found |= {"body_quaternion": time | {"quaternion": 4}, "body_position": time | {"axis": 3}}
        found |= {"linear_momentum": time | {"axis": 3}}
    return found


def _turned(assembly: Assembly, times: np.ndarray) -> np.ndarray:
    """Angles of all spools, rad, (nt, threads)."""
    from evolvent.kernels.feed import feed_angles

    model = assembly.model
    angles = np.empty((model.threads.size, times.size))
    for row, found in zip(model.threads, angles, strict=True):
        parameters = model.parameters[int(row["first"]) : int(row["last"])]
        feed_angles(int(row["feed"]), parameters, int(row["law"]), times, found)
    return angles.T


def _samples(case: Case, assembly: Assembly, *, by_law: bool) -> np.ndarray:
    """Times of the samples; refuses a feed that pays out more than there is, or less than nothing."""
    length, radius = case.blade.length, case.spool.radius
    end = _all_out(case, assembly) if case.solver.duration == "auto" else float(case.solver.duration)
    if end is None or (by_law and case.solver.duration == "auto"):
        raise InputError(f"solver.duration is auto, but {_never_out(case, by_law)}; give it, such as '60 s'")
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
        raise InputError(
            f"{_feed_keys(case, by_law)} reels in more than is out: nothing is left at about {times[k]:.6g} s; "
            f"end that before, shorten solver.duration, or give a longer spool.start_length"
        )
    return sample_times(case.output.every, end, values=assembly.y.size)


def _feed_keys(case: Case, by_law: bool) -> str:
    """The keys that say how the spools turn, with what stands there."""
    if by_law:
        return "laws['feed']"
    if case.spool.table is not None:
        return "spool.table"
    rates = np.atleast_1d(np.array(case.spool.rate))
    text = f"spool.rate, {' / '.join(f'{rate:g}' for rate in rates)} rad/s"
    return text + (", with spool.changes," if case.spool.changes else ",")


def _never_out(case: Case, by_law: bool) -> str:
    """Why no time at which a blade is all out can be found."""
    if by_law:
        return "laws['feed'] does not tell when a blade is all out"
    if case.spool.start_length >= case.blade.length:
        return f"spool.start_length is {case.spool.start_length:g} m, and so the blade is all out at the start"
    return f"{_feed_keys(case, by_law)} never pays a blade all out".replace(",,", ",")


def _all_out(case: Case, assembly: Assembly) -> float | None:
    """Time at which the first blade is all out, s; None if that does not happen."""
    angle = case.blade.length / case.spool.radius
    last = float(assembly.model.breaks.max(initial=0.0))
    times = np.linspace(0.0, last, 2001) if last > 0.0 else np.zeros(1)
    turned = _turned(assembly, times).max(axis=1)
    beyond = np.flatnonzero(turned >= angle)
    if beyond.size:
        k = int(beyond[0])
        if k == 0:
            return None
        from scipy.optimize import brentq  # 0.2 s that most runs do not need

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


def _results(
    case: Case, assembly: Assembly, solution: Solution | ImplicitSolution, laws: Mapping[str, Any]
) -> xr.Dataset:
    """The run as a Dataset."""
    import xarray as xr

    from evolvent import model as mdl
    from evolvent.flow.observations import observe
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
    turned = np.broadcast_to(seen.spool[:, :, 0], out.shape)
    deployed = np.where(gone, case.blade.length, np.clip(case.spool.radius * turned, 0.0, case.blade.length))
    rate = np.einsum("ti,ti->t", R[:, :, 2], w)
    slack = _slack(case, solution.t, tension)
    lag, signed = _lag(case, position, released)
    time, blade = ("time",), ("time", "blade")
    node = ("time", "blade", "node")
    data = {
        "position": variable((*node, "axis"), position, "m", "position of the node, body axes from the body's centre"),
        "velocity": variable((*node, "axis"), velocity, "m s-1", "velocity relative to the rotating body, body axes"),
        "tension": variable(
            node, tension, "N", "tension of the segment inwards of the node (NaN while wound)", slack=slack
        ),
        "lag_angle": variable(node, lag, "rad", "lag angle in the frame of the blade's own spool, eq. 19"),
        "signed_lag": variable(node, signed, "rad", "lag angle in the plane of the spin, negative ahead of the spool"),
        "released": variable(node, released, "1", "whether the node has left its spool"),
        "let_go": variable(blade, gone, "1", "whether the whole thread has left its spool"),
        "spool_angle": variable(blade, turned, "rad", "angle that the spool has turned; at zero all would be wound"),
        "deployed_length": variable(blade, deployed, "m", "length of thread paid out"),
        "hub_tension": variable(blade, _hub(tension, out, gone), "N", "tension of the segment at the spool"),
        "body_rate": variable(time, rate, "rad s-1", "rate of the body about its spin axis"),
        "body_angle": variable(time, _angle(R, rate, solution.t), "rad", "angle of the body about Z, unwrapped"),
    }
    data |= _accounts(case, solution, seen.inventory, int(model.info.nq + model.info.nv), laws)
    if case.body.motion != "driven":
        for name, corrected, what in (
            ("body_rate_paper", False, "rate of the body by (18)"),
            ("body_rate_corrected", True, "rate of the body by (18) with the offset of the spools"),
        ):
            inertia = straight_inertia(case, deployed, corrected=corrected)
            formula = np.where(np.any(gone, axis=1), np.nan, case.body.rate * inertia[0] / inertia)
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
    warnings = [text for text in (slack, _wraps(case, seen.spool), _lacks(dataset)) if text]
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


def _lag(case: Case, position: np.ndarray, released: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lag angles by (19), and with their sign in the plane of the spin, rad; NaN for wound nodes and for one at Q."""
    turns = 2.0 * np.pi * np.arange(case.body.blades) / case.body.blades
    c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
    x = c * position[..., 0] + s * position[..., 1] - case.body.spool_offset
    y = c * position[..., 1] - s * position[..., 0]
    across = np.hypot(y, position[..., 2] - case.spool.radius)
    seen = released & (np.hypot(x, across) > 1e-9)
    behind = y if case.body.rate < 0.0 else -y
    return np.where(seen, np.arctan2(across, x), np.nan), np.where(seen, np.arctan2(behind, x), np.nan)


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


def _lacks(run: xr.Dataset) -> str:
    """A sentence on an energy account that does not close; '' if it does."""
    energy = run["energy_kinetic"].values + run["energy_elastic"].values
    scale = float(run.energy_balance.attrs["scale_J"])
    lacks = scale * float(np.abs(run.energy_balance.values).max()) / (float(energy[0]) or scale)
    if lacks <= LARGEST_DEFECT:
        return ""
    smaller = "solver.rtol" if run.attrs["solver"] == "dopri5" else "solver.step"
    return f"the energy account lacks up to {lacks:.2g} of the energy at the start; take a smaller {smaller}"


def _angle(R: np.ndarray, rate: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Angle of the body about Z, unwrapped with the help of its rate, rad."""
    angle = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    about = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    turned = about + np.unwrap(angle - about)
    return turned - turned[0] + angle[0]


def _accounts(
    case: Case, solution: Solution | ImplicitSolution, inventory: np.ndarray, at: int, laws: Mapping[str, Any]
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
            time, defect / largest, "1", "what the energy account lacks, over the largest energy", scale_J=largest
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
