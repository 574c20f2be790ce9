"""What an implicit or static run is set up with: room for the tangent, sizes of the unknowns, options, workspace."""

from __future__ import annotations

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.base.errors import InputError
from evolvent.compiled.pointer import zeros_record
from evolvent.flow.powers import N_POWERS
from evolvent.kernels import contact, joint, rigid
from evolvent.kernels.beam_loads import FIELD
from evolvent.kernels.drive import FREE
from evolvent.kernels.flexible import CABLE, NODE_VECTORS
from evolvent.kernels.sparse import SparseBlocks
from evolvent.solvers import alpha_state, graph, ordering, reactions
from evolvent.solvers.balance import BALANCE, LEAST_ENERGY, RESOLVED
from evolvent.solvers.releases import release_times
from evolvent.solvers.sampled import N_CYLINDER, N_TOUCH, empty, rubbing_points

#: Redundant rows of joints that can be named.
MOST_REDUNDANT = 64
#: Share of energies of the system's size that is round-off, and of weights on threads.
ROUND_OFF, LIFTED_SHARE = 1e-9, 1e-2
#: Strain of a rod that is round-off: it is the difference of positions beside the length of an element.
ROUND_OFF_STRAIN = 1e-10
#: Part of the elements' `form_energy` that is round-off of their strain energy.
STRAIN_ROUND_OFF = 1e-14
#: What a joint may be off at the start, beside the size of the system and its speed.
_FITS = 1e-6


def matrix_of(model: mdl.Model, *, spare: int | None = None, layers: bool = False) -> SparseBlocks:
    """Room for the tangent of a model, and for `spare` deferred pivots; by default what redundant joints may need.

    Turns that lie on one another are inner unknowns; those that do so at present are coupled directly if `layers`. So
    is what a torque spread over a beam couples.
    """
    found = model.flexible.cylinders[model.flexible.cylinders["under"] >= 0]
    inner = int(np.sum((found["last"] - found["first"]) * np.where(found["friction"] > 0.0, 3, 1)))
    inner += int(np.sum(model.flexible.beam_loads["kind"] == FIELD))
    if spare is None:
        spare = min(model.flexible.joints.size, MOST_REDUNDANT)
    return ordering.matrix_of(graph.pattern_of(model, layers=layers), spare=spare, inner=inner)


def sizes(assembly: Assembly) -> tuple[np.ndarray, float]:
    """What counts as 1 of each velocity's coordinate (m, or 1 for slopes and turns), and a typical mass (kg).

    Of a wheel that is the angle which turns its body by 1 rad.
    """
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
    masses += [mass for mass in model.nodes["mass"].tolist() if mass > 0.0]  # a point mass has that of an end on it
    for point in model.points[model.points["mass"] > 0.0]:
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
    for wheel in model.wheels:
        body, n = model.bodies[wheel["body"]], wheel["axis"]
        about = n @ body["inertia"] @ n if body["motion"] == rigid.FREE else body["spin_inertia"]
        weight[wheel["iv"] - n_q] = max(1.0, float(about / wheel["inertia"]))
    for row in model.threads[model.threads["drive"] == FREE]:
        weight[int(row["spool_v"]) - n_q] = length / row["radius"]
    return weight, float(np.exp(np.mean(np.log(masses)))) if masses else 1.0


def shares(model: mdl.Model, weight: np.ndarray) -> np.ndarray:
    """Share of each rate in the mean square of the rates: (nv,) float, 1/m2 or 1, 0 of what has no inertia.

    The rates beside `weight` are averaged by their inertias, the diagonal of the mass matrix, as in the kinetic energy.
    """
    f, n_q = model.flexible, int(model.info.nq)
    inertia = np.zeros(weight.size)
    for kind, pool in ((True, f.M12), (False, f.M24)):
        own = f.elements[(f.beams["kind"][f.elements["beam"]] == CABLE) == kind]
        masses = np.diagonal(pool, axis1=1, axis2=2)[own["mass"]]
        np.add.at(inertia, (own["iv"] - n_q)[:, None] + np.arange(masses.shape[1]), masses)
    for point in model.points[model.points["iv"] >= 0]:
        inertia[point["iv"] - n_q :][:3] += point["mass"]
    for row in model.threads:
        masses = model.nodes["mass"][row["node"] :][: row["n"]]
        inertia[row["iv"] - n_q :][: 3 * row["n"]] += np.repeat(masses, 3)
    for body in model.bodies:
        own = inertia[body["iv"] - n_q :]
        if body["motion"] == rigid.FREE:
            own[:3] += body["mass"]
            own[3:6] += np.diag(body["inertia"])
        elif body["motion"] == rigid.SPIN:
            own[0] += body["spin_inertia"]
    inertia[model.wheels["iv"] - n_q] += model.wheels["inertia"]
    free = model.threads[model.threads["drive"] == FREE]
    inertia[free["spool_v"] - n_q] += free["spool_inertia"]
    total = float(inertia @ weight**2)
    return inertia / total if total > 0.0 else inertia


def length_of(model: mdl.Model, weight: np.ndarray) -> float:
    """Largest size of the unknowns (m, or 1 for slopes and turns) but for wheels and free spools."""
    kept = np.ones(weight.size, dtype=bool)
    kept[model.wheels["iv"] - int(model.info.nq)] = False
    kept[model.threads["spool_v"][model.threads["drive"] == FREE] - int(model.info.nq)] = False
    return float(weight[kept].max(initial=0.0))


def form_energy(model: mdl.Model) -> float:
    """Sum of the constants U0 of the elements' forms, J: their strain energies are differences of terms as large."""
    f = model.flexible
    cables = f.beams["kind"][f.elements["beam"]] == CABLE
    U = [pool[f.elements["form"][own]] for pool, own in ((f.U12, cables), (f.U24, ~cables))]
    return float(sum(np.abs(values).sum() for values in U))


def strain_round_off(model: mdl.Model) -> float:
    """Energy of which the part `balance.RESOLVED` is the round-off of the elements' strain energies, J."""
    return STRAIN_ROUND_OFF / RESOLVED * form_energy(model)


def energy_floor(assembly: Assembly, mass: float, weight: np.ndarray) -> float:
    """Energy beside which a gain is round-off, J.

    That of weights lifted by the system's size, of forms of elements, and of rods stretched by `ROUND_OFF_STRAIN`. A
    weight at rest on a stiff thread has no energy but that of the thread, whose elongation is below the tolerance of a
    step: there a gain counts beside weights lifted by `LIFTED_SHARE` of the thread.
    """
    model = assembly.model
    flexible, gravity = model.flexible, float(np.linalg.norm(model.info["gravity"]))
    lifted = mass * weight.size * gravity * length_of(model, weight)
    if model.threads.size:
        free = model.bodies["mass"][model.bodies["motion"] == rigid.FREE]
        total = model.nodes["mass"].sum() + model.points["mass"].sum() + free.sum()
        length = float(np.max(model.threads["n"] * model.threads["segment"]))
        lifted += LIFTED_SHARE / ROUND_OFF * float(total) * gravity * length
    strained = form_energy(model)
    rods = flexible.rod_elements
    stretched = 0.5 * ROUND_OFF_STRAIN**2 * float(np.sum(rods["length"] * rods["stiffness"][:, 0, 0]))
    return ROUND_OFF * (lifted + strained) + stretched + LEAST_ENERGY


def check_start(assembly: Assembly, t: float) -> None:
    """Refuse joints that the start does not meet, by name: positions or velocities that contradict them."""
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
        unit = "" if joints["kind"][k] in (joint.DIRECTION, joint.ANGLE, joint.GEAR) else " m"
        if not abs(gap) <= _FITS * length:
            raise InputError(
                f"{owner(assembly, 'joints', k)!r} does not fit the start at t = {t:g} s: it is {gap:.6g}{unit} off; "
                f"move the parts that it joins, or its drive"
            )
        if not abs(rate) <= _FITS * speed:
            raise InputError(
                f"{owner(assembly, 'joints', k)!r} does not fit the velocities at the start: its two points separate "
                f"at {rate:.6g}{unit}/s; give velocities that keep it"
            )


def options_of(rho: float, **given: float) -> np.record:
    """Options of a run by the spectral radius at infinite frequency (see `evolvent.solvers.alpha`)."""
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    beta, gamma = 1.0 / (1.0 + rho) ** 2, 2.0 / (1.0 + rho) - 0.5
    found: np.record = zeros_record(
        alpha_state.OPTIONS, alpha_m=alpha_m, alpha_f=alpha_f, beta=beta, gamma=gamma, **given
    )
    return found


def workspace(assembly: Assembly, times: np.ndarray, weight: np.ndarray, options: np.record) -> alpha_state.Workspace:
    """The loop's workspace at the start of a run; the model's history is cleared.

    Parameters
    ----------
    times : (nt,) float, s, of the samples
    weight : (nv,) float, size of each unknown that counts as 1
    """
    model = assembly.model
    n_v, n_j, n_c = int(model.info.nv), model.flexible.joints.size, model.flexible.cylinders.size
    beam_loads = model.flexible.beam_loads
    ends = [beam_loads["start"] + beam_loads["ramp"], model.breaks, release_times(assembly, times[0], times[-1])]
    stops = np.unique(np.concatenate(ends))
    stops = stops[(stops > times[0]) & (stops < times[-1])]
    contact.clear_history(model)
    adaptive = options.tolerance > 0.0
    step = 0.1 * options.span if adaptive else options.span
    loop = zeros_record(
        alpha_state.LOOP, time=times[0], step=step, last_step=step, quality=1.0, event_step=np.inf, stale=1
    )
    states = {name: assembly.y.copy() for name in ("y", "y0", "spare")}
    pairs = {name + end: np.zeros(n_v) for name in ("a", "dv", "loads") for end in "01"}
    out, evaluated = empty(model, times.size), times.size if reactions.applies(model, adaptive=adaptive) else 0
    balance = np.zeros(1, dtype=BALANCE)
    fields = len(BALANCE.names or ())
    return alpha_state.Workspace(
        options=options,
        loop=loop,
        balance=balance.view(np.recarray)[0],
        row=balance.view(np.float64),
        row0=np.zeros(fields),
        **states,
        **pairs,
        la=np.zeros(n_j),
        la0=np.zeros(n_j),
        dq=np.zeros(n_v),
        r=np.zeros(n_v + n_j),
        x=np.zeros(n_v + n_j),
        weight=weight,
        shares=shares(model, weight),
        powers=np.zeros((2, N_POWERS)),
        gaps=np.zeros(n_j),
        energies=np.zeros(3),
        impulse=np.zeros(n_c),
        touched=np.zeros(model.flexible.body_contacts.size),
        touches=np.zeros((2, model.flexible.body_contacts.size, N_TOUCH)),
        friction=np.zeros((2, rubbing_points(model), 3)),
        cylinders=np.zeros((2, n_c, N_CYLINDER)),
        bodies=np.zeros((2, model.bodies.size, 6)),
        **{name: np.zeros((model.bodies.size, 3, 3)) for name in ("R0", "R1")},
        **{name: np.zeros((model.bodies.size, 3)) for name in ("x0", "x1")},
        ends=np.zeros((evaluated, 2, assembly.y.size)),
        end_times=np.zeros((evaluated, 2)),
        kept=np.full(12, np.nan),
        momenta=np.zeros(6),
        samples=times.copy(),
        stops=stops,
        log_t=np.zeros(model.flexible.hinges.size + model.events.size),
        log_k=np.zeros(model.flexible.hinges.size + model.events.size, dtype=np.int64),
        out_y=np.zeros((times.size, assembly.y.size)),
        out_s=np.zeros((times.size, assembly.s.size), dtype=np.int64),
        out_a=out.acceleration,
        out_la=out.la,
        out_balance=np.zeros((times.size, fields)),
        out_momenta=np.zeros((0 if model.threads.size else times.size, 6)),
        out_cylinders=out.cylinders,
        out_touches=out.touches,
        out_friction=out.friction,
        out_bodies=out.wrenches,
    )
