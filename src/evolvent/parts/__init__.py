"""What a user composes: each part is a frozen section of keys that writes itself into the model's arrays."""

from evolvent.parts.beam import Beam
from evolvent.parts.beam_load import FieldTorque, LineLoad, PointLoad
from evolvent.parts.custom_force import CustomForce
from evolvent.parts.cylinder_contact import CylinderContact
from evolvent.parts.event import Event
from evolvent.parts.feed import ConstantFeed, FreeSpool, LawFeed, RampFeed, TableFeed
from evolvent.parts.guide import Guide
from evolvent.parts.joint import Joint, PrescribedMotion, PrescribedRotation
from evolvent.parts.link import Link
from evolvent.parts.load import Force, LawLoad, RadiationPressure, Torque, UniformLoad
from evolvent.parts.point import Point
from evolvent.parts.reel import Reel
from evolvent.parts.rigid_body import RigidBody
from evolvent.parts.rotational_spring import RotationalSpring
from evolvent.parts.self_contact import SelfContact
from evolvent.parts.shapes import Box, Cylinder, Sphere
from evolvent.parts.spring import Spring
from evolvent.parts.thread import Thread

__all__ = [
    "Beam",
    "Box",
    "ConstantFeed",
    "CustomForce",
    "Cylinder",
    "CylinderContact",
    "Event",
    "FieldTorque",
    "Force",
    "FreeSpool",
    "Guide",
    "Joint",
    "LawFeed",
    "LawLoad",
    "LineLoad",
    "Link",
    "Point",
    "PointLoad",
    "PrescribedMotion",
    "PrescribedRotation",
    "RadiationPressure",
    "RampFeed",
    "Reel",
    "RigidBody",
    "RotationalSpring",
    "SelfContact",
    "Sphere",
    "Spring",
    "TableFeed",
    "Thread",
    "Torque",
    "UniformLoad",
]
