"""What a user composes: each part is a frozen section of keys that writes itself into the model's arrays."""

from evolvent.parts.attitude import AttitudeController, ReactionWheel, Thruster
from evolvent.parts.beam import Beam
from evolvent.parts.beam_load import DistributedTorque, LineLoad, SlopeLoad
from evolvent.parts.bearing import Bearing
from evolvent.parts.body_contact import BodyContact
from evolvent.parts.curve import Parabola
from evolvent.parts.custom_force import CustomForce
from evolvent.parts.drive import ConstantDrive, ExpressionDrive, FreeSpool, LawDrive, RampDrive, TableDrive
from evolvent.parts.event import Event
from evolvent.parts.feedback import FeedbackDrive, Limits, Sensor
from evolvent.parts.field import AccelerationField, Orbit
from evolvent.parts.gear import Gear
from evolvent.parts.guide import Guide
from evolvent.parts.joint import Joint, PrescribedMotion, PrescribedRotation
from evolvent.parts.link import Link
from evolvent.parts.load import Force, LawLoad, PanelRadiation, RadiationPressure, Torque, UniformLoad
from evolvent.parts.magnetic import MagneticTorque
from evolvent.parts.motor import Motor
from evolvent.parts.point import Point
from evolvent.parts.profile import Profile
from evolvent.parts.reduced_body import ReducedBody
from evolvent.parts.reel import Reel
from evolvent.parts.resistance import Adhesion, Harness, TapeSpringHinge
from evolvent.parts.rigid_body import RigidBody
from evolvent.parts.rod import Rod
from evolvent.parts.rotational_spring import RotationalSpring
from evolvent.parts.self_contact import SelfContact
from evolvent.parts.shapes import Box, Capsule, Cylinder, Plane, Sphere
from evolvent.parts.spring import Spring
from evolvent.parts.surface_contact import CapsuleContact, CylinderContact, PlaneContact, SphereContact
from evolvent.parts.synchronization import Synchronization
from evolvent.parts.thermal_load import ThermalLoad
from evolvent.parts.thread import Thread
from evolvent.parts.translational_spring import TranslationalSpring

__all__ = [
    "AccelerationField",
    "Adhesion",
    "AttitudeController",
    "Beam",
    "Bearing",
    "BodyContact",
    "Box",
    "Capsule",
    "CapsuleContact",
    "ConstantDrive",
    "CustomForce",
    "Cylinder",
    "CylinderContact",
    "DistributedTorque",
    "Event",
    "ExpressionDrive",
    "FeedbackDrive",
    "Force",
    "FreeSpool",
    "Gear",
    "Guide",
    "Harness",
    "Joint",
    "LawDrive",
    "LawLoad",
    "Limits",
    "LineLoad",
    "Link",
    "MagneticTorque",
    "Motor",
    "Orbit",
    "PanelRadiation",
    "Parabola",
    "Plane",
    "PlaneContact",
    "Point",
    "PrescribedMotion",
    "PrescribedRotation",
    "Profile",
    "RadiationPressure",
    "RampDrive",
    "ReactionWheel",
    "ReducedBody",
    "Reel",
    "RigidBody",
    "Rod",
    "RotationalSpring",
    "SelfContact",
    "Sensor",
    "SlopeLoad",
    "Sphere",
    "SphereContact",
    "Spring",
    "Synchronization",
    "TableDrive",
    "TapeSpringHinge",
    "ThermalLoad",
    "Thread",
    "Thruster",
    "Torque",
    "TranslationalSpring",
    "UniformLoad",
]
