"""Forces of threads in a state of an explicit method."""

from evolvent.compiled.jit import inlined
from evolvent.kernels.thread.chain import chain_points
from evolvent.kernels.thread.fields import wound_fields
from evolvent.kernels.thread.implicit import is_loaded
from evolvent.kernels.thread.joined import pull_joined
from evolvent.kernels.thread.loads import node_loads
from evolvent.kernels.thread.moving import hold_root
from evolvent.kernels.thread.spool import INEXTENSIBLE, JOINED, MOVING, SPRINGS, spool_losses
from evolvent.kernels.thread.springs import add_spring_thread, spring_points
from evolvent.kernels.thread.wound import carry_wound, place_reels


@inlined
def add_explicit_threads(t, y, s, model, dy):
    """Forces of all threads onto bodies and points; rates of the nodes of those with springs into dy.

    Returns
    -------
    dissipated, given, spools : float, W, powers taken by damping and friction, given by loads and by the spools
    """
    threads, loaded = model.threads, is_loaded(model)
    place_reels(t, y, s, model)
    given, dissipated, spools = carry_wound(s, model), 0.0, 0.0
    if model.fields.size > 0:
        given += wound_fields(t, s, model)
    for p in range(threads.size):
        if loaded:
            if threads[p].kind == INEXTENSIBLE:
                chain_points(y, s, model, p)
            else:
                spring_points(y, s, threads, model.nodes, p)
            given += node_loads(t, s, model, p)
        if threads[p].kind == MOVING:
            lost, power = hold_root(y, loaded, p, model, dy)
            dissipated += lost
            given += power
        elif threads[p].kind == SPRINGS:
            lost, power = add_spring_thread(y, 0.0, s, model, p, loaded, dy)
            dissipated += lost
            spools += power
        elif threads[p].kind == JOINED:
            spring_points(y, s, threads, model.nodes, p)
            pull_joined(s, model, p)
    return dissipated + spool_losses(y, model), given, spools
