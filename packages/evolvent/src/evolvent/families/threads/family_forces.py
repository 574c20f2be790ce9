"""Forces, energies and results of threads: compiled answers."""

from evolvent.kernels import calls, extremes, points, thread
from evolvent.kernels.thread.spool import held_tension
from evolvent.model.powers import DRIVEN, MARKER_LOADS, SPOOLS, SPRINGS


@calls.force
def force(interval, model):
    """Forces and inertia of all threads in a state; their forces on points and bodies are among those of these."""
    step, powers = interval.step, interval.powers
    lost, given, spools = thread.add_thread_residual(step.t, interval.ym, interval.dv, step.rub, model, model.F)
    powers[SPRINGS] += lost
    powers[MARKER_LOADS] += given
    powers[SPOOLS] += spools


@calls.force
def step_force(interval, model):
    """Forces and inertia of all threads over a step."""
    step, powers = interval.step, interval.powers
    lost, given, spools, driven = thread.add_thread_step(
        step.tm, step.h, interval.ym, interval.y0, interval.y1, model, model.F
    )
    powers[SPRINGS] += lost
    powers[MARKER_LOADS] += given
    powers[SPOOLS] += spools
    powers[DRIVEN] += driven


@calls.force
def end_step(interval, model):
    """What relaxation of all threads takes over a step."""
    interval.powers[SPRINGS] += thread.relaxed_threads(interval.step.h, interval.step.share, model)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    thread.add_thread_tangent(interval.ym, interval.step.c_mass, interval.step.c_rate, model, matrix)


@calls.tangent
def step_tangent(interval, model, matrix):
    """Derivatives of `step_force`."""
    step = interval.step
    thread.add_thread_step_tangent(step.tm, interval.ym, step.h, step.c_mass, step.c_rate, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Lengths of all segments."""
    thread.measure_threads(end, t, y, model)


@calls.energy
def energy(interval, model, out):
    """Energies of all threads."""
    thread.add_thread_energies(interval.step.t, interval.ym, model, out)


@calls.force
def explicit_force(interval, model):
    """Forces of all threads on what they leave and end at, and rates of the nodes of those of springs."""
    powers = interval.powers
    lost, given, spools = thread.add_explicit_threads(interval.step.t, interval.ym, interval.s, model, interval.rates)
    powers[SPRINGS] += lost
    powers[MARKER_LOADS] += given
    powers[SPOOLS] += spools


@calls.note_extremes
def note_extremes(s, model):
    """Extremes of the tensions of threads at their spools; on a moving mesh implicit steps do not evaluate them."""
    for p in range(model.threads.size):
        if model.threads[p].kind == thread.MOVING:
            continue
        extremes.note_extremes(model.threads[p].extremes, 0, held_tension(s, model, p))


@calls.force
def prepare_sample(interval, model):
    """Tensions that are multipliers."""
    thread.note_tensions(interval.la, model)


@calls.force
def evaluate_rates(interval, model):
    """Motion, tensions, energies and momenta of all threads."""
    for p in range(model.threads.size):
        thread.note_results(interval.ym, interval.s, model, p)


@calls.force
def evaluate(interval, model):
    """Loads on threads."""
    step = interval.step
    if model.loads.size > 0:
        thread.evaluate_thread_loads(int(step.sample), interval.times, interval.s, step.factor, model)


@calls.turning_tangent
def turning_tangent(factor, spin, y, model, matrix):
    """Derivatives of the forces by a steady turn."""
    n_q, threads = model.info.nq, model.threads
    for k in range(threads.size):
        if threads[k].kind == thread.MOVING:
            thread.add_turning_elements(factor, spin, k, model, matrix)
            continue
        for i in range(1 if threads[k].end >= 0 else 0, model.switches[k]):
            mass = factor * model.nodes[threads[k].node + i].mass
            points.add_centrifugal(mass, threads[k].iv + 3 * i - n_q, spin, matrix)


@calls.turning
def turning(factor, spin, y, model, a):
    """Drift of the nodes on moving meshes."""
    for k in range(model.threads.size):
        if model.threads[k].kind == thread.MOVING:
            thread.note_drift(factor, spin, k, model)


@calls.force
def explicit_carried(interval, model):
    """Accelerations of nodes with segments of fixed length, of spools and of moving meshes, by those of all else."""
    y, s, dy, powers = interval.ym, interval.s, interval.rates, interval.powers
    threads, info, loaded = model.threads, model.info, thread.is_loaded(model)
    for p in range(threads.size):
        if threads[p].kind == thread.INEXTENSIBLE:
            powers[SPOOLS] += thread.chain_rates(y, s, model, p, loaded, dy)
            info.step = min(info.step, thread.boundary_step(s, threads, model.nodes, p))
    thread.spring_spools(y, s, model, dy)
    for p in range(threads.size):
        if threads[p].kind == thread.MOVING:
            powers[SPOOLS] += thread.moving_rates(y, p, model, dy)
    powers[SPOOLS] += thread.carry_power(s, model)


@calls.state
def add_sums(t, y, s, model, out):
    """Energies and momenta of all threads."""
    thread.reels(t, y, s, model)
    for p in range(model.threads.size):
        thread.thread_inventory(y, s, model, p, out)
