"""Records of a model that belong to no family, and the accounts of a state."""

from __future__ import annotations

import numpy as np

from evolvent.model.family import record as _record

#: The accounts at the end of the state vector: integrals over time, then what events brought in.
DISSIPATED, SPOOL, LOAD, DRIVE, RELEASE = range(5)
JUMP_ANGULAR, JUMP_LINEAR, N_ACCOUNTS = 5, 8, 11
#: Accounts that follow in a model with beams or rods, under explicit methods: what causes have taken, and the impulse
#: of the normal forces of every surface.
BY_MASS, BY_STIFFNESS, BY_CONTACT, BY_JOINTS, IMPULSE = range(5)
#: In place of the length of an interval: a state, whose frictions are among the accounts (of explicit methods, and of
#: coordinates at samples).
KEPT = -1.0
#: Accounts of each joint's coordinate, which stand last: force of the friction now (N or N m), and what the damper, the
#: latch and the friction have dissipated (J). Each motor and synchronization has one account.
FRICTION_FORCE, BY_DAMPER, BY_LATCH, BY_FRICTION, COORDINATE_ACCOUNTS = range(5)
#: Accounts of each drivetrain, after its friction: what eddy currents, magnetic hysteresis, gear and winding took (J).
BY_EDDY, BY_HYSTERESIS, BY_GEAR, BY_COPPER, DRIVETRAIN_ACCOUNTS = range(1, 6)
#: Layout of what `inventory` writes.
KINETIC, ELASTIC, H_BODY, H_RELEASED, H_WOUND, P_ALL, H_CARRIED, N_INVENTORY = 0, 1, 2, 5, 8, 11, 14, 17

_3, _6 = (3,), (6,)
#: Records that belong to no family of parts: of the whole model, of coordinates, of places on parts, and of the rows of
#: constraints under explicit methods; iq and iv are indices of coordinates and velocities in the state, -1 for none.
OWN_RECORDS: dict[str, np.dtype] = {
    # sizes of the parts of the state, number of events, bandwidth of the rows, number of joints by penalties and of
    # spools that friction can hold, of events by which the number of moving nodes changes (the first ones), of records
    # that go slack or stick at once, of elements of beams and of rods; step: a bound for fixed steps, s; redundant: 1
    # where joints have a `slack`; exact: 1 where the residual leaves that out (`solvers.time.implicit.least_norm`);
    # checks, over: see `kernels.law_means`; rubbed: index of the account of what friction of contacts takes under
    # explicit methods, which the bristles follow; -1 where nothing has friction; stepping: 1 while an explicit method
    # steps, whose frictions go on from the start of the step; outside: 1 where something at all times ties the system
    # to bodies that are not free, open: where forces act from outside (`assembly.ends`). So has a record of a
    # family that acts at times, and of `constraints`, that does so when it acts. generalized: 1 where under explicit
    # methods forces act on coordinates (`F`, `P`), not on bodies and points alone (`registry.is_by_rates`); causes: 1
    # where losses by their causes are among the accounts, as with beams or rods; reactive: records whose friction
    # depends on multipliers
    "info": _record(
        "nq nv ny ns ne bandwidth penalties brakes releases abrupt slender redundant exact rubbed stepping outside "
        "open checks causes generalized reactive",
        "gravity",
        "step compliance over",
        gravity=_3,
    ),
    # coordinates by kind (`kernels.blocks`, `questions.Block`), in the order of `questions.Coordinates`; count: number
    # of velocities; family: code of the owner's (`model.blocks`)
    "blocks": _record("kind iq iv count family owner node switch", "inertia", inertia=_3),
    "markers": _record("kind index", "local", local=_3),
    # scalar constraints, or penalties (stiffness > 0), one multiplier each, of the families with `layout.Rows`, in
    # their order. family: number among those families that the model has records of, as in the tables `rows_*_calls`;
    # record: of that family; until: when it ceases to hold, latest: as it was given, which an event may bring forward;
    # event, switch: what releases it, event k or the latch of coordinate -2 - k, and its switch, 1 once released, or
    # -1; turns, drives, couples, ends, alone: see `layout.Rows`; outside: as in `info`; slack: factor of
    # `info.compliance`; prony, prony_end, branch: relaxation of a penalty (`families.relaxation`); driven: part of the
    # rate that a drive makes; gap0, gap1: gaps at both ends of an interval
    "constraints": _record(
        "family record event switch turns drives couples ends alone outside prony prony_end branch",
        "stiffness damping until latest slack",
        "gap rate driven gap0 gap1",
    ),
    # events that implicit methods watch as explicit ones do. stops: 1 of those that stop a run; value, middle, now: at
    # the start, middle and end of a step; armed: see `kernels.watches`
    "watches": _record("stops", "", "value middle now armed"),
    # sides of a row: first, last; each is a body, or a vector of a point mass or of a beam's node, at the index `at`
    # among the velocities (of a spinning body as well), with the mass that a force on it alone moves; -1 for none. Of a
    # reduced body it is all modal coordinates, from `at` on, along the shape of the row's joint.
    # J: forces of a unit multiplier on the side; Z: acceleration of the body under them
    "rows": _record("kind index first last", "", "rx"),
    "row_sides": _record("row body point beam reduced at", "mass", "J Z", J=_6, Z=_6),
    # sides a and b of one body, point mass or beam, b of an earlier row or earlier in the same one; mass: of vectors,
    # inverse of their entry in M^-1
    "row_pairs": _record("a b", "mass"),
}  # fmt: skip
