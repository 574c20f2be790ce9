"""Which fields of records are results."""

from __future__ import annotations

#: Fields of records that are results: name of the variable, unit and words. Those of a coordinate are of an angle.
RESULTS: dict[str, dict[str, tuple[str, str, str]]] = {
    "springs": {
        "distance": ("length", "m", "length"),
        "extension": ("extension", "m", "length minus the natural length"),
        "rate": ("extension_rate", "m s-1", "rate of the extension"),
        "tension": ("force", "N", "tension, elastic and damping part, positive where the spring pulls"),
        "lateral": (
            "lateral_force",
            "N",
            "force on end b across the axis of the mount, elastic and damping part, inertial axes",
        ),
        "stored": ("energy_elastic", "J", "elastic energy"),
    },
    "threads": {
        "phi": ("angle", "rad", "angle of the spool, positive pays out"),
        "turning": ("rate", "rad s-1", "rate of the spool"),
        "torque": ("torque", "N m", "torque of the thread's tension on the spool"),
        "reach": ("radius", "m", "radius at which the tape leaves the spool"),
        "motor": ("motor_torque", "N m", "torque of the motor on the spool, positive pays out"),
        "friction": ("friction_torque", "N m", "torque of friction and brake on the spool"),
        "out": ("deployed_length", "m", "length of thread paid out"),
        "hub": ("hub_tension", "N", "tension at the spool"),
        "hub_pull": ("hub_force", "N", "pull of the thread where it leaves the spool, inertial axes"),
        "end_pull": ("end_force", "N", "force on the end part, inertial axes"),
        "Q": ("hub_position", "m", "where the thread leaves the spool, inertial axes"),
        "kinetic": (
            "energy_kinetic",
            "J",
            "kinetic energy of the released thread, of wound thread that is carried and of a free spool{copies}",
        ),
        "elastic": ("energy_elastic", "J", "elastic energy of the segments{copies}"),
        "linear": (
            "momentum",
            "kg m s-1",
            "linear momentum of released thread, and of wound thread that is carried{copies}, inertial axes",
        ),
        "angular": (
            "angular_momentum",
            "kg m2 s-1",
            "angular momentum about the inertial origin of released thread, and of wound thread that is carried"
            "{copies}",
        ),
    },
    "nodes": {
        "x": ("position", "m", "positions of the nodes from the tip, wound ones on their spool, inertial axes"),
        "v": ("velocity", "m s-1", "velocities of the nodes, inertial axes"),
        "tension": ("tension", "N", "tension of the segment inwards of each node, NaN while it is wound"),
    },
    "hinges": {
        "angle": ("angle", "rad", "angle of the second side as seen from the first, any number of turns"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "torque": ("torque", "N m", "torque of the joint, sum of {parts}, positive against the angle"),
        "stored": ("energy_elastic", "J", "elastic energy of spring, stops and latch"),
        "lost": ("dissipation", "W", "power dissipated by the dampers of hinge and latch"),
        "rubs": ("friction_torque", "N m", "torque of friction, part of that of the joint"),
        "latch_torque": ("latch_torque", "N m", "torque in the latch, part of that of the joint"),
        "u": ("ends", "m", "point of travel 0 on the first part, and the second end, inertial axes"),
    },
    "motors": {
        "coordinate": ("angle", "rad", "angle that the motor drives"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "torque": ("torque", "N m", "torque of the motor, positive where it increases the angle"),
        "power": ("power", "W", "power of the motor"),
        "on": ("on", "1", "1 until the motor is switched off, then 0"),
        "reference": ("reference", "rad", "reference angle of the motor"),
    },
    "synchronizations": {
        "stretch": ("difference", "rad", "difference of the angles that each loop couples, times their ratios"),
        "torque": ("torque", "N m", "torque of each loop, at a ratio of 1"),
        "energy": ("energy_elastic", "J", "elastic energy of the loops"),
        "lost": ("dissipation", "W", "power dissipated by the loops"),
    },
    "joints": {
        "force": ("force", "N", "force of the joint on {on}, inertial axes"),
        "moment": ("moment", "N m", "moment of the joint on {on} about the joint's position, inertial axes"),
        "u": ("ends", "m", "ends a and b, inertial axes"),
        "measured": ("length", "m", "distance of the two ends"),
        "gap": ("gap", "rad", "error of the coordinate of a"),
        "stored": ("energy_elastic", "J", "elastic energy of the penalties that hold the joint"),
    },
    # of loads at markers where the factor that times and profiles make is 1, of those on threads as they act
    "loads": {
        "vector": ("force", "N", "force or torque that acts, inertial axes"),
        "rate": ("power", "W", "power of the load"),
        "middle": ("position", "m", "middle of the released thread, inertial axes"),
    },
    "fields": {
        "force": ("force", "N", "resultant on all masses, inertial axes"),
        "power": ("power", "W", "power of the field"),
    },
    "wheels": {
        "angle": ("angle", "rad", "angle of the wheel relative to its body"),
        "rate": ("rate", "rad s-1", "rate of the wheel relative to its body"),
        "motor": ("torque", "N m", "torque of the motor on the wheel"),
        "rubs": ("friction_torque", "N m", "torque of friction on the wheel"),
        "spin": ("wheel_momentum", "kg m2 s-1", "angular momentum relative to the body, about the axis"),
        "momentum": ("angular_momentum", "kg m2 s-1", "angular momentum relative to the body, inertial axes"),
        "kinetic": ("energy_kinetic", "J", "kinetic energy beyond that of the wheel fixed in its body"),
    },
    "thrusters": {
        "push": ("thrust", "N", "force of the thruster"),
        "impulse": ("impulse", "N s", "integral of the thrust since the start"),
        "place": ("position", "m", "position of the thruster, inertial axes"),
        "vector": ("force", "N", "force on the body, inertial axes"),
    },
    "controllers": {
        "error": ("error", "rad", "rotation vector from the target to the body, body axes"),
        "off": ("error_angle", "rad", "angle between the target and the body"),
        "slip": ("rate_error", "rad s-1", "angular velocity relative to the target, body axes"),
        "torque": ("torque", "N m", "commanded torque, body axes"),
    },
    "beam_loads": {
        "vector": ("force", "N", "force, resultant of a line load, or torque that acts, inertial axes"),
        "rate": ("power", "W", "power of the load"),
    },
    "contact_points": {
        "force": ("point_force", "N", "normal force of each contact point, positive where it pushes"),
        "apart": (
            "gap",
            "m",
            "distance of each contact point, negative where it overlaps, NaN where it is too far away or past the edge",
        ),
        "x": ("point_position", "m", "position of each contact point, inertial axes"),
        "n1": ("point_normal", "1", "normal of the surface at each contact point, inertial axes"),
    },
    "rod_elements": {
        "strain": ("strain", "1", "strain of the axis"),
        "shear_strain_y": ("shear_strain_y", "1", "shear strain along y"),
        "shear_strain_z": ("shear_strain_z", "1", "shear strain along z"),
        "twist": ("twist", "m-1", "change of twist per length"),
        "curvature_y": ("curvature_y", "m-1", "change of curvature about y"),
        "curvature_z": ("curvature_z", "m-1", "change of curvature about z"),
        "axial_force": ("axial_force", "N", "force along x, positive in tension"),
        "shear_force_y": ("shear_force_y", "N", "shear force along y in the section's axes"),
        "shear_force_z": ("shear_force_z", "N", "shear force along z in the section's axes"),
        "torsional_moment": ("torsional_moment", "N m", "moment about x in the section's axes"),
        "bending_moment_y": ("bending_moment_y", "N m", "moment about y in the section's axes"),
        "bending_moment_z": ("bending_moment_z", "N m", "moment about z in the section's axes"),
        "energy_density": ("energy_density", "J m-1", "strain energy per length"),
        "stored": ("energy_elastic", "J", "strain energy"),
        "bent": ("energy_bending", "J", "strain energy of bending and torsion"),
    },
}
