"""Events of threads, their jumps, and where they are between the ends of a step: compiled answers."""

from evolvent.families.threads import events, samples
from evolvent.kernels import calls, rigid, thread
from evolvent.kernels.between import keep_lengths


@calls.state
def change_values(t, y, s, model, g):
    """Release and capture of every thread, and changes of every spool with friction."""
    events.event_values(t, y, s, model, g)


@calls.apply_change
def apply_change(t, y, s, model, k, g):
    """A node leaves or reaches its spool, a whole thread separates, a spool sticks or slips."""
    return events.apply_event(t, y, s, model, k, g)


@calls.longest_step
def longest_step(y, s, model):
    """Until a stretched segment without a pull is as short as its natural length."""
    return thread.longest_step(y, s, model)


@calls.until_change
def until_change(h, y0, y1, s, model):
    """Until the first node of a free spool leaves or comes back."""
    return thread.until_release(h, y0, y1, s, model)


@calls.is_due
def is_due(y, s, model):
    """Whether a node of a free spool is to leave or come back."""
    return thread.has_release(y, s, model)


@calls.lock
def lock(t, y, s, model):
    """Wound thread is carried, spools do not turn.

    A node that is leaving its spool is at Q and moves with it; it no longer belongs to the thread wound.
    """
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    thread.reels(t, y, s, model)
    thread.lock_spools(model)
    thread.carry_wound(s, model)
    for p in range(threads.size):
        if threads[p].leaving > 0.0:
            d = threads[p].d
            rigid.add_mass(bodies, threads[p].body, threads[p].copies * threads[p].leaving, d[0], d[1], d[2])
        if threads[p].kind == thread.MOVING:
            thread.carry_root(p, model)
    for k in range(nodes.size):
        nodes[k].rhs = 0.0


@calls.kick
def kick(y, s, model, dy):
    """Tangents' rates and velocities of the nodes on moving meshes jump."""
    threads = model.threads
    for k in range(threads.size):
        if threads[k].kind == thread.INEXTENSIBLE:
            thread.kick_chain(y, s, model, k)
        if threads[k].kind == thread.MOVING:
            thread.kick_moving(y, k, model)


@calls.project
def project(y, s, model):
    """Tangents are normalised, their rates made perpendicular to them."""
    threads = model.threads
    for p in range(threads.size):
        if threads[p].kind == thread.INEXTENSIBLE:
            thread.project_chain(y, s, threads, p)


@calls.interpolate
def interpolate(theta, y0, y1, model, y):
    """Lengths of segments lie on straight lines."""
    threads = model.threads
    for k in range(threads.size):
        last = model.switches[k] - 1
        rest = threads[k].segment if threads[k].slack != 0 else 0.0
        keep_lengths(theta, y0, y1, threads[k].iq + 3 * last, -3, last + 1, rest, y)


@calls.between
def between(theta, t, h, y0, y1, model, y):
    """So do elongations of segments at the spools, and strains of moving meshes."""
    samples.keep_lengths_at_spools(theta, t, h, y0, y1, model, y)
