"""Values with units: what a case file writes, kept as SI floats; the kinds of values that keys hold."""

from __future__ import annotations

from typing import Annotated, Any

from evolvent_base.units.heads import head_and_unit as head_and_unit, is_unit as is_unit
from evolvent_base.units.orientation import Orientation as Orientation, Turned as Turned
from evolvent_base.units.parsing import (
    COMMON as COMMON,
    LARGEST as LARGEST,
    OF_CONTACT as OF_CONTACT,
    UNIT_LENGTH as UNIT_LENGTH,
    Measured as Measured,
    UnitError as UnitError,
    base_exponents as base_exponents,
    is_list as is_list,
    known as known,
    split as split,
    unit_text as unit_text,
)
from evolvent_base.units.quantities import (
    Blocks as Blocks,
    Either as Either,
    OneOrMore as OneOrMore,
    Quantity as Quantity,
    Tensor as Tensor,
    Vector as Vector,
    Whole as Whole,
    shared_unit as shared_unit,
    unit_of as unit_of,
    units_as_written as units_as_written,
)
from evolvent_base.units.written import factor as factor, file_unit as file_unit, parse as parse

_LENGTH: dict[str, Any] = {"what": "a length", "unit": "m", "example": "5 m"}
_TIME: dict[str, Any] = {"what": "a time", "unit": "s", "example": "2.5 s"}
_MASS: dict[str, Any] = {"what": "a mass", "unit": "kg", "example": "0.5 g"}

Length = Annotated[float, Quantity(**_LENGTH, above=0.0)]
LengthOrZero = Annotated[float, Quantity(**_LENGTH, least=0.0)]
Time = Annotated[float, Quantity(**_TIME)]
Duration = Annotated[float, Quantity(**_TIME, above=0.0)]
DurationOrZero = Annotated[float, Quantity(**_TIME, least=0.0)]
DurationOrAuto = Annotated[float | str, Quantity(**_TIME, above=0.0, auto=True)]
Mass = Annotated[float, Quantity(**_MASS, above=0.0)]
MassOrZero = Annotated[float, Quantity(**_MASS, least=0.0)]
_INERTIA = Quantity(what="a moment of inertia", unit="kg m^2", example="0.004 kg m^2", above=0.0)
_ANGULAR_RATE = Quantity(what="an angular rate", unit="rad/s", example="6 rad/s")
Inertia = Annotated[float, _INERTIA]
Inertias = Annotated[float | tuple[float, ...], OneOrMore(quantity=_INERTIA, each="the three principal moments")]
Angle = Annotated[float, Quantity(what="an angle", unit="rad", example="10 deg")]
PositiveAngle = Annotated[float, Quantity(what="an angle", unit="rad", example="10 deg", above=0.0)]
AngularRate = Annotated[float, _ANGULAR_RATE]
AngularRates = Annotated[float | tuple[float, ...], OneOrMore(quantity=_ANGULAR_RATE, each="one per blade")]
PositiveRate = Annotated[float, Quantity(what="an angular velocity", unit="rad/s", example="1.1e-3 rad/s", above=0.0)]
GravitationalParameter = Annotated[
    float, Quantity(what="a gravitational parameter", unit="m^3/s^2", example="3.986e14 m^3/s^2", above=0.0)
]
LineDensity = Annotated[float, Quantity(what="a mass per length", unit="kg/m", example="0.735 g/m", above=0.0)]
AreaDensity = Annotated[float, Quantity(what="a mass per area", unit="kg/m^2", example="0.3 kg/m^2", above=0.0)]
Stiffness = Annotated[float, Quantity(what="a stiffness", unit="N/m", example="1e4 N/m", above=0.0)]
ForceDensity = Annotated[float, Quantity(what="a force density", unit="N/m", example="10 N/m", above=0.0)]
DampingOrZero = Annotated[float, Quantity(what="a damping coefficient", unit="N s/m", example="1e-3 N s/m", least=0.0)]
PressureOrZero = Annotated[float, Quantity(what="a pressure", unit="Pa", example="4.56e-6 Pa", least=0.0)]
_SPEED = Quantity(what="a velocity", unit="m/s", example="0.1 m/s")
_FORCE = Quantity(what="a force", unit="N", example="0.1 N")
_TORQUE = Quantity(what="a torque", unit="N m", example="0.2 N m")
_PLAIN = Quantity(what="a plain number", unit="", example="0.5")
_FREQUENCY = Quantity(what="a frequency", unit="Hz", example="0.25 Hz", above=0.0)
Force = Annotated[float, _FORCE]
Torque = Annotated[float, _TORQUE]
PositiveForce = Annotated[float, Quantity(what="a force", unit="N", example="20 mN", above=0.0)]
PositiveTorque = Annotated[float, Quantity(what="a torque", unit="N m", example="0.2 mN m", above=0.0)]
_LINE_FORCE = Quantity(what="a force per length", unit="N/m", example="0.1 N/m")
_PRESSURE = Quantity(what="a force per area", unit="Pa", example="5 Pa")
_LINE_TORQUE = Quantity(what="a torque per length", unit="N", example="0.1 N m/m")
LineForce = Annotated[float, _LINE_FORCE]
LineTorque = Annotated[float, _LINE_TORQUE]
AreaForce = Annotated[float, _PRESSURE]
ForceOrTorque = Annotated[float, Either((_FORCE, _TORQUE, _LINE_FORCE, _PRESSURE))]
Frequency = Annotated[float, _FREQUENCY]
Speed = Annotated[float, _SPEED]
PositiveSpeed = Annotated[float, Quantity(what="a speed", unit="m/s", example="0.1 m/s", above=0.0)]
_ANGLE = Quantity(what="an angle", unit="rad", example="10 deg")
AngleOrLength = Annotated[float, Either((_ANGLE, Quantity(**_LENGTH)))]
AngularRateOrSpeed = Annotated[float, Either((_ANGULAR_RATE, _SPEED))]
Triple = tuple[float, float, float]
Position = Annotated[Triple, Vector(quantity=Quantity(**_LENGTH))]
Velocity = Annotated[Triple, Vector(quantity=_SPEED)]
AngularVelocity = Annotated[Triple, Vector(quantity=_ANGULAR_RATE)]
Acceleration = Annotated[Triple, Vector(quantity=Quantity(what="an acceleration", unit="m/s^2", example="9.81 m/s^2"))]
ForceVector = Annotated[Triple, Vector(quantity=_FORCE)]
TorqueOrZero = Annotated[float, Quantity(what="a torque", unit="N m", example="0.2 N m", least=0.0)]
TorqueVector = Annotated[Triple, Vector(quantity=_TORQUE)]
LineTorqueVector = Annotated[Triple, Vector(quantity=_LINE_TORQUE)]
AnyTorqueVector = Annotated[Triple, Vector(quantity=Either((_TORQUE, _LINE_TORQUE)))]
LineForceVector = Annotated[Triple, Vector(quantity=_LINE_FORCE)]
AreaForceVector = Annotated[Triple, Vector(quantity=_PRESSURE)]
AnyForceVector = Annotated[Triple, Vector(quantity=Either((_FORCE, _LINE_FORCE, _PRESSURE)))]
_IMPULSE = Quantity(what="an impulse", unit="N s", example="-500 N s")
_PRODUCT = Quantity(what="a product of inertia", unit="kg m^2", example="20 kg m^2")
Coordinate = Annotated[float, Quantity(**_LENGTH)]
ImpulseVector = Annotated[Triple, Vector(quantity=_IMPULSE)]
RotationVector = Annotated[Triple, Vector(quantity=_ANGLE)]
Moments = Annotated[Triple, Vector(quantity=_INERTIA)]
Products = Annotated[Triple, Vector(quantity=_PRODUCT)]
Curvatures = Annotated[Triple, Vector(quantity=Quantity(what="a curvature", unit="1/m", example="0.1 1/m"))]
MagneticMoment = Annotated[Triple, Vector(quantity=Quantity(what="a magnetic moment", unit="A m^2", example="2 A m^2"))]
MagneticField = Annotated[Triple, Vector(quantity=Quantity(what="a magnetic field", unit="T", example="30 uT"))]
Times = Annotated[tuple[float, ...], Vector(quantity=Quantity(**_TIME), size=0)]
Direction = Annotated[Triple, Vector(quantity=_PLAIN, direction=True)]
Quaternion = Annotated[
    tuple[float, float, float, float], Orientation(quantity=_PLAIN, size=4, direction=True, normalised=True)
]
Numbers = Annotated[tuple[float, ...], Vector(quantity=_PLAIN, size=0)]
StiffnessOrZero = Annotated[float, Quantity(what="a stiffness", unit="N/m", example="1e4 N/m", least=0.0)]
Number = Annotated[float, Quantity(what="a plain number", unit="", example="0.5")]
Fraction = Annotated[float, Quantity(what="a plain number", unit="", example="0.9", least=0.0, most=1.0)]
PositiveFraction = Annotated[float, Quantity(what="a plain number", unit="", example="0.5", above=0.0, most=1.0)]
Tolerance = Annotated[float, Quantity(what="a plain number", unit="", example="1e-8", above=0.0, most=0.1)]
Modulus = Annotated[float, Quantity(what="a modulus", unit="Pa", example="70 GPa", above=0.0)]
Strength = Annotated[float, Quantity(what="a strength", unit="Pa", example="270 MPa", above=0.0)]
PoissonRatio = Annotated[float, Quantity(what="a plain number", unit="", example="0.3", above=-1.0, most=0.5)]
Density = Annotated[float, Quantity(what="a density", unit="kg/m^3", example="1600 kg/m^3", above=0.0)]
Area = Annotated[float, Quantity(what="an area", unit="m^2", example="2 mm^2", above=0.0)]
ProductOfArea = Annotated[float, Quantity(what="a product of area", unit="m^4", example="-4 mm^4")]
ThermalExpansion = Annotated[float, Quantity(what="a thermal expansion", unit="1/K", example="24e-6 1/K")]
Temperature = Annotated[float, Quantity(what="a change of temperature", unit="K", example="50 K", difference=True)]
AbsoluteTemperature = Annotated[float, Quantity(what="an absolute temperature", unit="K", example="20 degC", above=0.0)]
# what is below or above is a number without its unit
MaterialTemperature = Annotated[
    float, Quantity(what="an absolute temperature", unit="K", example="20 degC", least=100.0, most=1000.0)
]
EnergyPerMole = Annotated[
    float, Quantity(what="an energy per amount of substance", unit="J/mol", example="150 kJ/mol", above=0.0)
]
Conductivity = Annotated[float, Quantity(what="a heat conductivity", unit="W/(m K)", example="0.8 W/(m K)", above=0.0)]
SpecificHeat = Annotated[float, Quantity(what="a specific heat", unit="J/(kg K)", example="900 J/(kg K)", above=0.0)]
HeatFlux = Annotated[float, Quantity(what="a flux of heat", unit="W/m^2", example="1361 W/m^2", least=0.0)]
TemperatureGradient = Annotated[float, Quantity(what="a gradient of temperature", unit="K/m", example="200 K/m")]
LineInertia = Annotated[float, Quantity(what="an inertia per length", unit="kg m", example="2e-5 kg m", above=0.0)]
LineProduct = Annotated[float, Quantity(what="an inertia per length", unit="kg m", example="2e-5 kg m")]
Gradings = Annotated[
    float | tuple[float, ...],
    OneOrMore(
        quantity=Quantity(what="a plain number", unit="", example="3", above=0.0), each="the length of each element"
    ),
]
Pair = Annotated[tuple[float, float], Vector(quantity=Quantity(**_LENGTH), size=2)]
Curvature = Annotated[Triple, Vector(quantity=Quantity(what="a curvature", unit="1/m", example="0.5 1/m"))]
_COUPLING = Quantity(what="a coupling stiffness", unit="N m", example="-522 N m")
SectionStiffness = Annotated[
    tuple[tuple[float, ...], ...],
    Blocks(
        what="a stiffness matrix",
        quantities=(
            (Quantity(what="a stiffness", unit="N", example="3.7e6 N"), _COUPLING),
            (_COUPLING, Quantity(what="a stiffness", unit="N m^2", example="0.7 N m^2")),
        ),
    ),
]
_MEMBRANE, _BETWEEN, _BENDING = (
    Quantity(what="a stiffness per length", unit=unit, example=f"1e3 {unit}") for unit in ("N/m", "N", "N m")
)
ShellStiffness = Annotated[
    tuple[tuple[float, ...], ...],
    Blocks(
        what="a stiffness matrix",
        quantities=(
            (_MEMBRANE, _BETWEEN, _MEMBRANE), (_BETWEEN, _BENDING, _BETWEEN), (_MEMBRANE, _BETWEEN, _MEMBRANE)
        ),
        widths=(3, 3, 2),
    ),
]  # fmt: skip
SecondMoment = Annotated[float, Quantity(what="a second moment of area", unit="m^4", example="40 mm^4", above=0.0)]
InertiaTensor = Annotated[
    float | Triple | tuple[Triple, Triple, Triple],
    Tensor(quantity=Quantity(what="a moment of inertia", unit="kg m^2", example="0.004 kg m^2")),
]
_TURN_STIFFNESS: dict[str, Any] = {"what": "a rotational stiffness", "unit": "N m/rad", "example": "0.5 N m/rad"}
_TURN_DAMPING: dict[str, Any] = {"what": "a rotational damping", "unit": "N m s/rad", "example": "0.01 N m s/rad"}
RotationalStiffnessOrZero = Annotated[float, Quantity(**_TURN_STIFFNESS, least=0.0)]
RotationalDampingOrZero = Annotated[float, Quantity(**_TURN_DAMPING, least=0.0)]
FoldStiffnessOrZero = Annotated[
    float, Quantity(what="a rotational stiffness per length", unit="N/rad", example="0.5 N/rad", least=0.0)
]
FoldDampingOrZero = Annotated[
    float, Quantity(what="a rotational damping per length", unit="N s/rad", example="0.01 N s/rad", least=0.0)
]
ForceOrZero = Annotated[float, Quantity(what="a force", unit="N", example="0.1 N", least=0.0)]
TorqueOrForce = Annotated[float, Either((_TORQUE, _FORCE))]
TorqueConstant = Annotated[float, Quantity(what="a torque constant", unit="N m/A", example="0.05 N m/A", above=0.0)]
Resistance = Annotated[float, Quantity(what="an electric resistance", unit="ohm", example="1.2 ohm", above=0.0)]
Voltage = Annotated[float, Quantity(what="a voltage", unit="V", example="28 V")]
Current = Annotated[float, Quantity(what="an electric current", unit="A", example="0.5 A")]
TorqueOrForceOrZero = Annotated[
    float,
    Either(
        (
            Quantity(what="a torque", unit="N m", example="0.2 N m", least=0.0),
            Quantity(what="a force", unit="N", example="0.1 N", least=0.0),
        )
    ),
]
AngleOrTravel = AngleOrLength
PositiveAngleOrTravel = Annotated[
    float,
    Either((Quantity(what="an angle", unit="rad", example="1 deg", above=0.0), Quantity(**_LENGTH, above=0.0))),
]
CoordinateStiffness = Annotated[
    float,
    Either(
        (Quantity(**_TURN_STIFFNESS, above=0.0), Quantity(what="a stiffness", unit="N/m", example="1e4 N/m", above=0.0))
    ),
]
TorqueOrForceLimit = Annotated[
    float,
    Either(
        (
            Quantity(what="a torque", unit="N m", example="0.2 N m", above=0.0),
            Quantity(what="a force", unit="N", example="0.1 N", above=0.0),
        )
    ),
]
RateLimit = Annotated[
    float,
    Either(
        (
            Quantity(what="an angular rate", unit="rad/s", example="10 rpm", above=0.0),
            Quantity(what="a speed", unit="m/s", example="0.1 m/s", above=0.0),
        )
    ),
]
CoordinateStiffnessOrZero = Annotated[
    float,
    Either(
        (Quantity(**_TURN_STIFFNESS, least=0.0), Quantity(what="a stiffness", unit="N/m", example="1e4 N/m", least=0.0))
    ),
]
CoordinateDampingOrZero = Annotated[
    float,
    Either(
        (
            Quantity(**_TURN_DAMPING, least=0.0),
            Quantity(what="a damping coefficient", unit="N s/m", example="1e-3 N s/m", least=0.0),
        )
    ),
]
Gains = Annotated[
    float | tuple[float, ...],
    OneOrMore(quantity=Quantity(**_TURN_STIFFNESS, least=0.0), each="the three axes"),
]
RateGains = Annotated[
    float | tuple[float, ...], OneOrMore(quantity=Quantity(**_TURN_DAMPING, least=0.0), each="the three axes")
]
RateOrZero = Annotated[float, Quantity(what="an inverse time", unit="1/s", example="0.1 1/s", least=0.0)]
ContactStiffness = Annotated[
    float, Quantity(what="a contact stiffness", unit="N/m^n", example="1e6 N/m^1.5", above=0.0)
]
ContactDampingOrZero = Annotated[float, Quantity(what="a contact damping", unit="s/m", example="0.1 s/m", least=0.0)]
Exponent = Annotated[float, Quantity(what="a plain number", unit="", example="1.5", least=1.0)]
NumberOrZero = Annotated[float, Quantity(what="a plain number", unit="", example="0.3", least=0.0)]
PositiveNumber = Annotated[float, Quantity(what="a plain number", unit="", example="0.5", above=0.0)]
Parameters = Annotated[tuple[float, ...], Vector(quantity=_PLAIN, size=0, empty=True)]
