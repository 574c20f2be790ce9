"""solve_implicit(): generalized-alpha over an assembled model, watched, with its account and how it ended."""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from evolvent import codecache, families, jit
from evolvent import model as mdl
from evolvent.builder import Assembly
from evolvent.errors import InputError
from evolvent.families import owner
from evolvent.flow import needs
from evolvent.flow.powers import N_POWERS
from evolvent.kernels import contact_laws, joint, rigid
from evolvent.kernels.flexible import CABLE, NODE_VECTORS
from evolvent.kernels.layers import UNKNOWN
from evolvent.kernels.sparse import SparseBlocks
from evolvent.parts.checks import number, positive
from evolvent.solvers import alpha_energy, alpha_loop, alpha_state, graph, ordering
from evolvent.solvers.drive import STEP_ALLOWED, sample_times
from evolvent.solvers.laws import law_failure, refusing_laws, try_laws, what_may_jump
from evolvent.solvers.releases import Releases, book_accounts, reason_of_outrun, release_times

#: Wall time between two looks at how a run gets on, s, and steps beyond which what is left of it is given up.
LOOK, MOST_STEPS = 10.0, 1e8
#: Share of the work put in that a run may gain before it has failed.
LARGEST_GAIN = 0.01
#: Redundant rows of joints that can be named.
MOST_REDUNDANT = 64
#: What a joint may be off at the start, beside the size of the system and its speed.
_FITS = 1e-6
_SLICE = 0.15  # s of wall time between two looks at a running loop


@dataclasses.dataclass
class ImplicitSolution:
    """What `solve_implicit` returns; it prints nothing.

    Attributes
    ----------
    t : (nt,) float, s
    y : (nt, ny) float, states [q | v | accounts], as the assembly's `y`
    acceleration : (nt, nv) float
    la : (nt, nj) float, multipliers of the joints, in the order of `names`
    ledger : (nt, N_LEDGER) float, J, energies and what causes took (places in `evolvent.solvers.alpha`)
    cylinders : (nt, nc, 9) float, of each: force (N) and torque (N m) on its body at the body's origin, inertial axes;
        sum of normal forces (N), its impulse (N s), points that touch
    wrenches : (nt, nb, 6) float, N and N m, all that acts on each body at its origin, inertial axes; torques of free
        bodies less the gyroscopic w x J w
    status, message, statistics, wall_time, compile_time, s, event_times, event_kinds : as of
        `evolvent.solvers.Solution`
    """

    t: np.ndarray
    y: np.ndarray
    acceleration: np.ndarray
    la: np.ndarray
    ledger: np.ndarray
    cylinders: np.ndarray
    wrenches: np.ndarray
    status: str
    message: str
    statistics: dict[str, float]
    wall_time: float
    compile_time: float
    s: np.ndarray
    event_times: np.ndarray
    event_kinds: np.ndarray

    @property
    def success(self) -> bool:
        """Whether the run reached its end."""
        return self.status == "success"

    @property
    def gained(self) -> np.ndarray:
        """What the account has gained since the start, J : (nt,); below zero it is numerical damping."""
        return gained(self.ledger)


def gained(ledger: np.ndarray) -> np.ndarray:
    """Energy at each sample less that at the start, less work, plus losses, J."""
    a = alpha_state
    energy = ledger[..., a.KINETIC] + ledger[..., a.ELASTIC] + ledger[..., a.COUPLED]
    lost = ledger[..., a.BY_MASS : a.BY_SPRINGS + 1].sum(axis=-1)
    work = ledger[..., a.LOADS] + ledger[..., a.DRIVES] + ledger[..., a.SPOOLS]
    return energy - ledger[..., a.START] - work + lost


def matrix_of(model: mdl.Model, *, spare: int | None = None) -> SparseBlocks:
    """Room for the tangent of a model, and for `spare` deferred pivots; by default what redundant joints may need."""
    layers = model.flexible.cylinders[model.flexible.cylinders["under"] >= 0]
    inner = int(np.sum((layers["last"] - layers["first"]) * np.where(layers["friction"] > 0.0, 3, 1)))
    if spare is None:
        spare = min(model.flexible.joints.size, MOST_REDUNDANT)
    return ordering.matrix_of(graph.pattern_of(model), spare=spare, inner=inner)


def sizes(assembly: Assembly) -> tuple[np.ndarray, float]:
    """What counts as 1 of each velocity's coordinate (m, or 1 for slopes and turns), and a typical mass (kg)."""
    model = assembly.model
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    flexible = model.flexible
    weight = np.ones(n_v)
    places = [np.zeros(3)] if not flexible.beams.size else []
    masses = []
    linear = []
    for beam in flexible.beams:
        size = 3 * NODE_VECTORS[beam["kind"]]
        first = beam["iv"] - n_q
        for i in range(beam["nodes"]):
            linear.append(first + i * size)
            places.append(assembly.y[beam["iq"] + i * size :][:3])
        element = flexible.elements[beam["first_element"]]
        pool = flexible.M12 if beam["kind"] == CABLE else flexible.M24
        masses.append(2.0 * pool[element["mass"]][0, 0])
    for row in model.threads:
        linear += [int(row["iv"]) - n_q + 3 * i for i in range(row["n"])]
        places += [model.bodies["x"][row["body"]], np.array([row["n"] * row["segment"], 0.0, 0.0])]
    masses += model.nodes["mass"].tolist()
    for point in model.points:
        linear.append(point["iv"] - n_q)
        places.append(assembly.y[point["iq"] :][:3])
        masses.append(point["mass"])
    for body in model.bodies:
        places.append(body["x"])
        if body["motion"] == rigid.FREE:
            linear.append(body["iv"] - n_q)
            masses.append(body["mass"])
        elif body["motion"] == rigid.SPIN:
            masses.append(body["spin_inertia"])
    spread = np.ptp(np.array(places), axis=0)
    length = float(np.linalg.norm(spread)) or 1.0
    for at in linear:
        weight[at : at + 3] = length
    return weight, float(np.exp(np.mean(np.log(masses)))) if masses else 1.0


class Prepared(NamedTuple):
    """What the compiled loop takes: equations, room for their tangent, options and the state of the loop."""

    model: mdl.Model
    matrix: SparseBlocks
    options: np.ndarray
    work: alpha_state.Workspace
    releases: Releases | None
    compile_time: float


def prepared(
    assembly: Assembly,
    times: np.ndarray,
    *,
    step: float | None,
    tolerance: float,
    spectral_radius: float,
    newton: float | None = None,
    largest_gain: float = LARGEST_GAIN,
    longest_step: float | None = None,
) -> Prepared:
    """Check the arguments of `solve_implicit`, compile, and stand at the start."""
    span = float(times[-1] - times[0])
    if not 0.0 <= number("spectral_radius", spectral_radius, allowed="from 0 to 1") <= 1.0:
        raise InputError(f"spectral_radius is {spectral_radius!r}; it must be from 0 to 1")
    if step is not None:
        step = positive("step", step, allowed=STEP_ALLOWED)
    tolerance = positive("tolerance", tolerance)
    families.check(assembly, families.IMPLICIT)
    try_laws(assembly, times[0], times[-1])
    with refusing_laws(assembly):
        check_start(assembly, float(times[0]))
    model = assembly.model
    weight, mass = sizes(assembly)
    matrix = matrix_of(model)
    if newton is None:
        newton = 1e-9 if step is not None else min(1e-3 * tolerance, 1e-7)
        if step is not None and np.any(model.bodies["motion"] == rigid.FREE):  # spins, whose error adds up step by step
            newton = 1e-12
        if model.threads.size:  # whose springs are so stiff that little lengths are large forces
            newton = 1e-13
    rho = spectral_radius
    first = step if step is not None else min(1e-5 * span, 1e-4)
    longest = span if longest_step is None else float(longest_step)
    options = np.zeros(alpha_state.N_OPTIONS)
    options.alpha_m = (2.0 * rho - 1.0) / (rho + 1.0)
    options.alpha_f = rho / (rho + 1.0)
    options.beta = 1.0 / (1.0 + rho) ** 2
    options.gamma = 2.0 / (1.0 + rho) - 0.5
    options.newton = newton
    options.tolerance = 0.0 if step is not None else tolerance
    options.smallest = 1e-13 * span
    options.longest = longest
    options.gain = largest_gain
    options.mass = mass
    options.floor = _floor(assembly, mass, weight)
    options.span = first if step is not None else 10.0 * first
    a = alpha_state
    options.share = (1.0 - options.alpha_m) / (2.0 * options.beta * (1.0 - options.alpha_f))
    cylinders = model.flexible.cylinders
    cylinders["share"] = np.where(cylinders["law"] == contact_laws.CONSERVATIVE, options.share, 1.0)
    began = clock.perf_counter()
    model.flexible.switches[:] = assembly.s
    releases = Releases(model) if model.threads.size else None
    jit.load((*needs.implicit_steps(model), *alpha_loop.functions(model)))
    work = _march(assembly, times, first, weight)
    return Prepared(model, matrix, work, releases, clock.perf_counter() - began)


def solve_implicit(
    assembly: Assembly,
    *,
    samples: Any,
    step: float | None = None,
    tolerance: float = 1e-4,
    spectral_radius: float = 0.3,
    newton: float | None = None,
    largest_gain: float = LARGEST_GAIN,
    longest_step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> ImplicitSolution:
    """Integrate an assembled model with generalized-alpha, joints as constraints of index 3.

    Parameters
    ----------
    assembly : Assembly; its initial state is left as it is
    samples : (nt,) float, s, increasing; the first is the start, the last the end
    step : float, s, fixed; None has it follow from `tolerance`
    tolerance : float, error of a step that is accepted, beside the size of the system (or 1 for slopes and turns)
    spectral_radius : float, 0 to 1, at infinite frequency: 1 damps nothing, 0 all that the step does not resolve
    newton : float, correction at which an iteration has converged, beside the same sizes
    largest_gain : float, share of the largest energy and work that the account may gain before the run fails
    longest_step : float, s, of an adaptive run
    progress : called with the time reached, a few times a second

    Returns
    -------
    ImplicitSolution
        A run that fails keeps the samples that it reached.

    Raises
    ------
    InputError
        For arguments out of range, parts that have no implicit form yet, or constraints that contradict one another.
    """
    times = sample_times(samples)
    run = prepared(
        assembly,
        times,
        step=step,
        tolerance=tolerance,
        spectral_radius=spectral_radius,
        newton=newton,
        largest_gain=largest_gain,
        longest_step=longest_step,
    )
    model, matrix, work, releases = run[:5]

    began = clock.perf_counter()
    status, message = "success", "the run reached its end"
    budget = 20
    kept_s = np.zeros((times.size, assembly.s.size), dtype=np.int64)
    outrun = stalled = False
    last, rest = (clock.perf_counter(), times[0], 0), 0.0
    try:
        if releases is not None:
            outrun = releases.fire(times[0], work.y) < 0
        code = alpha_loop.begin(model, matrix, work)
        if code == alpha_state.REDUNDANT:
            raise InputError(redundant(assembly, matrix))
        if code == alpha_state.DONE:
            while True:
                slice_began = clock.perf_counter()
                first_sample = int(work.loop.sample)
                if first_sample == 1:
                    kept_s[0] = model.flexible.switches
                code = alpha_loop.advance(model, matrix, work, budget)
                kept_s[first_sample : int(work.loop.sample)] = model.flexible.switches
                spent = clock.perf_counter() - slice_began
                if code == alpha_state.AT_STOP and releases is not None:
                    outrun = releases.resume(work) < 0
                elif code != alpha_state.BUDGET:
                    break
                if outrun:
                    break
                budget = max(10, min(int(budget * min(_SLICE / max(spent, 1e-6), 4.0)), 1_000_000))
                now = (clock.perf_counter(), float(work.loop.time), int(work.loop.steps))
                if now[0] - last[0] > LOOK:
                    rest = (times[-1] - now[1]) / max(now[1] - last[1], 1e-300) * (now[2] - last[2])
                    if step is None and rest > MOST_STEPS:
                        stalled = True
                        break
                    last = now
                if progress is not None:
                    progress(float(work.loop.time))
        if releases is not None and code == alpha_state.DONE:  # what is due at the very end still happens
            outrun = releases.fire(times[-1], work.y) < 0
            work.out_y[-1], kept_s[-1] = work.y, model.flexible.switches
        if stalled:
            status, message = "failed", _stalled(work, now[2] - last[2], now[1] - last[1], rest)
        elif outrun:
            status, message = "failed", reason_of_outrun(float(work.loop.time))
        elif code != alpha_state.DONE:
            status, message = "failed", reason(code, work, step, options, assembly)
    except KeyboardInterrupt:
        reached = float(work.loop.time)
        status, message = "interrupted", f"interrupted at t = {reached:.6g} s; what was computed is kept"
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
        failure = law_failure(assembly, error, moments(run))
        status, message = "failed", f"{failure}; what was computed is kept"
    wall_time = clock.perf_counter() - began
    kept = int(work.loop.sample)
    if releases is not None:
        book_accounts(model, work.out_y, work.out_ledger)
    steps = int(work.loop.steps)
    statistics = {
        "steps": steps,
        "rejected_steps": int(work.loop.rejected),
        "iterations": int(work.loop.iterations),
        "factorizations": int(work.loop.factorizations),
        "step": float(step) if step is not None else float("nan"),
        "mean_step": float(work.loop.time - times[0]) / max(steps, 1),
        "smallest_pivot": float(work.loop.quality),
        "energy_gained": float(work.loop.net_gain),
    }
    codecache.mark_warm("generalized-alpha")
    return ImplicitSolution(
        t=times[:kept].copy(),
        y=work.out_y[:kept],
        acceleration=work.out_a[:kept],
        la=work.out_la[:kept],
        ledger=work.out_ledger[:kept],
        cylinders=work.out_cylinders[:kept],
        wrenches=work.out_bodies[:kept],
        status=status,
        message=message,
        statistics=statistics,
        wall_time=wall_time,
        compile_time=run.compile_time,
        s=kept_s[:kept],
        event_times=np.array(releases.times if releases is not None else [], dtype=float),
        event_kinds=np.array(releases.kinds if releases is not None else [], dtype=np.int64),
    )


def moments(run: Prepared) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Times and states at which the last step may have called a user's law."""
    work, s = run.work, run.model.flexible.switches
    t, h = float(work.loop.time), float(work.loop.step)
    later = np.concatenate([work.samples, work.stops])
    ends = [t + h, *np.sort(later[later > t])[:1].tolist()]
    return [(end, work.y, s) for end in ends] + [(t, work.y0, s), (t, work.y, s)]


def _floor(assembly: Assembly, mass: float, weight: np.ndarray) -> float:
    """Energy beside which a gain is round-off: of weights lifted by the system's size, and of forms of elements, J."""
    flexible, info = assembly.model.flexible, assembly.model.info
    lifted = mass * weight.size * float(np.linalg.norm(info["gravity"])) * float(weight.max(initial=0.0))
    strained = sum(
        abs(
            float((flexible.U12 if flexible.beams["kind"][element["beam"]] == CABLE else flexible.U24)[element["form"]])
        )
        for element in flexible.elements
    )
    return 1e-9 * (lifted + strained)


def check_start(assembly: Assembly, t: float) -> None:
    """Refuse joints that the start does not meet, by name: places or velocities that contradict them."""
    model, y = assembly.model, assembly.y.copy()
    joints = model.flexible.joints
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    length = max(1.0, float(np.abs(y[:n_q]).max(initial=0.0)))
    speed = max(1.0, float(np.abs(y[n_q : n_q + n_v]).max(initial=0.0)))
    rigid.kinematics(t, y, model)
    for k in range(joints.size):
        if joints["stiffness"][k] > 0.0 or not joint.holds(t, joints, k):
            continue
        joint.joint_geometry(t, y, k, model)
        gap, rate = float(joints["gap"][k]), float(joints["rate"][k])
        unit = "" if joints["kind"][k] in (joint.DIRECTION, joint.ANGLE) else " m"
        if not abs(gap) <= _FITS * length:
            raise InputError(
                f"{owner(assembly, 'joints', k)!r} does not fit the start at t = {t:g} s: it is {gap:.6g}{unit} off; "
                f"move what it joins, or its feed"
            )
        if not abs(rate) <= _FITS * speed:
            raise InputError(
                f"{owner(assembly, 'joints', k)!r} does not fit the velocities at the start: what it holds together "
                f"parts at {rate:.6g}{unit}/s; give velocities that keep it"
            )


def _march(assembly: Assembly, times: np.ndarray, step: float, weight: np.ndarray) -> alpha_state.Workspace:
    model = assembly.model
    n_v, n_j = int(model.info.nv), model.flexible.joints.size
    n_t, n_c, n_b = times.size, model.flexible.cylinders.size, model.bodies.size
    n_u = n_v + n_j
    beam_loads = model.flexible.beam_loads
    ends = [beam_loads["start"] + beam_loads["ramp"], model.breaks, release_times(assembly, times[0], times[-1])]
    stops = np.unique(np.concatenate(ends))
    stops = stops[(stops > times[0]) & (stops < times[-1])]
    model.flexible.contact_points["gap"], model.flexible.contact_points["carrier"] = np.inf, UNKNOWN
    model.flexible.contact_points["stick"] = 0.0
    model.flexible.contact_points["drag"] = 0.0
    model.flexible.hinges["latched"] = 0.0
    clocks = np.zeros(alpha_state.N_CLOCK)
    for place, value in ((alpha_state.TIME, times[0]), (alpha_state.STEP, step), (alpha_state.LAST, step)):
        clocks[place] = value
    clocks[alpha_state.QUALITY], clocks[alpha_state.EVENT] = 1.0, np.inf
    tally = np.zeros(alpha_state.N_TALLY, dtype=np.int64)
    loop.stale = 1
    return alpha_state.Workspace(
        y=assembly.y.copy(),
        y0=assembly.y.copy(),
        spare=assembly.y.copy(),
        v1=np.zeros((5, n_v)),
        v0=np.zeros((5, n_v)),
        la=np.zeros(n_j),
        la0=np.zeros(n_j),
        dq=np.zeros(n_v),
        r=np.zeros(n_u),
        x=np.zeros(n_u),
        weight=weight,
        powers=np.zeros((2, N_POWERS)),
        gaps=np.zeros(n_j),
        clock=clocks,
        tally=tally,
        ledger=np.zeros(alpha_state.N_LEDGER),
        impulse=np.zeros(n_c),
        kept=np.full(12, np.nan),
        samples=times.copy(),
        stops=stops,
        out_y=np.zeros((n_t, assembly.y.size)),
        out_a=np.zeros((n_t, n_v)),
        out_la=np.zeros((n_t, n_j)),
        out_ledger=np.zeros((n_t, alpha_state.N_LEDGER)),
        out_cylinders=np.zeros((n_t, n_c, alpha_state.N_CYLINDER)),
        out_bodies=np.zeros((n_t, n_b, 6)),
    )


def redundant(assembly: Assembly, matrix: SparseBlocks) -> str:
    """Which joints repeat what others say."""
    rows = ordering.redundant_unknowns(matrix) - int(assembly.model.info.nv)
    names = sorted({owner(assembly, "joints", int(k)) for k in rows if k >= 0})
    return (
        f"{' and '.join(repr(n) for n in names) or 'a joint'} is redundant: the other joints already say what "
        f"{len(rows)} of its constraints say"
    )


def reason(code: int, work: alpha_state.Workspace, step: float | None, options: np.ndarray, assembly: Assembly) -> str:
    """What happened, where, when, and what to try."""
    t = float(work.loop.time)
    h = step if step is not None else float(work.loop.step)
    smaller = "take a smaller `step`, or None" if step is not None else "take a smaller `tolerance`"
    if code == alpha_state.NO_CONVERGENCE:
        met = work.loop.contact_set != 0 or work.loop.touched != 0
        touching = " with contact" if met else ""
        jumps = _jumping(assembly)
        why = law = ""
        if jumps:
            why = (
                f": under the law paper the force jumps by c delta' where {jumps} is touched, and no end of the step "
                f"need fit: outside there is no force and it would lie inside, inside the whole force throws it out"
            )
            law = "a law without jump (`law` hunt-crossley or conservative), or less `damping`"
        elif met:
            law = "a softer contact"
        if step is None:  # only the smallest of steps is given up
            smaller = "look at the last samples" if not law else "take"
        joined = "" if not law else " " if step is None else ", " if jumps else ", or "
        return (
            f"Newton's method found no solution of the step of {h:.3g} s that begins at t = {t:.6g} s{touching}{why}"
            f"{what_may_jump(assembly)}; "
            f"{smaller}{joined}{law}"
        )
    if code == alpha_state.NOT_FINITE:
        return f"the state stopped being finite in the step of {h:.3g} s from t = {t:.6g} s; {smaller}"
    if code in (alpha_state.SINGULAR, alpha_state.REDUNDANT):
        return (
            f"the equations of the step of {h:.3g} s from t = {t:.6g} s are singular: something has no mass, "
            f"constraints have become redundant, or the step leads too far; {smaller}, and look at the last samples"
        )
    scale = float(alpha_energy.gain_scale(work.ledger, options))
    share = float(work.loop.largest_gain) / max(scale, 1e-300)
    return (
        f"by t = {t:.6g} s the run has gained {share:.2g} of its energy and work from nothing, more than "
        f"{options.gain:.2g}: the step of {h:.3g} s does not resolve the motion or a contact"
        f"{what_may_jump(assembly)}; {smaller}, or a lower `spectral_radius`"
    )


def _stalled(work: alpha_state.Workspace, steps: int, time: float, rest: float) -> str:
    """Why a run of ever smaller steps was given up."""
    t = float(work.loop.time)
    return (
        f"by t = {t:.6g} s the steps have become so small, {time / max(steps, 1):.2g} s in the mean, that the rest "
        f"would take {rest:.1e} of them: what moves so fast or is so stiff there must be damped less by velocity "
        f"(`stiffness_damping`), touch more softly, or take a greater `tolerance` or a fixed `step`"
    )


def _jumping(assembly: Assembly) -> str:
    """Names of the cylinders whose force jumps at the touch."""
    cylinders = assembly.model.flexible.cylinders
    some = (cylinders["law"] == contact_laws.PAPER) & (cylinders["damping"] > 0.0)
    names = [name for name, (family, k) in assembly.names.items() if family == "cylinders" and some[k]]
    return " or ".join(repr(name) for name in names[:3]) + (" or others" if len(names) > 3 else "")


def place_of_rows(assembly: Assembly, name: str) -> slice:
    """Rows of the multipliers `la` that belong to the joint called `name`."""
    start = assembly.index(name, "joints")
    others = [index for family, index in assembly.names.values() if family == "joints" and index > start]
    return slice(start, min(others, default=assembly.model.flexible.joints.size))
