"""Records of the model's families, and the accounts of a state."""

from __future__ import annotations

import numpy as np

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


def _record(integers: str, floats: str, scratch: str = "", **shapes: tuple[int, ...]) -> np.dtype:
    """A family's record: integer and float fields that a part writes, then scratch that a call overwrites."""
    names: list[tuple[str, type]] = [(name, np.int64) for name in integers.split()]
    names += [(name, np.float64) for name in (floats + " " + scratch).split()]
    return np.dtype([(name, kind, shapes.get(name, ())) for name, kind in names], align=True)


_3, _33, _6, _66 = (3,), (3, 3), (6,), (6, 6)
#: One record a part; iq and iv are the indices of its coordinates and velocities in the state, -1 for none.
#: The scratch fields hold the last call's values in inertial axes, by the kernels' letters.
RECORDS: dict[str, np.dtype] = {
    # sizes of the parts of the state, number of events, bandwidth of the rows, number of joints by penalties and of
    # spools that friction can hold; step: a bound for fixed steps, s; redundant: 1 where joints have a `slack`; exact:
    # 1 where the residual leaves that out (`solvers.least_norm`); checks, over: see `kernels.law_means`; rubbed: index
    # of the account of what friction of contacts takes under explicit methods, which the bristles follow; -1 where
    # nothing has friction; stepping: 1 while an explicit method steps, whose frictions go on from the start of the
    # step; outside: 1 where something at all times ties the system to bodies that are not free, open: where forces act
    # from outside (`assembly.ends`). So has a record of joints, contact_surfaces and body_contacts that does so when it
    # acts
    "info": _record(
        "nq nv ny ns ne bandwidth penalties brakes redundant exact rubbed stepping outside open checks",
        "gravity",
        "step compliance over",
        gravity=_3,
    ),
    # coordinates by kind (`kernels.blocks`), in the order of their owners; count: number of velocities; family, owner:
    # whose; node: number of a beam's, thread's or rod's node; inertia: of the velocities, diagonal of the mass matrix
    "blocks": _record("kind iq iv count family owner node", "inertia", inertia=_3),
    # path: 1 + kind of the drive (`kernels.drive`) that moves a driven body along `direction`, 0 for none; along: its
    # acceleration, m/s2; of thread that moves with the body (`kernels.thread.step`): carried (kg), moment, own
    # (inertia), and spin0, spin1, momentum by turning on spools at both ends of a step, body axes; torque: on a free
    # body over a step, less that of its wheels, in the axes of the step's start
    "bodies": _record(
        "motion iq iv path path_first path_last path_law",
        "mass inertia axis R0 x0 rate spin_inertia direction",
        "R x v w M L F J a along carried moment own spin0 spin1 torque linear angular kinetic",
        inertia=_33, axis=_3, R0=_33, x0=_3, direction=_3, R=_33, x=_3, v=_3, w=_3, M=_66, L=_66, F=_6, a=_6,
        moment=_3, own=_33, spin0=_3, spin1=_3, torque=_3, linear=_3, angular=_3,
    ),
    # without mass: a node of a beam, whose coordinates it has
    "points": _record("iq iv", "mass compliance", "f linear kinetic", f=_3, linear=_3),
    "markers": _record("kind index", "local", local=_3),
    # slack: 1 of one that only pulls; of a step: lengths at both ends, and direction at its end; line, line0: vector
    # from a to b, of the last state and of the last step; passed: see `kernels.springs.note_lines`; the others are in
    # `RESULTS`, and lost: W, dissipated
    "springs": _record(
        "a b law first last slack",
        "stiffness damping length lateral_stiffness lateral_damping axis",
        "length0 length1 end line line0 passed distance extension rate tension lateral stored lost",
        axis=_3, end=_3, line=_3, line0=_3, lateral=_3,
    ),
    "links": _record("a b sense", "length drum axis zero", axis=_3, zero=_3),
    # kind 0: the body's centre keeps its coordinate `value` along the direction; 1: the body's axis stays across it
    "guides": _record("kind body", "direction axis value", direction=_3, axis=_3),
    # shortest: m, of the segment at the spool whose stiffness follows its length (`kernels.thread.boundary`), 0 where
    # it does not; line_energy: J/m, W there; tip: the point mass that the first node is, or -1. Of a step: rest lengths
    # at the spool, rates of the spool and squares of the end's speed at both ends; sums: of `kernels.thread.energy`;
    # density, tip_mass, root, drift, pull, exit, take_* (take_drive -1 without a take-up reel), growth (1/s), taken,
    # out_pull, exit_field, end_field: of a mesh that moves (`kernels.thread.moving`); element: m, rest length of a
    # segment off the spool
    "threads": _record(
        "kind iq iv n node copies body drive first last law spool_q spool_v turned carried separates end slack coupled "
        "spool_switch motor_profile motor_law motor_first motor_last tip take_drive take_first take_last take_law",
        "segment stiffness damping departure payout_axis chord normal radius spool_inertia spool_torque capture "
        "coiling core spool_friction spool_viscous shortest density tip_mass take_radius",
        "Q d X phi b spool leaving start field r loose motor friction line_energy rest0 rest1 turning0 turning1 "
        "square0 square1 sums turning reach out hub torque hub_pull end_pull kinetic elastic linear angular "
        "root drift pull exit element growth taken out_pull exit_field end_field",
        departure=_3, payout_axis=_3, chord=_3, normal=_3, Q=_6, d=_3, X=_3, b=_3, start=_3,
        sums=(N_INVENTORY,), hub_pull=_3, end_pull=_3, linear=_3, angular=_3, root=(10,), drift=_3, exit=_3,
        taken=_3, exit_field=_3, end_field=_3,
    ),
    # mass, its inverse, and the length of thread whose loads the node carries; of the segment inwards of it: of a step
    # lengths and elongations at both ends, direction at its end
    "nodes": _record(
        "", "mass compliance span",
        "x v af tension piv off rhs length along length0 length1 extension0 extension1 end",
        x=_3, v=_3, af=_3, end=_3,
    ),
    # first, last: own parameters, and those of a profile or of a law of a thread's load; law_first, law_last: of the
    # law of a force or torque; node: of a thread; attitude: 1 of a torque whose law is called with it, 2 of one that
    # follows it; scale: statics' load factor of a law on a thread; rod: 1 + rod whose length that is out it follows, or
    # 0; vector, middle, power, work: see `RESULTS`; rate, along: `kernels.work`
    "loads": _record(
        "kind target law first last law_first law_last node attitude rod", "scale",
        "vector middle power work rate along",
        vector=_3, middle=_3,
    ),
    # value, middle, now: at the start, middle and end of a step of an implicit method; armed: see `kernels.user_events`
    "events": _record("law first last stops", "", "value middle now armed"),
    # accelerations of every mass: of an orbital frame K x - 2 w x v, or by a law; scale: statics' load factor
    "fields": _record("kind law first last", "K w scale", "force power work", K=_33, w=_3, force=_3),
    # points by which fields are integrated over a body (`local`) or an element (S, of its nodal vectors); -1 for none
    "field_points": _record("body element", "mass local S", local=_3, S=(8,)),
    # rate and angle of a wheel relative to its body, impulse of a thruster at iv; profile: index among the parameters,
    # or -1; actuators of a controller: their kind, and `count` numbers from `place` on, then how they share its torque
    "wheels": _record(
        "body iq iv profile law first last",
        "axis inertia torque torque_limit rate_limit viscous friction slip",
        "command motor drag coriolis motor0 drag0 angle rate rubs spin momentum kinetic",
        axis=_3, momentum=_3,
    ),
    "thrusters": _record(
        "body iv profile", "local direction force limit", "command push push0 impulse place vector",
        local=_3, direction=_3, place=_3, vector=_3,
    ),
    "controllers": _record(
        "body actuators count place path law first last",
        "proportional derivative target axis limit dead_band",
        "error slip torque off",
        proportional=_3, derivative=_3, target=(4,), axis=_3, error=_3, slip=_3, torque=_3,
    ),
    # sides of a row: first, last; each is a body, or a vector of a point mass or of a beam's node, at the index `at`
    # among the velocities (of a spinning body as well), with the mass that a force on it alone moves; -1 for none. Of a
    # reduced body it is all modal coordinates, from `at` on, along the shape of the row's joint.
    # J: forces of a unit multiplier on the side; Z: acceleration of the body under them
    "rows": _record("kind index first last", "", "rx"),
    "row_sides": _record("row body point beam reduced at", "mass", "J Z", J=_6, Z=_6),
    # sides a and b of one body, point mass or beam, b of an earlier row or earlier in the same one; mass: of vectors,
    # inverse of their entry in M^-1
    "row_pairs": _record("a b", "mass"),
    # beams; a node's coordinates stand together, node after node; first_node: number of the first among
    # the nodes of all beams and rods; paper: 1 where the damping is the paper's, which a turn of the whole feels; held:
    # 1 where rows of constraint act on its nodes; axes: rows x along, y and z of the root
    "beams": _record(
        "kind iq iv nodes first_element elements first_node paper held", "length",
        "kinetic elastic bending linear angular axes", linear=_3, angular=_3, axes=_33,
    ),
    # nodes of beams and rods; undeformed: position without stress, from the root, in its axes; share: part of the rod
    "beam_nodes": _record(
        "", "undeformed share", "x v slope deflection curvature", undeformed=_3, x=_3, v=_3, slope=_3, deflection=_3
    ),
    # form, bending, mass: indices in the pools of the model, bending of the form of that alone; force, tangent,
    # energy: indices (`jit.slot`) of `kernels.element_calls`; stretch: 1 of a cable with engineering strain;
    # section: index among the parameters of what `beam_strains` needs; changes: of products, stretches and curvatures
    # over the step before, then over this one (`ancf.force_of`); free: strains by heat at `beam_strains.POINTS`; the
    # others are in `RESULTS`
    "elements": _record(
        "beam iq iv form bending mass force tangent energy stretch section", "length alpha beta thickness",
        "changes free strain axial_force energy_density shear_force_y shear_force_z bending_moment torsional_moment "
        "bending_moment_y bending_moment_z free_strain free_curvature_y free_curvature_z",
        changes=(56,), free=(5, 3),
        **dict.fromkeys(
            ("strain", "axial_force", "energy_density", "shear_force_y", "shear_force_z", "bending_moment",
             "free_strain", "free_curvature_y", "free_curvature_z"), (2,)
        ),
    ),
    # geometrically exact rods: their nodes are the bodies from first_body on; alpha: damping by mass;
    # tape: 1 + tape of which the section flattens, or 0; payout: 1 where the length that is out follows a drive
    # (`kernels.rod_payout`): density and gyration, mass and inertia per length; out, rate, acceleration: of the length;
    # grown0, grown1: of a sample, ratios of its length to those at the ends of its step
    "rods": _record(
        "first_element elements first_body first_node tape payout drive law first last",
        "length alpha density gyration",
        "kinetic linear angular out rate acceleration drive_force grown0 grown1",
        linear=_3, angular=_3, gyration=_33,
    ),
    # an element between bodies a and b, whose axes are those of its sections; arms: from the bodies' centres to its
    # ends, body axes; stiffness: of strains of force and moment; rest: (Gamma_0, K_0), see `kernels.rod_strains`;
    # section: compliance of the section in its middle; fibres: E A times the means of rho^2 and rho^4, N m2, N m4, see
    # `kernels.strip`, or 0; heated: 1 with a thermal load, whose free strains are `free`.
    # m0, m1: measures at the start and the end of an interval; before: change of the strains over the step before;
    # stored, bent: J, elastic energy and that of moments; the others are in `RESULTS`. tape: as of rods, and tape_node
    # its first node; flattening, flattening_slope: forces by `tape.evaluate_tape`, with derivatives; curvature_rate: of
    # a state, before_product: changes of curvature times coordinates over the step before. flows: 1 of a rod that pays
    # out, with the whole strains, their rates, stresses times length of the flow, and pull (`rod_payout.pull_of`)
    "rod_elements": _record(
        "a b heated tape tape_node flows",
        "length beta arm_a arm_b stiffness rest section fibres",
        "free m0 m1 before stored bent energy_density strain shear_strain_y shear_strain_z twist curvature_y "
        "curvature_z axial_force shear_force_y shear_force_z torsional_moment bending_moment_y bending_moment_z "
        "flattening flattening_slope curvature_rate before_product whole rates flow pull",
        whole=_6, rates=_6, flow=_6,
        flattening=_3, flattening_slope=_33, before_product=(2,), fibres=(2,),
        arm_a=_3, arm_b=_3, stiffness=_66, rest=_6, section=_66, free=_6, m0=(15,), m1=(15,), before=_6,
    ),
    # sections of rods that flatten (`kernels.tape`). bending: stiffness of the wall times the width, N m2; transverse:
    # its curvature without stress, 1/m; slenderness: u over the square of the curvature, m2; twisting: m2; stretching:
    # g over u; closed: 1 of a lenticular section
    "tapes": _record("first_node nodes closed", "bending poisson transverse slenderness twisting stretching"),
    # the coordinate of a node; alpha: damping by mass, 1/s; value0, value1: at the ends of a step; before: its change
    # over the step before
    "tape_nodes": _record("iq iv", "mass alpha", "value rate force value0 value1 before"),
    # reduced flexible bodies: the bodies from first_body on are the frame and the interface nodes; modes, first_mode:
    # of the modal coordinates at iq, iv; mass: of each of them
    "reduced_bodies": _record(
        "first_body nodes first_mode modes iq iv", "mass", "kinetic elastic linear angular", linear=_3, angular=_3
    ),
    # of a step: change of the coordinate, and that over the step before
    "modes": _record("", "stiffness damping", "change before"),
    # scalar constraints, one a multiplier, or penalties (stiffness > 0), until a time; of links and guides as well. A
    # side is a vector: of coordinates (on 1, at iq, iv), `local` of a body (on 0), or `local` times the slopes of a
    # node (on 2, at iq, iv); the third side is the direction of ALONG; nodes: 1 where a side is of a beam; path: how
    # a drive moves the row; event, switch: what releases it, event k or the latch of coordinate -2 - k, and its switch,
    # 1 once released, or -1; slack: factor of `info.compliance`; latest: `until` as it was given, which an event may
    # bring forward; first, last: of a segment of a thread, its thread and node; reduced: 1 + reduced body of which an
    # interface node is held, or 0; mode_shape: first parameter of the shape of its modes along the row. measured:
    # distance, product, travel or angle, of which the gap is the rest; u0, u1: u at both ends of an interval; force,
    # moment: on the second side
    "joints": _record(
        "kind on index iq iv path drive law first last event switch nodes reduced mode_shape outside",
        "local along centre axis zero radius value stiffness damping until latest slack",
        "u g u0 u1 measured gap rate driven bends gap0 gap1 stored force moment",
        on=(3,), index=(3,), iq=(3,), iv=(3,), local=(3, 3), along=_3, centre=_3, axis=_3, zero=_3, u=(3, 3), g=(3, 3),
        u0=(3, 3), u1=(3, 3), force=_3, moment=_3,
    ),
    # coordinates of joints. kind 0: angle about the body's `axis` from its direction `zero` to a second direction, a
    # beam's slope (on 1, at iq, iv) or `local` of the body `other` (on 0); kind 1: travel along the body's `axis` from
    # its point `zero` to a second point. switch: the first of two switches, the angle in quarter turns, rounded, and 1
    # once latched. account: index of its accounts in the state (`COORDINATE_ACCOUNTS`).
    # Of the last forces: torque of the joint, with derivatives slope and damper of all torques but for those of motors,
    # which the tangent finds; applied: torque of motors and synchronizations, with derivatives of the latter; u, g:
    # second side, and direction of the force on it; p, q: parts of a second direction at the start and the end of an
    # interval; leaves, comes: how far it would move in a step at its rates at both ends; bristle: deflection of the
    # friction, slips: the sense in which it slips, rubs: its force, relax: of its numerical damping; stored: J; lost,
    # latch_lost: powers, W. Of the last step: before, pace, bristle0, rubs0, lost0, latch_lost0, and anchor, the
    # coordinate at which the bristle has no force. caught: rate at which the latch has locked; peak: its largest
    # torque; start_rate, end_rate: in the states at both ends of a step (`kernels.turning`)
    "coordinates": _record(
        "kind body on other iq iv switch account",
        "axis zero local stiffness damping rest low high stop latch latch_stiffness latch_damping side friction stick",
        "angle rate torque before pace leaves comes slope damper applied applied_slope applied_damper motor_slope "
        "motor_damper u g p0 q0 p1 q1 bristle slips rubs relax stored lost latch_lost latch_torque bristle0 rubs0 "
        "lost0 latch_lost0 anchor caught peak start_rate end_rate",
        axis=_3, zero=_3, local=_3, u=_3, g=_3,
    ),
    # motors on coordinates: by a profile (kind 0), a user's law (1), PD to a drive's motion (2), a voltage (3) or a
    # current (4), constant: N m/A or N/A, of the coordinate, resistance: ohm; slope, damper: derivatives; account:
    # of the work; event, switch, until, latest: when they are switched off, as of joints; on: 1 at the last
    # evaluation, or 0
    "motors": _record(
        "coordinate kind drive law first last account event switch",
        "position_gain velocity_gain limit rate_limit until latest constant resistance",
        "on time angle rate torque power power0 reference current slope damper",
    ),
    # what motors lose before their joints (`kernels.drivetrain`), with friction as of joint coordinates; forward,
    # backward: efficiencies, holds: of a gear that locks itself
    "drivetrains": _record(
        "coordinate motor account", "ratio detent detents offset hysteresis eddy forward backward holds stick",
        "friction by_push slips bristle bristle0 anchor relax rubs rubs0 slope damper cogging torque stored lost lost0 "
        "copper copper0",
    ),
    # cables between two coordinates: they keep ratio_b x_b - ratio_a x_a = offset; account: of what is dissipated
    "synchronizations": _record(
        "a b account", "ratio_a ratio_b offset stiffness damping", "stretch torque energy lost lost0"
    ),
    # resistances on coordinates that depend on the path (`kernels.resistance`): curves from `curve` on, bristles from
    # first to last; start: number of the first curve, switch: index of that of the present one; account: of what is
    # lost. time: s, of the last change of the curve, changes: how many there were
    "resistances": _record(
        "coordinate kind curve curves first last start switch account",
        "",
        "angle rate torque rubs stored time changes",
    ),
    # first, count: of the coordinates among the parameters, then the torques and the energies; low, high: where the
    # curve ends, and below, above: the number of the curve behind that
    "curves": _record("first count below above", "low high"),
    # before, force0: coordinate and force at the start of a step; slips: the sense in which it slips; account: of the
    # force
    "bristles": _record("kind account", "stick limit", "before force0 force slips"),
    # friction by the reactions of a joint, whose rows are first to last, on a coordinate of its own
    # (`kernels.bearing`); account: of what it has dissipated. by_force, by_moment, by_axis: derivatives of the load by
    # the force and the moment on the second body, and by the axis; slips: the sense in which it slides, noted: friction
    # at the iteration before; relax, fresh: under generalized-alpha. Of the last step: bristle0, rubs0, slips0, anchor
    "bearings": _record(
        "coordinate first last account",
        "coefficient static radial axial twist constant arm stick",
        "load by_force by_moment by_axis radial_force axial_force tilting slope limit angle rate "
        "bristle slips rubs noted relax fresh stored bristle0 rubs0 slips0 anchor",
        by_force=_3, by_moment=_3, by_axis=_3,
    ),
    # a user-defined law between points, which are markers, from first_marker on. balanced: 1 where the last forces had
    # neither a resultant nor a moment; symmetric: 1 where their last derivatives by position were symmetric;
    # stated: 1 once the law has given an energy or a power
    "custom_forces": _record("law first last first_marker points", "", "balanced symmetric stated"),
    # angles and travels of gears, which are joints (`kernels.gear`); first, last of a joint: its coordinates; fields as
    # those of joint coordinates
    "gear_coordinates": _record(
        "kind body on other iq iv", "axis zero local factor", "angle before rate u g p0 q0 p1 q1",
        axis=_3, zero=_3, local=_3, u=_3, g=_3,
    ),
    # rigid surfaces on bodies (`kernels.surfaces`), and the points of beams that are checked against them: first, last;
    # under: -1, or the beam on whose turns these lie, wound in the sense +-1 and ahead of them by the angle `shift`;
    # account: index in the state of the bristle of its first point under explicit methods, three numbers a point;
    # impulse: N s, which implicit methods sum up
    "contact_surfaces": _record(
        "body law first last under surface account outside",
        "sense shift centre axis radius half_length stiffness exponent damping friction bristle_stiffness "
        "bristle_damping",
        "force moment normal impulse energy power touching",
        centre=_3, axis=_3, force=_3, moment=_3,
    ),
    # a contact point is S . (four vectors of its element). Of the step's start: gap (m), distance `offset` from the
    # axis and place `xi` on it (m), point `anchor` in body axes (m), bristle `stick` (m) and friction `drag` (N) in the
    # bristle's axes, part `damper` of the normal force (N); of its end: those with 1, `distance`, position x (m) and
    # normal n1. Of the interval: normal force (N) with derivatives d_gap and d_rate, n: its direction, f: whole force
    # (N), and t, along, across, by_normal of `contact_laws.friction`, tilt: part of the bristle's stretch along
    # the normal, by which friction turns with it (m). Of turns: element and point below, carrier and
    # xi, normals n0 and n1 at both ends, how far `offset` off along the axis the start was; `anchor` is what it moved
    # by against what is below. rest: depth that a point keeps (`surfaces.measure_points`); sank: change of the gap over
    # the step before, of the filter of `contact_laws.press`; viscous: of `contact_laws.sliding_damper`;
    # rubbing: of f the friction; slid0, slid1: sliding velocity at both ends of a step, in the bristle's axes
    "contact_points": _record(
        "element iq iv carrier carrier1", "S reach viscous",
        "xi xi1 offset "
        "gap anchor stick damper gap1 stick1 n distance f force d_gap d_rate damper1 t along across by_normal tilt "
        "drag drag1 "
        "x n0 n1 rest rest1 sank apart rubbing slid0 slid1",
        x=_3, n0=_3, n1=_3, rubbing=_3, slid0=_3, slid1=_3,
        iq=(4,), iv=(4,), S=(4,), anchor=_3, stick=_3, stick1=_3, n=_3, f=_3, t=_3, drag=_3, drag1=_3,
    ),
    # contact points between two bodies: a sphere or capsule (half length, radius_a) of body a, and on body b another
    # one, a plane with the normal axis_b, or a box with the half lengths `sides` (`kernels.body_gaps`); radius: sum of
    # both; first: the first of its part; extent: m, of which a share is the depth of the explicit step's bound;
    # share: of the points of the part's kind that can touch at the same time. Of the step's start:
    # position X and rotation Q of a in the axes of b, and what ends in 0; of its end: what ends in 1. rubbing: friction
    # on a (N), c: point of contact (m), inertial axes; on_a, on_b: force (N) and moment (N m) at the bodies' origins;
    # impulse: of the normal force, N s, NaN under explicit methods; slid0, slid1: as of contact points
    "body_contacts": _record(
        "a b first law surface account outside",
        "place_a axis_a place_b axis_b half_a half_b sides radius_a radius extent share "
        "stiffness exponent damping friction bristle_stiffness bristle_damping viscous",
        "X Q gap stick damper drag gap1 stick1 damper1 drag1 slide "
        "distance0 distance u0 v0 w0 s0 t0 u1 v1 w1 s1 t1 n n1 t "
        "rubbing c on_a on_b force impulse d_gap d_rate along across by_normal tilt energy power sank "
        "slid0 slid1",
        place_a=_3, axis_a=_3, place_b=_3, axis_b=_3, sides=_3,
        X=_3, Q=_33, stick=_3, drag=_3, stick1=_3, drag1=_3, slide=_3, n=_3, n1=_3, t=_3, rubbing=_3, c=_3,
        on_a=_6, on_b=_6, slid0=_3, slid1=_3,
    ),
    # loads on beams: a torque about an axis spread over the mass, a force per length, a force at a vector, a moment on
    # a node; first, last: indices of a profile, or of a law's parameters; frame: 1 of section axes; now: last value;
    # pitch: of the screw motion along which a torque acts, m/rad
    "beam_loads": _record(
        "kind beam iq iv first last law frame", "value centre axis pitch start end ramp",
        "now vector middle power work rate along",
        centre=_3, axis=_3, vector=_3, middle=_3,
    ),
    # temperatures of a beam or a rod, the other is -1 (`kernels.thermal`): indices of profiles among the parameters, or
    # -1, and of the constants of the elements; expansions: of those of a beam by temperature at `beam_strains.POINTS`;
    # now: last amplitudes; change, along_y, along_z, work: see `RESULTS`. Of a sample: amplitudes; elastic, bending: J,
    # what strain energies change by, less the free strains; own: the part of it that is quadratic in the amplitudes;
    # pull: minus the derivative of the rest by them
    "thermal_loads": _record(
        "beam rod temperature gradient_y gradient_z constants expansions", "",
        "now change along_y along_z elastic bending own amplitudes pull work", now=_6, amplitudes=_6, pull=_6,
    ),
}  # fmt: skip
