"""Rows of constraint of explicit methods: those of `kernels.constraints`, and boundary segments of threads.

Each row has one multiplier la, of a thread the tension of its boundary segment, and sides, each a body, a point mass or
a vector of a beam's node, on which it acts with forces la J = -la g. Rows that share a body, a point mass or a beam are
coupled; the coupled system A la = r, A = G M^-1 G^T, is symmetric and banded. Of two vectors of a beam A has the entry
of its M^-1, which is constant, times J . J.
"""

from numba import types, void

from evolvent.algebra.linalg import banded_ldl, banded_ldl_solve
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import ancf_beams, constraints, reduced, thread as chain
from evolvent.kernels.rigid import SPIN, add_wrench, respond, shift_body
from evolvent.kernels.rotations import turn
from evolvent.model import MODEL, having
from evolvent.model.questions import CONSTRAINT

USED_FOR = "rows"
THREAD = 0
#: That constraints are among the rows.
HELD = having("rows", kind=CONSTRAINT)
#: Kinds of guides.
CENTRE, AXIS = 0, 1
#: Share of 1 that the square of a direction may be off by round-off.
ROUND_OFF = 1e-14


@inlined
def has_constraints(model):
    """Whether a constraint is among the rows."""
    found = False
    for r in range(model.rows.size):
        found = found or model.rows[r].kind == CONSTRAINT
    return found


@indirect(void(REAL, VECTOR, types.int64, MODEL), used_for=HELD)
def _measure_row(t, y, r, model):
    """Forces J of a unit multiplier of the constraint of row r on its sides; `Model.F` is scratch."""
    rows, sides, bodies, k, F = model.rows, model.row_sides, model.bodies, model.rows[r].index, model.F
    constraints.measure(constraints.STATE, t, y, k, model)
    for i in range(rows[r].first, rows[r].last):
        b, at = sides[i].body, sides[i].at
        if b >= 0:
            for c in range(6):
                sides[i].Z[c], bodies[b].F[c] = bodies[b].F[c], 0.0
        for j in range(at, at + (0 if sides[i].reduced >= 0 else _numbers(bodies, b))):
            F[j] = 0.0
    constraints.add_force(t, 0.0, y, k, 1.0, model, F)
    for i in range(rows[r].first, rows[r].last):
        b, at, J = sides[i].body, sides[i].at, sides[i].J
        if sides[i].reduced >= 0:
            continue
        if b < 0:
            J[0], J[1], J[2] = -F[at], -F[at + 1], -F[at + 2]
            continue
        for c in range(6):
            J[c], bodies[b].F[c] = bodies[b].F[c], sides[i].Z[c]
        if bodies[b].motion == SPIN:
            n = bodies[b].axis
            x, y_, z = turn(bodies[b].R, n[0], n[1], n[2])
            J[3] -= F[at] * x
            J[4] -= F[at] * y_
            J[5] -= F[at] * z


@inlined
def _numbers(bodies, b):
    """Numbers of a side among the generalised forces: of a vector, of the body b if that is not -1."""
    if b < 0:
        return 3
    return 1 if bodies[b].motion == SPIN else 0


@indirect(types.int64(REAL, VECTOR, INTEGERS, MODEL))
def build_rows(t, y, s, model):
    """Forces J of unit multipliers, responses Z and the factored matrix A of all rows.

    Returns -1, or the first row that the rows before it already imply. A constraint that does not hold has
    no forces.
    """
    rows, sides, pairs, threads, bodies = model.rows, model.row_sides, model.row_pairs, model.threads, model.bodies
    width = model.info.bandwidth
    A = model.A
    for r in range(rows.size):
        k = rows[r].index
        for i in range(rows[r].first, rows[r].last):
            for c in range(6):
                sides[i].J[c] = sides[i].Z[c] = 0.0
        for c in range(width + 1):
            A[r, c] = 0.0
        if rows[r].kind == THREAD:
            A[r, 0] = chain.chain_matrix(y, s, model, k) * threads[k].copies
            links, bound = chain.chain_links(s, threads, k)
            if not bound:
                continue
            J = sides[rows[r].first].J
            if chain.is_loose(threads, k):
                radius = threads[k].r
                A[r, 0] += threads[k].copies * radius * radius / threads[k].spool
                nx, ny, nz = chain.spool_direction(threads, bodies, k)
                reaction = float(threads[k].copies) * radius
                J[3] -= reaction * nx
                J[4] -= reaction * ny
                J[5] -= reaction * nz
            q = threads[k].iq + 3 * links
            copies = float(threads[k].copies)
            d = threads[k].d
            add_wrench(J, d[0], d[1], d[2], copies * y[q], copies * y[q + 1], copies * y[q + 2])
        elif constraints.acts(t, s, model.constraints, k):
            _measure_row(t, y, r, model)
        else:
            A[r, 0] = 1.0
        for i in range(rows[r].first, rows[r].last):
            if sides[i].reduced >= 0:
                if rows[r].kind == CONSTRAINT and constraints.acts(t, s, model.constraints, k):
                    A[r, 0] += reduced.shape_product(k, k, model)
            elif sides[i].body < 0:
                square = sides[i].J[0] ** 2 + sides[i].J[1] ** 2 + sides[i].J[2] ** 2
                A[r, 0] += (1.0 if abs(square - 1.0) < ROUND_OFF else square) / sides[i].mass
        for i in range(rows[r].first, rows[r].last):
            b = sides[i].body
            if b >= 0:
                respond(bodies, b, sides[i].J, sides[i].Z)
                for c in range(6):
                    A[r, 0] += sides[i].J[c] * sides[i].Z[c]
    for k in range(pairs.size):
        a, b = pairs[k].a, pairs[k].b
        r, value = sides[a].row, 0.0
        if sides[a].body >= 0:
            for c in range(6):
                value += sides[a].J[c] * sides[b].Z[c]
        elif sides[a].reduced >= 0:
            value = reduced.shape_product(rows[r].index, rows[sides[b].row].index, model)
        else:
            for c in range(3):
                value += sides[a].J[c] * sides[b].J[c]
            value /= pairs[k].mass
        A[r, r - sides[b].row] += value if sides[b].row < r else 2.0 * value
    return banded_ldl(A, rows.size, width)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def row_velocity_terms(t, y, s, model):
    """What the rows' accelerations need without any force: into rx (and rhs of the chains); after `build_rows`."""
    rows, loaded = model.rows, chain.is_loaded(model)
    for r in range(rows.size):
        k = rows[r].index
        if rows[r].kind == THREAD:
            rows[r].rx = chain.chain_rhs(y, s, model, k, loaded) * model.threads[k].copies
        else:
            rows[r].rx = constraints.bend(k, model) if constraints.acts(t, s, model.constraints, k) else 0.0


@inlined
def driven_power(t, s, model):
    """Power of what drives constraints, by the last multipliers, W."""
    rows, held, power = model.rows, model.constraints, 0.0
    for r in range(rows.size):
        k = rows[r].index
        if rows[r].kind == CONSTRAINT and held[k].drives != 0 and constraints.acts(t, s, held, k):
            power += model.la[r] * held[k].driven
    return power


@indirect(void(INTEGERS, MODEL, VECTOR))
def solve_rows(s, model, dy):
    """Multipliers la from rx, the bodies' twists a; wrenches and points' forces f with them; chains included.

    Parameters
    ----------
    dy : (ny,) float, rates of the state, of which those of the velocities of beams are used, and get what rows add
    """
    rows, sides, bodies, points = model.rows, model.row_sides, model.bodies, model.points
    la, F, n_q = model.la, model.F, model.info.nq
    n = rows.size
    for r in range(n):
        la[r] = rows[r].rx
    for k in range(sides.size):
        part, J = 0.0, sides[k].J
        b, i, at = sides[k].body, sides[k].point, n_q + sides[k].at
        if b >= 0:
            for c in range(6):
                part += J[c] * bodies[b].a[c]
        elif sides[k].reduced >= 0:
            part = reduced.shape_rate(rows[sides[k].row].index, model, dy)
        else:
            for c in range(3):
                part += J[c] * points[i].f[c] * points[i].compliance if i >= 0 else J[c] * dy[at + c]
        la[sides[k].row] -= part
    banded_ldl_solve(model.A, n, model.info.bandwidth, la)
    ancf_beams.clear_held(model)
    for r in range(n):
        if rows[r].kind == THREAD:
            chain.chain_solve(s, model, rows[r].index, la[r])
    for k in range(sides.size):
        force, J = la[sides[k].row], sides[k].J
        b, i, at = sides[k].body, sides[k].point, sides[k].at
        if b >= 0:
            for c in range(6):
                bodies[b].a[c] += force * sides[k].Z[c]
                bodies[b].F[c] += force * J[c]
        elif sides[k].reduced >= 0:
            reduced.move_modes(rows[sides[k].row].index, force, model, dy, at + n_q)
        else:
            for c in range(3):
                if i >= 0:
                    points[i].f[c] += force * J[c]
                else:
                    F[at + c] += force * J[c]
    if model.beams.size > 0:
        ancf_beams.move_held(model, False, dy)


@inlined
def move_sides(model, y):
    """Move all sides of constraints by the displacements that the multipliers la stand for, weighted by the masses."""
    rows, sides, bodies, points, F = model.rows, model.row_sides, model.bodies, model.points, model.F
    ancf_beams.clear_held(model)
    for k in range(sides.size):
        if rows[sides[k].row].kind == THREAD:
            continue
        la, b, i = model.la[sides[k].row], sides[k].body, sides[k].point
        if b >= 0:
            for c in range(6):
                bodies[b].a[c] += la * sides[k].Z[c]
        elif sides[k].reduced >= 0:
            place = model.reduced_bodies[sides[k].reduced].iq
            reduced.move_modes(rows[sides[k].row].index, la, model, y, place)
        else:
            for c in range(3):
                if i >= 0:
                    y[points[i].iq + c] += la * sides[k].J[c] / points[i].mass
                else:
                    F[sides[k].at + c] += la * sides[k].J[c]
    for k in range(sides.size):
        b = sides[k].body
        if b >= 0 and rows[sides[k].row].kind != THREAD:
            shift_body(y, bodies, b)
            for c in range(6):
                bodies[b].a[c] = 0.0  # so that a body with several sides moves once
    if model.beams.size > 0:
        ancf_beams.move_held(model, True, y)
