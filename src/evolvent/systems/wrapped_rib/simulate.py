"""From a case to a system, a solution and a data set."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent import cases
from evolvent.errors import InputError, in_keys, naming_keys
from evolvent.motion import rotation_matrices
from evolvent.systems._common import refuse_laws, sample_times
from evolvent.systems.wrapped_rib import advice
from evolvent.systems.wrapped_rib.case import Case
from evolvent.systems.wrapped_rib.show import CAUSES, estimating_string
from evolvent.systems.wrapped_rib.start import Start, hermite, start

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.parts import RampFeed
    from evolvent.solvers.implicit import ImplicitSolution
    from evolvent.system import System

METHOD = "generalized-alpha"
#: Largest number of steps of a fixed length that a run may take.
MOST_STEPS = 100_000_000
#: Angle over which a hub or a carried tip reaches its rate at least, rad: at once it would take an infinite force.
LEAST_RAMP = 0.1
#: Pivot, beside the largest entry of its column, below which a run tells.
PIVOT_TOLD = 1e-13
#: Share of the energy that the method itself may take, or add, before a run tells.
NUMERICAL_TOLD, GAIN_TOLD = 0.05, 1e-3
#: Where the tip's speed is looked for between samples, of the time in which a light string is wound; and how finely.
WHIP, WHIP_SAMPLES = (0.99, 1.05), 2000
#: Depth, in radii, to which a saved run may have pressed its ribs into the hub as they whipped onto it.
SUNK = 0.1
#: Stiffness of what sticks on the hub, of that of the contact.
STICK = 0.1


def build(case: Case) -> System:
    """The system of a case: the parts "hub", "rib-1", "root-1", "contact-1", "drive-1" and so on.

    Raises
    ------
    InputError
        If the case needs a saved run that does not fit, or parts that are not there.
    """
    return _system(case, start(case))


def _system(case: Case, begin: Start) -> System:
    from evolvent import parts
    from evolvent.system import System

    system = System()
    _add_hub(system, case, begin)
    R = rotation_matrices(begin.hub.quaternion)
    motion, contact, drive = case.hub.motion, case.contact, case.drive
    for b in range(case.rib.count):
        k = b + 1
        turn = 2.0 * np.pi * b / case.rib.count
        outwards = np.array([math.cos(turn), math.sin(turn), 0.0])
        root = tuple(R.T @ (begin.nodes[b, 0, 0] - begin.hub.position))
        system.add(_beam(case, begin.nodes[b], begin.rates[b]), f"rib-{k}")
        place, turn_stiffness = (0.0, None) if case.solver.method == METHOD else case.penalty
        joint = parts.Joint(
            a=("hub", root),
            b=(f"rib-{k}", "root"),
            kind=case.rib.root,
            axis=tuple(R[:, 2]),
            stiffness=place,
            turn_stiffness=turn_stiffness,
        )
        system.add(joint, f"root-{k}")
        if case.rib.root_stiffness > 0.0 or case.rib.root_damping > 0.0:
            rest = turn + begin.directions[b]
            system.add(
                parts.Hinge(
                    body="hub",
                    beam=(f"rib-{k}", "root"),
                    axis=tuple(R[:, 2]),
                    zero=tuple(R @ [math.cos(rest), math.sin(rest), 0.0]),
                    stiffness=case.rib.root_stiffness,
                    damping=case.rib.root_damping,
                ),
                f"hinge-{k}",
            )
        system.add(
            parts.Cylinder(
                body="hub",
                beams=[f"rib-{k}"],
                radius=case.hub.radius,
                half_length=0.5 * case.hub.height,
                **_law(case, begin),
                sunk=1e-3 if case.begins in ("straight", "wound") else SUNK,
            ),
            f"contact-{k}",
        )
        if drive is not None and drive.torque is not None:
            ramp = drive.ramp if drive.kind == "torque" else 0.0
            system.add(parts.FieldTorque(beam=f"rib-{k}", torque=drive.torque, ramp=ramp), f"drive-{k}")
        if drive is not None and drive.kind == "tip":
            taut = case.rib.length * (1.0 + drive.stretch)
            system.add(
                parts.Carry(
                    what=(f"rib-{k}", "tip"),
                    feed=_feed(case, taut / case.hub.radius),
                    radius=case.hub.radius,
                    zero=tuple(outwards),
                    length=taut,
                ),
                f"drive-{k}",
            )
    if contact.self:
        for k in range(1, case.rib.count + 1):
            system.add(_layers(case, begin, k), f"layer-{k}")
    if motion == "driven":
        system.add(parts.Turn(body="hub", feed=_feed(case, None)), "turn")
    return system


def _add_hub(system: System, case: Case, begin: Start) -> None:
    """The hub as a body; a driven one spins, so that what turns it does work."""
    from evolvent import parts

    hub, at = case.hub, begin.hub
    given: dict[str, Any] = {"motion": "driven", "rate": 0.0, "orientation": tuple(at.quaternion)}
    if hub.motion == "free":
        given |= {"motion": "free", "mass": hub.mass, "inertia": hub.inertia, "position": tuple(at.position)}
        given |= {"velocity": tuple(at.velocity), "angular_velocity": tuple(at.rate)}
    elif hub.motion in ("spin", "driven"):
        # without a moment of its own a driven hub has a small share of the ribs', which its drive bears
        light = 1e-3 * case.strip.line_density * case.rib.length * hub.radius**2
        given |= {"motion": "spin", "inertia": light if hub.inertia is None else hub.inertia}
        given["rate"] = float(at.rate[2]) if hub.motion == "spin" else 0.0
    system.add(parts.RigidBody(**given), "hub")


def _beam(case: Case, nodes: np.ndarray, rates: np.ndarray) -> Any:
    """One rib."""
    from evolvent import elements, parts

    rib, damping = case.rib, case.damping
    section: Any = elements.Rectangle(thickness=rib.thickness, width=rib.width)
    if rib.tip_thickness is not None:
        section = elements.Taper(section, elements.Rectangle(thickness=rib.tip_thickness, width=rib.width))
    return parts.Beam(
        length=rib.length,
        section=section,
        material=rib.material,
        elements=rib.elements,
        formulation=rib.formulation,
        nodes=nodes,
        rates=rates,
        mass_damping=damping.alpha,
        stiffness_damping=damping.beta,
        damping=damping.kind,
        damped=case.damped,
    )


def _law(case: Case, begin: Start) -> dict[str, Any]:
    """Law of contact and contact points, of the hub and of the turns."""
    contact = case.contact
    return {
        "law": contact.law,
        "stiffness": begin.stiffness,
        "exponent": contact.exponent,
        "damping": contact.damping if contact.law == "paper" else contact.dissipation,
        "points": contact.points,
        "friction": contact.friction,
        "stick_stiffness": STICK * begin.stiffness,
    }


def _layers(case: Case, begin: Start, k: int) -> Any:
    """Turns of rib k (from 1) on the turns below: its own, or those of the next rib."""
    from evolvent import parts

    rib = case.rib
    return parts.Layers(
        body="hub",
        over=f"rib-{k}",
        under=f"rib-{k % rib.count + 1}" if rib.count > 1 else "",
        thickness=[rib.thickness_at((i + 0.5) / rib.elements) for i in range(rib.elements)],
        width=rib.width,
        **_law(case, begin),
    )


def _feed(case: Case, whole: float | None) -> RampFeed:
    """How the hub turns, or how far a carried tip has wound; ends smoothly at the angle `whole` (rad)."""
    from evolvent import parts

    drive = case.drive
    assert drive is not None
    assert drive.rate is not None
    ramp = max(drive.ramp, 2.0 * LEAST_RAMP / abs(drive.rate))
    if whole is None:  # the hub turns against the winding sense under a rib that is held back
        return parts.RampFeed(steps=[(0.0, ramp, -drive.rate)])
    stop = min(ramp, 2.0 * LEAST_RAMP / drive.rate)
    ends = whole / drive.rate + 0.5 * ramp - 0.5 * stop
    if ends < ramp:
        raise InputError(
            f"drive.ramp is {drive.ramp:g} s, in which all of the rib would be wound at drive.rate {drive.rate:g} "
            f"rad/s; take a shorter one"
        )
    return parts.RampFeed(steps=[(0.0, ramp, drive.rate), (ends, stop, 0.0)])


# ------------------------------------------------------------------------------------------------ runs


def stepping(case: Case) -> dict[str, Any]:
    """What the section ``solver`` asks of an `evolvent.Stepper`, by the names of its arguments."""
    solver = case.solver
    if solver.method != METHOD:
        raise InputError(f"solver.method is {solver.method!r}; a rib is stepped from outside by {METHOD} alone")
    step = None if solver.step == "auto" else float(solver.step)
    return {"step": step, "tolerance": solver.tolerance, "spectral_radius": solver.spectral_radius}


def plan(case: Case) -> cases.Plan:
    """What a run will take; refuses what can be refused before it."""
    _check(case)
    samples = _samples(case)
    system = build(case)
    if case.solver.method == METHOD:
        return cases.Plan(duration=float(samples[-1]), solver=METHOD)
    step = case.solver.step
    if step != "auto":
        from evolvent.solvers.drive import choose_step

        with naming_keys(cases.solver_keys(case)):
            choose_step(system.assemble(), case.solver.method, float(step), float(samples[-1]))
    length = advice.explicit_step(case)
    note = (
        f"{case.solver.method} takes {'' if step != 'auto' else 'about '}{case.duration / length:.2g} steps of "
        f"{length:.2g} s over {case.duration:.6g} s, with penalties of {case.penalty[0]:.3g} N/m in place of the ribs' "
        f"joints; {METHOD} takes some thousand"
    )
    return cases.Plan(duration=float(samples[-1]), solver=_compiled(case.solver.method), note=note)


def _compiled(method: str) -> str:
    """Name under which an explicit method with beams is known as compiled, for it compiles more than without."""
    return f"{method} with beams"


def _check_explicit(case: Case) -> None:
    """Refuse what explicit methods cannot carry, and a run of too many steps."""
    solver, drive = case.solver, case.drive
    instead = f"take solver.method: {METHOD}"
    if drive is not None and drive.kind != "torque":
        moved = "the hub" if drive.kind == "hub" else "the tip"
        raise InputError(
            f"drive.kind is {drive.kind!r}, which moves {moved} by a law that {solver.method} cannot follow; {instead}"
        )
    if case.contact.friction > 0.0:
        raise InputError(
            f"contact.friction is {case.contact.friction:g}, which is known step by step only, not to {solver.method}; "
            f"{instead}, or leave it out"
        )
    if case.contact.self:
        raise InputError(f"contact.self is true, which {solver.method} does not know; {instead}, or leave it out")
    step = advice.explicit_step(case)
    if case.duration > MOST_STEPS * step:
        which = "solver.step" if solver.step != "auto" else f"the longest safe step of {solver.method}"
        raise InputError(
            f"{which} is about {step:.2g} s; that makes {case.duration / step:.2g} steps over {case.duration:.6g} s, "
            f"more than {MOST_STEPS:.0e}; shorten solver.duration, take cables, fewer rib.elements or a smaller "
            f"contact.stiffness, or {instead}"
        )


def _check(case: Case) -> None:
    """Refuse what no part does yet."""
    if case.solver.method != METHOD:
        _check_explicit(case)
    step = case.solver.step
    if step != "auto" and case.duration > MOST_STEPS * float(step):
        raise InputError(
            f"solver.step is {float(step):.3g} s; that makes {case.duration / float(step):.2g} steps, more than "
            f"{MOST_STEPS:.0e}; take a longer one"
        )


def _samples(case: Case) -> np.ndarray:
    """Times of the samples; no fixed step is cut short for one."""
    every = case.output.every
    if case.solver.step != "auto":
        every = max(every, float(case.solver.step))
    return sample_times(every, case.duration, values=24 * case.rib.count * (case.rib.elements + 1))


def run(
    case: Case, *, laws: Mapping[str, Any] | None = None, progress: Callable[[float], None] | None = None
) -> xr.Dataset:
    """Run a case.

    Raises
    ------
    InputError
        If laws are given (this system places none), or the case cannot be run.
    """
    refuse_laws(laws, case.system)
    _check(case)
    samples = _samples(case)
    begin = start(case)
    assembly = _system(case, begin).assemble()
    every, kept = _with_whip(case, samples)
    solution = _solved(case, assembly, every, progress)
    if solution.t.size == 0:  # it failed before its first sample: the start is all that there is
        solution = _at_start(solution, assembly, samples)
    peaks = _peaks(case, _motion(case, begin, assembly, solution), solution.t)
    return _results(case, begin, assembly, _thinned(solution, kept[: solution.t.size]), peaks)


#: Keys of what messages of the solvers name of the parts.
KEYS = {"law": "contact.law", "damping": "contact.damping", "stiffness_damping": "damping.beta"}


def _solved(
    case: Case, assembly: Assembly, samples: np.ndarray, progress: Callable[[float], None] | None
) -> ImplicitSolution:
    """The motion by the case's method, its message in the words of the case."""
    keys = cases.solver_keys(case) | KEYS
    with naming_keys(keys):
        solution = _by_method(case, assembly, samples, progress)
    return dataclasses.replace(solution, message=in_keys(solution.message, keys))


def _by_method(
    case: Case, assembly: Assembly, samples: np.ndarray, progress: Callable[[float], None] | None
) -> ImplicitSolution:
    """The motion by the case's method."""
    solver = case.solver
    step = None if solver.step == "auto" else float(solver.step)
    if solver.method == METHOD:
        from evolvent.solvers.implicit import solve_implicit

        return solve_implicit(
            assembly,
            samples=samples,
            step=step,
            tolerance=solver.tolerance,
            spectral_radius=solver.spectral_radius,
            progress=progress,
        )
    from evolvent import codecache
    from evolvent.solvers import solve
    from evolvent.solvers.drive import METHODS, choose_step
    from evolvent.solvers.flexible import with_account
    from evolvent.solvers.stability import stability_limit

    if step is None:
        duration = float(samples[-1])
        own, _, mode = choose_step(assembly, solver.method, None, duration)
        step = min(own, advice.SHARE * stability_limit(METHODS["rk4"], mode, duration))
    solution = with_account(
        assembly, solve(assembly, samples=samples, method=solver.method, step=step, progress=progress)
    )
    codecache.mark_warm(_compiled(solver.method))
    message = solution.message.replace("or `method` dopri5", f"or `method` {METHOD}")
    statistics = solution.statistics | {"penalty_stiffness": case.penalty[0]}
    return dataclasses.replace(solution, message=message, statistics=statistics)


def _with_whip(case: Case, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times of the samples with those between them at which the tip's speed is looked at; which of them are kept.

    The last bit of a rib whips onto the hub within some ms.
    """
    string = estimating_string(case) if case.solver.step == "auto" else None
    if string is None or not math.isfinite(string.end_time):
        return samples, np.ones(samples.size, dtype=bool)
    low, high = (share * string.end_time for share in WHIP)
    between = np.linspace(low, high, WHIP_SAMPLES)
    between = between[between < samples[-1]]
    nearest = np.abs(samples[np.clip(np.searchsorted(samples, between), 1, None) - 1] - between)
    nearest = np.minimum(nearest, np.abs(samples[np.searchsorted(samples, between)] - between))
    times = np.concatenate([samples, between[nearest > 1e-9 * samples[-1]]])
    order = np.argsort(times)
    return times[order], order < samples.size


def _thinned(solution: ImplicitSolution, kept: np.ndarray) -> ImplicitSolution:
    """The samples that are kept, and the last one."""
    chosen = kept.copy()
    chosen[-1] = True
    found: dict[str, Any] = {
        name: getattr(solution, name)[chosen]
        for name in ("t", "y", "acceleration", "la", "ledger", "cylinders", "wrenches")
    }
    return dataclasses.replace(solution, **found)


def _peaks(case: Case, motion: _Motion, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest speed of each tip (m/s), and when (s)."""
    speed = np.linalg.norm(motion.rates[:, :, -1, 0], axis=-1)
    at = np.argmax(speed, axis=0)
    return speed[at, np.arange(case.rib.count)], time[at]


def _at_start(solution: ImplicitSolution, assembly: Assembly, samples: np.ndarray) -> ImplicitSolution:
    """A solution that holds its start alone."""
    found: dict[str, Any] = {"t": samples[:1], "y": assembly.y[None].copy()}
    for name in ("acceleration", "la", "ledger", "cylinders", "wrenches"):
        values = getattr(solution, name)
        found[name] = np.zeros((1, *values.shape[1:]))
    return dataclasses.replace(solution, **found)


# ------------------------------------------------------------------------------------------------ results


class _Motion(NamedTuple):
    """Nodes and rates of all ribs (nt, ribs, n + 1, vectors, 3), and the hub: place, quaternion, rates, angle."""

    nodes: np.ndarray
    rates: np.ndarray
    x: np.ndarray
    q: np.ndarray
    v: np.ndarray
    w: np.ndarray
    angle: np.ndarray


def _motion(case: Case, begin: Start, assembly: Assembly, solution: ImplicitSolution) -> _Motion:
    model, y, t = assembly.model, solution.y, solution.t
    k = case.rib.vectors
    shape = (t.size, case.rib.elements + 1, k, 3)
    size = 3 * k * (case.rib.elements + 1)
    nodes, rates = [], []
    for b in range(case.rib.count):
        beam = model.flexible.beams[assembly.index(f"rib-{b + 1}", "beams")]
        iq, iv = int(beam["iq"]), int(model.flexible.elements["iv"][beam["first_element"]])
        nodes.append(y[:, iq : iq + size].reshape(shape))
        rates.append(y[:, iv : iv + size].reshape(shape))
    hub = model.bodies[assembly.index("hub", "bodies")]
    iq, iv = int(hub["iq"]), int(hub["iv"])
    x = np.tile(begin.hub.position, (t.size, 1))
    v, w = np.zeros((t.size, 3)), np.zeros((t.size, 3))
    if case.hub.motion == "free":
        x, q = y[:, iq : iq + 3], y[:, iq + 3 : iq + 7]
        v, w = y[:, iv : iv + 3], y[:, iv + 3 : iv + 6]
        angle = np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))
        angle += begin.hub.angle - angle[0]
    else:
        angle = np.full(t.size, begin.hub.angle)
        if case.hub.motion != "fixed":
            angle = angle + y[:, iq]
            w[:, 2] = y[:, iv]
        zero = np.zeros(t.size)
        q = np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=1)
    return _Motion(np.stack(nodes, axis=1), np.stack(rates, axis=1), x, q, v, w, angle)


def _along(nodes: np.ndarray, length: float, xi: np.ndarray, order: int = 0) -> np.ndarray:
    """Places on all elements, or their derivatives by arc length, at xi : (k,); (nt, ribs, elements, k, 3)."""
    e = nodes[..., :2, :][..., None, :]
    return hermite(xi, length, e[:, :, :-1, 0], e[:, :, :-1, 1], e[:, :, 1:, 0], e[:, :, 1:, 1], order=order)


def _joined(values: np.ndarray) -> np.ndarray:
    """(..., elements, k + 1) with both ends of each as (..., elements k + 1), means where elements meet."""
    found = values[..., :-1].reshape(*values.shape[:-2], -1)
    found = np.concatenate([found, values[..., -1, -1:]], axis=-1)
    k = values.shape[-1] - 1
    found[..., k:-1:k] = 0.5 * (values[..., 1:, 0] + values[..., :-1, -1])
    return found


def _results(
    case: Case, begin: Start, assembly: Assembly, solution: ImplicitSolution, peaks: tuple[np.ndarray, np.ndarray]
) -> xr.Dataset:
    """The run as a Dataset."""
    import xarray as xr

    from evolvent.results import label, variable

    rib, motion = case.rib, _motion(case, begin, assembly, solution)
    length, per = rib.element_length, case.output.points
    R = rotation_matrices(motion.q)
    xi = np.arange(per) / per
    inner = _along(motion.nodes, length, xi)
    position = np.concatenate([inner.reshape(*inner.shape[:2], -1, 3), motion.nodes[:, :, -1:, 0]], axis=2)
    arc = length / per * np.arange(rib.elements * per + 1)
    ends = np.arange(per + 1) / per
    engineering = rib.formulation == "cable_stretch"
    strain = _strain(motion.nodes, length, per, engineering=engineering)
    stretch = 1.0 if engineering else np.sqrt(np.maximum(1.0 + 2.0 * strain, 0.0))
    thickness = rib.thickness_at(arc / rib.length)
    EA, EI = rib.young_modulus * rib.width * thickness, rib.young_modulus * rib.width * thickness**3 / 12.0
    tension, bent = EA * strain * stretch, _joined(_curvature(motion, R, length, ends))
    hub = assembly.index("hub", "bodies")
    turning = solution.wrenches[:, hub, 3:6]
    if case.hub.motion == "free":  # which holds the gyroscopic torque as well
        spun = np.einsum("ij,tj->ti", assembly.model.bodies["inertia"][hub], motion.w)
        turning = turning + np.einsum("tij,tj->ti", R, np.cross(motion.w, spun))
    torque = np.einsum("ti,ti->t", turning, R[:, :, 2])
    rows = [assembly.index(f"contact-{b + 1}", "cylinders") for b in range(rib.count)]
    touched = solution.cylinders[:, rows]
    tip = motion.nodes[:, :, -1, 0]
    own = np.einsum("tji,tbj->tbi", R, tip - motion.x[:, None])
    speed = np.linalg.norm(motion.rates[:, :, -1, 0], axis=-1)
    time, ribs, points = ("time",), ("time", "rib"), ("time", "rib", "point")
    data = {
        "position": variable((*points, "axis"), position, "m", "position of the rib's axis, inertial axes"),
        "tip_speed": variable(ribs, speed, "m s-1", "speed of the tip in inertial space"),
        "tip_speed_peak": variable(("rib",), peaks[0], "m s-1", "largest speed of the tip, between samples too"),
        "tip_speed_peak_time": variable(("rib",), peaks[1], "s", "when the tip had it"),
        "tip_radius": variable(
            ribs, np.hypot(own[..., 0], own[..., 1]), "m", "distance of the tip from the hub's axis"
        ),
        "wrap_angle": variable(
            ribs, _wrap(case, motion, R), "rad", "angle of the hub that the rib covers, negative the other way"
        ),
        "contact_points": variable(ribs, touched[..., 8], "1", "contact points in contact with the hub"),
        **_turns(case, assembly, solution, motion, R),
        "contact_force": variable(ribs, touched[..., 6], "N", "sum of the normal forces on the hub"),
        "contact_resultant": variable((*ribs, "axis"), touched[..., 0:3], "N", "force of the contact on the hub"),
        "contact_moment": variable(
            (*ribs, "axis"), touched[..., 3:6], "N m", "moment of the contact on the hub about its middle"
        ),
        "contact_impulse": variable(ribs, touched[..., 7], "N s", "integral of the normal forces since the start"),
        **_pressed(case, begin, motion, R),
        "hub_torque": variable(time, torque, "N m", "torque of the ribs on the hub about its axis"),
        "hub_angle": variable(time, motion.angle, "rad", "angle of the hub about its axis"),
        "curvature": variable(points, bent, "m-1", "turn per length without stress"),
        "tension": variable(points, tension, "N", "force along the rib, positive where it pulls"),
        "strain": variable(points, strain, "1", "strain of the rib's axis"),
        "bending_moment": variable(points, EI * bent, "N m", "moment about the hub's axis in the rib"),
        "energy_density": variable(
            points,
            0.5 * (EA * strain**2 + EI * bent**2),
            "J m-1",
            "strain energy per length, of stretch and of bending",
        ),
        **_account(case, assembly, solution, motion),
        "end_coordinates": variable(
            ("rib", "node", "vector", "axis"), motion.nodes[-1], "1", "nodes at the end: places (m), slopes (1)"
        ),
        "end_velocities": variable(
            ("rib", "node", "vector", "axis"), motion.rates[-1], "s-1", "their rates: places (m/s), slopes (1/s)"
        ),
        "end_hub": variable(
            ("hub_state",),
            np.concatenate([motion.x[-1], motion.q[-1], motion.v[-1], motion.w[-1], motion.angle[-1:]]),
            "1",
            "hub at the end: place, quaternion, velocity, angular velocity (body axes), angle about its axis",
        ),
        "hinge_rest": variable(("rib",), begin.directions, "rad", "direction at which the root's hinge rests"),
    }
    if case.hub.motion == "free":
        data["hub_position"] = variable(("time", "axis"), motion.x, "m", "position of the hub, inertial axes")
        data["hub_quaternion"] = variable(
            ("time", "quaternion"), motion.q, "1", "attitude of the hub, body to inertial, scalar first"
        )
    dataset = xr.Dataset(
        data,
        {
            "time": variable(time, solution.t, "s", "time"),
            "arc": variable(("point",), arc, "m", "length along the rib from its root, without stress"),
            "element": variable(("element",), np.arange(1, rib.elements + 1), "1", "element, 1 at the root"),
            "rib": variable(("rib",), np.arange(1, rib.count + 1), "1", "rib"),
            "axis": ("axis", ["x", "y", "z"]),
            "cause": ("cause", list(CAUSES)),
        },
    )
    label(dataset, system=case.system, case=cases.to_yaml(case), method=case.solver.method, solution=solution, laws={})
    told = [text for text in (begin.told, *advice.warnings(case), *_findings(case, dataset, strain)) if text]
    if told:
        dataset.attrs["warning"] = "; ".join(told)
    return dataset


def _strain(nodes: np.ndarray, length: float, per: int, *, engineering: bool) -> np.ndarray:
    """Strain of the axis at `per` points of each element and the tip : (nt, ribs, elements per + 1).

    Notes
    -----
    Means of Green's strain (r,x . r,x - 1)/2, or of the engineering one |r,x| - 1, over the elements, by the rule with
    which they take it, and straight lines between the elements' middles: what varies within an element is mostly what
    its cubic adds to a bent shape.
    """
    at, weight = np.polynomial.legendre.leggauss(3)
    slope = _along(nodes, length, 0.5 * (1.0 + at), 1)
    squared = np.einsum("...i,...i->...", slope, slope)
    mean = (np.sqrt(squared) - 1.0 if engineering else 0.5 * (squared - 1.0)) @ (0.5 * weight)
    if mean.shape[-1] == 1:
        return np.repeat(mean, per + 1, axis=-1)
    place = np.arange(mean.shape[-1] * per + 1) / per - 0.5
    left = np.clip(place.astype(int), 0, mean.shape[-1] - 2)
    share = place - left
    found: np.ndarray = mean[..., left] * (1.0 - share) + mean[..., left + 1] * share
    return found


def _pressed(case: Case, begin: Start, motion: _Motion, R: np.ndarray) -> dict[str, xr.Variable]:
    """Force of the contact per length of each element, and the least gap of its contact points."""
    from evolvent.results import variable

    contact, length = case.contact, case.rib.element_length
    xi = np.arange(1, contact.points + 1) / contact.points
    at = _along(motion.nodes, length, xi) - motion.x[:, None, None, None]
    moves = _along(motion.rates, length, xi) - motion.v[:, None, None, None]
    own = np.einsum("tji,tbnkj->tbnki", R, at)
    rates = np.einsum("tji,tbnkj->tbnki", R, moves)  # about its axis the hub's turn changes no gap; its tilt is slow
    distance = np.hypot(own[..., 0], own[..., 1])
    gap = np.where(np.abs(own[..., 2]) <= 0.5 * case.hub.height, distance - case.hub.radius, np.inf)
    rate = (own[..., 0] * rates[..., 0] + own[..., 1] * rates[..., 1]) / np.maximum(distance, 1e-300)
    deep = np.maximum(-gap, 0.0)
    force = begin.stiffness * deep**contact.exponent
    if contact.law == "paper":
        force = np.where(deep > 0.0, force - contact.damping * rate, 0.0)
    else:
        force = np.maximum(force * (1.0 - contact.dissipation * rate), 0.0)
    dims = ("time", "rib", "element")
    return {
        "contact_pressure": variable(dims, force.sum(axis=-1) / length, "N m-1", "normal force on the hub per length"),
        "contact_gap": variable(
            dims, gap.min(axis=-1), "m", "least distance of the element's contact points to the hub"
        ),
    }


def _turns(
    case: Case, assembly: Assembly, solution: ImplicitSolution, motion: _Motion, R: np.ndarray
) -> dict[str, xr.Variable]:
    """Contact of the turns with one another, where it is switched on."""
    from evolvent.results import variable

    if not case.contact.self:
        return {}
    rows = [assembly.index(f"layer-{b + 1}", "cylinders") for b in range(case.rib.count)]
    touched = solution.cylinders[:, rows]
    pressure = _turn_forces(case, assembly, solution, motion, R, rows) / case.rib.element_length
    ribs = ("time", "rib")
    return {
        "turn_points": variable(ribs, touched[..., 8], "1", "contact points in contact with the turn below"),
        "turn_force": variable(ribs, touched[..., 6], "N", "sum of the normal forces on the turns below"),
        "turn_pressure": variable(
            (*ribs, "element"), pressure, "N m-1", "normal force on the turn below per length of the turn above"
        ),
    }


def _turn_forces(
    case: Case, assembly: Assembly, solution: ImplicitSolution, motion: _Motion, R: np.ndarray, rows: list[int]
) -> np.ndarray:
    """Normal forces (nt, ribs, elements) of the elements on the turns below, N, found anew at every sample."""
    from evolvent.flow import needs
    from evolvent.kernels.layers import add_layers

    model, elements = assembly.model, case.rib.elements
    flexible, bodies = model.flexible, model.bodies
    needs.load_explicit(model)
    hub = assembly.index("hub", "bodies")
    scratch = np.zeros(int(model.info.nv))
    found = np.zeros((solution.t.size, len(rows), elements))
    for k, y in enumerate(solution.y):
        bodies["R"][hub], bodies["x"][hub] = R[k], motion.x[k]
        for b, row in enumerate(rows):
            add_layers(y, 0.0, model, row, scratch)
            checks = slice(int(flexible.cylinders["first"][row]), int(flexible.cylinders["last"][row]))
            found[k, b] = flexible.contact_points["force"][checks].reshape(elements, -1).sum(axis=-1)
    return found


def _curvature(motion: _Motion, R: np.ndarray, length: float, xi: np.ndarray) -> np.ndarray:
    """Turn about the hub's axis per length without stress at xi : (nt, ribs, elements, k), 1/m, positive as it winds.

    Notes
    -----
    The straight line through Gauss's two points, at which an element's cubic is nearest to the shape that it stands
    for.
    """
    at, _ = np.polynomial.legendre.leggauss(2)
    slope, bend = _along(motion.nodes, length, 0.5 * (1.0 + at), 1), _along(motion.nodes, length, 0.5 * (1.0 + at), 2)
    across = np.einsum("tbnki,ti->tbnk", np.cross(slope, bend), R[:, :, 2])
    turn = across / np.einsum("...i,...i->...", slope, slope)
    mean, tilt = turn.mean(axis=-1), 0.5 * (turn[..., 1] - turn[..., 0]) / at[1]
    found: np.ndarray = mean[..., None] + tilt[..., None] * (2.0 * xi - 1.0)
    return found


def _wrap(case: Case, motion: _Motion, R: np.ndarray) -> np.ndarray:
    """Angle of the hub that each rib covers, rad.

    Notes
    -----
    Of a straight tail along the tangent: the tip's angle about the axis from the root on, followed along the rib, less
    acos(R/r) of its distance r; negative where the rib lies the other way round.
    """
    xi = np.arange(8) / 8
    inner = _along(motion.nodes, case.rib.element_length, xi)
    path = np.concatenate([inner.reshape(*inner.shape[:2], -1, 3), motion.nodes[:, :, -1:, 0]], axis=2)
    own = np.einsum("tji,tbnj->tbni", R, path - motion.x[:, None, None])
    angle = np.unwrap(np.arctan2(own[..., 1], own[..., 0]), axis=-1)
    radius = np.maximum(np.hypot(own[..., -1, 0], own[..., -1, 1]), case.hub.radius)
    turned, tail = angle[..., -1] - angle[..., 0], np.arccos(case.hub.radius / radius)
    found: np.ndarray = np.sign(turned) * np.clip(np.abs(turned) - tail, 0.0, None)
    return found


# ------------------------------------------------------------------------------------------------ accounts


def _account(case: Case, assembly: Assembly, solution: ImplicitSolution, motion: _Motion) -> dict[str, xr.Variable]:
    """Energies, what takes them, momenta."""
    from evolvent.results import variable
    from evolvent.solvers import alpha_state as at

    ledger = solution.ledger
    kinetic, contact = ledger[:, at.KINETIC], ledger[:, at.CONTACT]
    elastic = ledger[:, at.ELASTIC] - contact
    bending = ledger[:, at.BENDING]
    if case.rib.formulation == "cable_stretch":
        bending = _stretch_bending(case, motion)
    elif case.rib.vectors == 4:
        bending = _bending(assembly, motion)
    work = ledger[:, at.LOADS] + ledger[:, at.DRIVES]
    gained = solution.gained
    taken = np.stack(
        [
            ledger[:, at.BY_MASS],
            ledger[:, at.BY_STIFFNESS],
            ledger[:, at.BY_CONTACT],
            ledger[:, at.BY_FRICTION],
            ledger[:, at.BY_JOINTS] + ledger[:, at.BY_SPRINGS],
            -gained,
        ],
        axis=1,
    )
    stored = kinetic + ledger[:, at.ELASTIC] + ledger[:, at.COUPLED]
    largest = max(float(stored.max()), float(np.abs(work).max()), 1e-300)
    linear, angular = _momenta(case, assembly, motion)
    time, axis = ("time",), ("time", "axis")
    return {
        "energy_kinetic": variable(time, kinetic, "J", "kinetic energy"),
        "energy_elastic": variable(time, elastic, "J", "strain energy of the ribs"),
        "energy_membrane": variable(time, elastic - bending, "J", "strain energy of all but bending"),
        "energy_bending": variable(time, bending, "J", "strain energy of bending"),
        "energy_contact": variable(time, contact, "J", "energy of the contacts' springs"),
        "energy_joints": variable(
            time, ledger[:, at.COUPLED], "J", "energy of springs in the hinges, and of penalties"
        ),
        "energy_dissipated": variable(("time", "cause"), taken, "J", "energy taken so far, by what takes it"),
        "work_external": variable(time, work, "J", "work of the drive so far"),
        "energy_balance": variable(
            time,
            gained / largest,
            "1",
            "what the account has gained over the largest energy; below zero, damping by the method itself",
            scale_J=largest,
        ),
        "linear_momentum": variable(axis, linear, "kg m s-1", "linear momentum of ribs and a free hub"),
        "angular_momentum": variable(axis, angular, "kg m2 s-1", "angular momentum about the inertial origin"),
    }


def _bending(assembly: Assembly, motion: _Motion) -> np.ndarray:
    """Bending energy of beams of 24 coordinates, J : (nt,)."""
    from evolvent import elements
    from evolvent.elements.forms import products

    f = assembly.model.flexible
    i, j = np.triu_indices(7)
    total = np.zeros(motion.nodes.shape[0])
    for b in range(motion.nodes.shape[1]):
        beam = f.beams[assembly.index(f"rib-{b + 1}", "beams")]
        for c in range(int(beam["elements"])):
            cell = f.elements[int(beam["first_element"]) + c]
            e = motion.nodes[:, b, c : c + 2].reshape(-1, 8, 3)
            v = e[:, 1:].copy()
            v[:, 3] -= e[:, 0]
            g = np.einsum("tpi,tpi->tp", v[:, i], v[:, j]) - products(elements.straight_beam(float(cell["length"])))
            total += 0.5 * np.einsum("tp,pq,tq->t", g, f.bend24[int(cell["form"])], g)
    return total


def _stretch_bending(case: Case, motion: _Motion) -> np.ndarray:
    """Bending energy of cables with engineering strain, J : (nt,); 1/2 int EI k^2 dx at the elements' three points."""
    rib = case.rib
    at, weight = np.polynomial.legendre.leggauss(3)
    xi = 0.5 * (1.0 + at)
    slope, bend = _along(motion.nodes, rib.element_length, xi, 1), _along(motion.nodes, rib.element_length, xi, 2)
    squared = np.einsum("...i,...i->...", slope, slope)
    across = np.cross(slope, bend)
    curvature2 = np.einsum("...i,...i->...", across, across) / squared**2
    Iz = np.array([[rib.section(k).at(x).properties(rib.poisson).Iz for x in xi] for k in range(rib.elements)])
    EI = rib.young_modulus * Iz
    found: np.ndarray = 0.25 * rib.element_length * np.einsum("tbnk,nk,k->t", curvature2, EI, weight)
    return found


def _momenta(case: Case, assembly: Assembly, motion: _Motion) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum about the inertial origin, (nt, 3) each."""
    f = assembly.model.flexible
    pool = f.M12 if case.rib.vectors == 2 else f.M24
    P, H = np.zeros((motion.x.shape[0], 3)), np.zeros((motion.x.shape[0], 3))
    k = motion.nodes.shape[3]
    for b in range(motion.nodes.shape[1]):
        beam = f.beams[assembly.index(f"rib-{b + 1}", "beams")]
        mass = pool[f.elements["mass"][int(beam["first_element"]) : int(beam["first_element"]) + int(beam["elements"])]]
        e = np.concatenate([motion.nodes[:, b, :-1], motion.nodes[:, b, 1:]], axis=2)
        u = np.concatenate([motion.rates[:, b, :-1], motion.rates[:, b, 1:]], axis=2)
        p = np.einsum("cij,tcjx->tcix", mass, u)
        P += p[:, :, 0].sum(axis=1) + p[:, :, k].sum(axis=1)
        H += np.cross(e, p).sum(axis=(1, 2))
    hub = assembly.model.bodies[assembly.index("hub", "bodies")]
    if case.hub.motion == "free":
        P += hub["mass"] * motion.v
        H += hub["mass"] * np.cross(motion.x, motion.v)
        H += np.einsum("tij,jk,tk->ti", rotation_matrices(motion.q), hub["inertia"], motion.w)
    elif case.hub.motion != "fixed":
        H[:, 2] += hub["spin_inertia"] * motion.w[:, 2]
    return P, H


def _findings(case: Case, run: xr.Dataset, strain: np.ndarray) -> list[str]:
    """What a user should know after a run, a sentence each."""
    from evolvent.results import statistics_of

    found = []
    most = float(np.abs(strain).max())
    if most > advice.STRAIN_WARNED:
        k = int(np.argmax(np.abs(strain).max(axis=(1, 2))))
        found.append(
            f"the rib was strained by up to {100.0 * most:.3g} %, at t = {run.time.values[k]:.6g} s, beyond what "
            f"linear elasticity and most sections bear"
        )
    gap = run.contact_gap.values.min(axis=(1, 2))
    if float(gap.min()) < -advice.SUNK_TOLD * case.hub.radius:
        k = int(np.argmin(gap))
        found.append(
            f"the rib sank {-gap[k]:.3g} m into the hub at t = {run.time.values[k]:.6g} s; take a greater "
            f"contact.stiffness, or auto"
        )
    pivot = statistics_of(run).get("smallest_pivot", 1.0)
    if pivot < PIVOT_TOLD:
        found.append(
            f"the equations were nearly singular in some step (smallest pivot {pivot:.2g}, round-off from 1e-16); what "
            f"hangs on it may be wrong"
        )
    balance = run.energy_balance.values
    implicit = case.solver.method == METHOD
    smaller = "solver.tolerance or solver.step" if implicit else "solver.step"
    if float(balance.max()) > GAIN_TOLD:
        found.append(
            f"the run has gained up to {100.0 * balance.max():.2g} % of its energy from nothing; take a smaller "
            f"{smaller}"
        )
    if -float(balance.min()) > NUMERICAL_TOLD:
        found.append(
            f"the method itself has taken {-100.0 * balance.min():.2g} % of the energy; take a smaller {smaller}"
            + (", or a higher solver.spectral_radius" if implicit else "")
        )
    return found
