"""What a user composes: each part is a frozen specification that writes itself into the model's arrays."""

from evolvent.parts.beam import Beam
from evolvent.parts.beam_load import DistributedTorque, LineLoad, SlopeLoad
from evolvent.parts.cylinder import Cylinder
from evolvent.parts.drive import ConstantDrive, ExpressionDrive, FreeSpool, LawDrive, RampDrive, TableDrive
from evolvent.parts.event import Event
from evolvent.parts.guide import Guide
from evolvent.parts.joint import Carry, Hinge, Joint, Turn
from evolvent.parts.layers import Layers
from evolvent.parts.link import Link
from evolvent.parts.load import Force, LawLoad, RadiationPressure, Torque, UniformLoad
from evolvent.parts.point import Point
from evolvent.parts.profile import Profile
from evolvent.parts.reel import Reel
from evolvent.parts.rigid_body import RigidBody
from evolvent.parts.spring import Spring
from evolvent.parts.thread import Thread

__all__ = [
    "Beam",
    "Carry",
    "ConstantDrive",
    "Cylinder",
    "DistributedTorque",
    "Event",
    "ExpressionDrive",
    "Force",
    "FreeSpool",
    "Guide",
    "Hinge",
    "Joint",
    "LawDrive",
    "LawLoad",
    "Layers",
    "LineLoad",
    "Link",
    "Point",
    "Profile",
    "RadiationPressure",
    "RampDrive",
    "Reel",
    "RigidBody",
    "SlopeLoad",
    "Spring",
    "TableDrive",
    "Thread",
    "Torque",
    "Turn",
    "UniformLoad",
]
