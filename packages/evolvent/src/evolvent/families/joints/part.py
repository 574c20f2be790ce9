"""What holds beams, bodies and points together, couples their motion, or drives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal

from evolvent.assembly.builder import Builder
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.joints.part_coordinate import TYPES
from evolvent.families.joints.part_drive import DRIVEN, write_driven
from evolvent.families.joints.part_gear import write_gear
from evolvent.families.joints.part_guide import write_guide
from evolvent.families.joints.part_link import write_link
from evolvent.families.joints.part_pairs import SLIDING, write_pair
from evolvent.families.joints.part_release import ReleaseName
from evolvent.families.joints.part_synchronization import write_synchronization
from evolvent.kernels import axial
from evolvent.parts.applies import Applies, given, left_out, one_of, refuse_unfit
from evolvent.parts.base import CoordinateNames, Group, Part, PointReference
from evolvent.parts.law import PathDrive
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Meant

#: Types whose two points coincide, or slide on one another.
TOUCHING = ("spherical", "revolute", "universal", "clamp", *SLIDING)
#: Types that couple coordinates of joints.
_COUPLED = ("gear", "synchronization")
#: Types that are not points which coincide, slide or keep a length, and what writes them.
_OTHERS: dict[str, Callable[[Joint, Builder, str], None]] = {
    "link": write_link, "guide": write_guide, "gear": write_gear, "synchronization": write_synchronization,
    "involute": write_driven,
}  # fmt: skip


#: Words of other programs for types of joints.
_OTHER_WORDS = {
    **dict.fromkeys(("fixed", "rigid", "weld", "welded"), "clamp"), **dict.fromkeys(("hinge", "pin"), "revolute"),
    **dict.fromkeys(("ball", "ball-joint"), "spherical"), **dict.fromkeys(("slider", "sliding"), "prismatic"),
    "cardan": "universal", "plane": "in-plane", "rod": "link",
    **dict.fromkeys(("prescribed-motion", "driven"), "point-on-line"),
    **dict.fromkeys(("cord", "rope", "cable", "strut"), "distance"),
}  # fmt: skip


class Joint(Part):
    """A joint between two points of beams, bodies, point masses or the ground, in their positions at the start.

    Parameters
    ----------
    a, b : point
        Ends: "boom.root", "boom.tip" or "boom[5]" (a beam's node), "hub.left" (a point of a body), ("hub", (x, y, z)),
        "tether.tip" (the end of a thread, which has no rotation), a point mass, or a position on the ground. A body
        named alone, "hub", means its point where the other end is at the start; in a joint of type "distance",
        "pulley", "link" or "guide" its origin. Of a gear, two joints or spinning bodies.
    type : {"spherical", "revolute", "universal", "clamp", "prismatic", "cylindrical", "screw", \
"point-on-line", "in-plane", "distance", "pulley", "link", "guide", "gear", "synchronization", "involute"}
        spherical: the points coincide, all rotations are free. revolute: they coincide, with rotation about `axis`.
        universal: with rotations about `axis` of a and `axis_b` of b. clamp: without rotation. prismatic: b
        slides along `axis`, without rotation. cylindrical: b slides along `axis` and rotates about it. screw: as
        cylindrical, and b travels by `pitch` a turn against a, both of them bodies. point-on-line, in-plane: b moves on
        the line through a along `axis`, or in the plane through a normal to `axis`, all rotations are free. distance:
        the distance of the points is constant. pulley: a cord from a over the point `over` to b keeps its length; it
        slides there without friction, and pushes where it would have to. Either way a, b and `over` are apart.

        link: a massless link of fixed `length` between bodies, point masses or the ground; with a `drum` on a, a cord
        that winds onto it. guide: of the free body b the centre keeps its coordinate along `axis`, or, with `axis_b`,
        this axis of b stays perpendicular to `axis`; a is the ground. gear: q_a + ratio q_b stays constant, q the angle
        of a revolute, cylindrical or screw joint or the travel of a prismatic joint, of its b relative to its a, both
        of them bodies; or the angle of a spinning body. synchronization: closed cable loops couple the coordinates of
        `joints`, one loop between each two successive joints. involute: b is the end of a thread that a `drive` winds
        onto a circle about a, on the ground.
    axis : (3,) float
        Axis of the joint, inertial axes at the start; it is fixed to a. Of a link that of the drum, of an involute that
        of the circle; of a spinning body with a drive it may be left out.
    axis_b : (3,) float, optional
        Second axis of a universal joint or of a guide, fixed to b, perpendicular to `axis`; inertial axes at the start.
    pitch : float, m, optional
        Travel of a screw a turn, positive of a right-handed thread.
    over : point, optional
        Of a pulley, whose radius is neglected.
    ratio : float, 1, m/rad or rad/m, optional
        Parts of the cord of a pulley between `over` and b, as of a tackle; 1 if left out. Of a gear, which needs it:
        meshing wheels have the ratio r_b/r_a of their radii, above 0; a belt has a negative ratio. Between two angles a
        ratio of whole numbers (of teeth) up to 200, such as 20/35.
    length : float, m, optional
        Of a link without a drum; the distance at the start if left out. Of a cord, or of the thread of an involute, the
        whole length, wound part included, measured from `anchor`.
    drum : float, m
        Radius of the drum about `axis` through a (which must be on a body or the ground), or of the circle of an
        involute; 0 for a link without a drum.
    anchor : (3,) float
        Direction from the axis in which the cord or thread is fixed to the drum, inertial axes at the start.
    sense : {1, -1}
        The cord winds on in the positive or negative sense about `axis`.
    joints : list of str, optional
        Of a synchronization: two or more names, each of a `JointSpring`, or of a revolute or prismatic `Joint`; all of
        them angles, or all travels.
    ratios : list of float, optional
        One for each of `joints`, not 0: the loops keep the change of ratio times coordinate equal for all. 1 if left
        out.
    drive : a drive of `evolvent.parts`, rad or m, optional
        Prescribes a motion against the ground, a; its rate must not jump. revolute: the angle of b, a body with motion
        "spin" about `axis`. point-on-line: the travel of b, a node of a beam, rod or shell, a point of a body or
        a point mass, from where it starts. involute: the angle of the thread that is wound.
    hold : {"section", "all"}
        Which coordinates of a beam's node a clamp constrains: the position and the rotation of the section, or all
        coordinates of the node, including the lengths of the slope vectors.
    position : (3,) float, m, optional
        Position of the joint at the start, inertial axes, where both ends are bodies without a point.
    stiffness : float, N/m and N m, or N m/rad
        Above 0, a penalty in place of the constraint; of a gear referred to q_a. Of a synchronization that of each
        loop, for the stretch ratio_2 x_2 - ratio_1 x_1.
    rotational_stiffness : float, N m/rad, optional
        Of the penalties that hold directions; `stiffness` if left out.
    damping : float, N s/m and N m s, or N m s/rad
        Of the penalty, or of each loop.
    viscoelastic : mapping, optional
        Relaxation of the penalty of a cord ("distance", "pulley") by a Prony series.
    until : float, s, optional
        Time at which the joint is released; never if left out.
    released_by : str, optional
        `Event` that releases the joint, or spring of another joint whose latch does so when it locks; not with a drive.

    Notes
    -----
    A node of a cable has no twist: a joint constrains only its position and the direction of its axis. Nodes of two
    beams of 24-coordinate elements may be clamped at any angle; the moment acts on their sections. Constraints may be
    redundant, as in closed loops of hinges: the multipliers are then those of minimum norm (moments divided by the size
    of the system), and the run's message and statistics report the rank. Explicit methods refuse redundant constraints.
    A clamp does not constrain the lengths of the slope vectors, unless `hold` is "all": then shear, the strains of the
    section and the stretch of the axis vanish at the clamp.

    A link pushes as well as it pulls; the result `tension` shows which. Its cord is fixed to the drum in the plane
    across its axis through a, at the radius `drum` in the direction `anchor`. It is taut and takes the shortest way
    over the drum: a helix, which goes over into the straight free part with one slope. It does not slip round the drum,
    and is free of friction along it; the drum is as long as needed. A cord that has unwound swings about its anchor,
    and then winds on in the other sense, unless it is released. A guide pulls along `axis` at the centre of mass, or
    turns about axis_b x axis.

    For a cable of stiffness k (N/m, of both runs together) that synchronizes by pulleys of radii r_1 and r_2, the
    ratios are r_1/r and r_2/r and the stiffness is k r^2, with any r. A panel that opens by -180 deg while the panel
    before it opens by 90 deg has the ratio -1 if that panel has the ratio 2. The cables are without force at the start.
    """

    applies: ClassVar[Applies] = {
        "a": (one_of("type", *TOUCHING, "distance", "pulley", "link", "guide", "gear", "involute"),),
        "b": (one_of("type", *TOUCHING, "distance", "pulley", "link", "guide", "gear", "involute"),),
        "axis": (one_of("type", "revolute", "universal", *SLIDING, "link", "guide", "involute"),),
        "axis_b": (one_of("type", "universal", "guide"),),
        "pitch": (one_of("type", "screw"),),
        "over": (one_of("type", "pulley"),),
        "ratio": (one_of("type", "pulley", "gear"),),
        "length": (one_of("type", "link", "involute"),),
        "drum": (one_of("type", "link", "involute"),),
        "anchor": (one_of("type", "link", "involute"), given("drum")),
        "sense": (one_of("type", "link"), given("drum")),
        "joints": (one_of("type", "synchronization"),),
        "ratios": (one_of("type", "synchronization"),),
        "drive": (one_of("type", *DRIVEN),),
        "hold": (one_of("type", "clamp"),),
        "position": (one_of("type", *TOUCHING), left_out("drive")),
        "stiffness": (one_of("type", *TOUCHING, "distance", "pulley", *_COUPLED), left_out("drive")),
        "rotational_stiffness": (one_of("type", *TOUCHING), left_out("drive"), given("stiffness")),
        "viscoelastic": (one_of("type", "distance", "pulley"), left_out("drive"), given("stiffness")),
        "damping": (one_of("type", *TOUCHING, "distance", "pulley", *_COUPLED), left_out("drive")),
        "until": (one_of("type", *TOUCHING, "distance", "pulley", "link", "gear", "involute"),),
        "released_by": (one_of("type", *TOUCHING, "distance", "pulley", "link", "gear", "involute"),),
    }
    needed: ClassVar[tuple[str, ...]] = ("a", "b")
    always_allowed: ClassVar[tuple[str, ...]] = ("axis",)  # from which a clamp takes its first direction
    kind: Literal["joint"] = "joint"
    group = Group.JOINTS
    symbol = "joint"
    a: PointReference | None = None
    b: PointReference | None = None
    type: Annotated[
        Literal[
            "spherical", "revolute", "universal", "clamp", "prismatic", "cylindrical", "screw", "point-on-line",
            "in-plane", "distance", "pulley", "link", "guide", "gear", "synchronization", "involute",
        ],
        Meant(_OTHER_WORDS),
    ] = "spherical"  # fmt: skip
    axis: units.Direction = (0.0, 0.0, 1.0)
    axis_b: units.Direction | None = None
    pitch: units.Coordinate | None = None
    over: PointReference | None = None
    ratio: units.Number | None = None
    length: units.Length | None = None
    drum: units.LengthOrZero = 0.0
    anchor: units.Direction = (1.0, 0.0, 0.0)
    sense: Literal[1, -1] = 1
    joints: CoordinateNames | None = None
    ratios: units.Numbers | None = None
    drive: PathDrive | None = None
    hold: Literal["section", "all"] = "section"
    position: units.Position | None = None
    stiffness: units.CoordinateStiffnessOrZero = 0.0
    rotational_stiffness: units.RotationalStiffnessOrZero | None = None
    damping: units.CoordinateDampingOrZero = 0.0
    viscoelastic: Viscoelastic | None = None
    until: units.Duration | None = None
    released_by: ReleaseName | None = None

    @classmethod
    def acts_on_travel(cls, content: Mapping[str, Any], travels: Callable[[Any], bool]) -> bool:
        """Whether stiffness and damping are those of a travel: of all types but those that couple angles."""
        joints = content.get("joints") or [content.get("a")]
        return content.get("type") not in _COUPLED or travels(joints[0] if isinstance(joints, list | tuple) else None)

    @classmethod
    def has_travel(cls, content: Mapping[str, Any], travels: Callable[[Any], bool]) -> bool:
        """Whether its coordinate is a travel."""
        return content.get("type") == TYPES[axial.TRAVEL][0]

    def _check(self, name: str) -> None:
        """Refuse keys that the type does not have, ends that are missing, and units of the other kind of stiffness."""
        refuse_unfit(name, self)
        for key, wanted in (("stiffness", "N/m"), ("damping", "N s/m")):
            value = getattr(self, key)
            if self.type not in _COUPLED and isinstance(value, units.Measured) and value.unit != wanted:
                raise InputError(
                    f"{name}.{key} is {float(value):g} {value.unit}; of a joint of type {self.type!r} it is in {wanted}"
                )

    def write(self, builder: Builder, name: str) -> None:
        """Write the rows of the family `joints`, and those of links, guides, gears and synchronizations."""
        self._check(name)
        write = write_pair if self.drive is None else write_driven
        _OTHERS.get(self.type, write)(self, builder, name)
