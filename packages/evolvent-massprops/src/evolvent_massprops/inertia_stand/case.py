"""What a user writes about an inertia stand."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section
from evolvent_massprops.excitation_keys import Excitation
from evolvent_massprops.inertia.stand import inertia_defect
from evolvent_massprops.mounting_keys import Air


def _each(what: str, unit: str, example: str, each: str = "one per spring", **limits: Any) -> units.OneOrMore:
    """One value for all, or a list."""
    return units.OneOrMore(quantity=units.Quantity(what=what, unit=unit, example=example, **limits), each=each)


Stiffnesses = Annotated[float | tuple[float, ...], _each("a stiffness", "N/m", "740 kN/m", above=0.0)]
Laterals = Annotated[float | tuple[float, ...], _each("a stiffness", "N/m", "370 kN/m", least=0.0)]
Dampings = Annotated[float | tuple[float, ...], _each("a damping coefficient", "N s/m", "100 N s/m", least=0.0)]
Lengths = Annotated[float | tuple[float, ...], _each("a length", "m", "0.5 m", above=0.0)]
Noises = Annotated[float | tuple[float, ...], _each("a length", "m", "0.1 mm", "one per sensor", least=0.0)]
Gravity = Annotated[float, units.Quantity(what="an acceleration", unit="m/s^2", example="9.80665 m/s^2", above=0.0)]


class Body(Section):
    """The body whose inertia is identified; axes x and z horizontal, y up."""

    mass: units.Mass
    inertia: units.Moments = Field(description="Ixx, Iyy, Izz about the centre of mass, body axes")
    products: units.Products = Field(
        (0.0, 0.0, 0.0), description="Ixy, Ixz, Iyz, elements of the tensor (Ixz = - integral of x z dm)"
    )
    offset_x: units.Coordinate = Field(0.0, description="of the centre of mass from the stiffness centre")
    offset_z: units.Coordinate = Field(0.0, description="of the centre of mass from the stiffness centre")
    height: units.Coordinate = Field(0.0, description="of the attachment plane above the centre of mass")

    @property
    def centre(self) -> tuple[float, float, float]:
        """Centre of mass from the stiffness centre of the attachment plane, m, body axes."""
        return (self.offset_x, -self.height, self.offset_z)

    @property
    def tensor(self) -> np.ndarray:
        """(3, 3) kg m2."""
        xy, xz, yz = self.products
        xx, yy, zz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @model_validator(mode="after")
    def _check(self) -> Body:
        if reason := inertia_defect(self.tensor):
            raise InputError(f"body.inertia with body.products is no inertia of a body: {reason}")
        return self


class Limiters(Section):
    """Pads on the body that face plates on the ground across a gap, in place of ideal guides.

    At every point one pad faces outwards along x and one along z, both ways where the point's coordinate is 0.
    """

    clearance: units.Coordinate = Field(
        description="gap of each pad at equilibrium; negative: pads are pressed together by so much"
    )
    friction: units.NumberOrZero = Field(0.1, description="coefficient of friction")
    stiffness: units.Stiffness = Field(1e7, description="of each pad against its plate")
    damping: units.ContactDampingOrZero = Field(0.0, description="of the normal force")
    bristle_stiffness: units.Stiffness = Field(1e7, description="of each pad along its plate while it sticks")
    points: Literal["springs"] | Annotated[tuple[units.Position, ...], Field(min_length=1)] = Field(
        "springs", description="positions of the pads; body axes"
    )


class Stand(Section):
    """The springs."""

    support: Literal["hanging", "guided", "standing"] = Field(
        "hanging", description="hanging: free in six degrees of freedom; guided: lateral motion and yaw held"
    )
    half_length: units.Length = Field(2.0, description="a: four springs at x = +-a")
    half_width: units.Length = Field(0.8696, description="b: and z = +-b")
    points: Annotated[tuple[units.Position, ...], Field(min_length=1)] | None = Field(
        None, description="attachment points of any number of springs, in place of half_length and half_width"
    )
    stiffness: Stiffnesses = Field(description="along each spring")
    natural_length: Lengths = 0.5
    damping: Dampings = Field(0.0, description="along each spring")
    lateral_stiffness: Laterals = Field(0.0, description="against horizontal displacement of a spring's end")
    lateral_damping: Dampings = 0.0
    gravity: Gravity = 9.80665
    limiters: Limiters | None = Field(
        None,
        description="in place of the ideal guides of a guided body; around a hanging one",
    )

    @model_validator(mode="after")
    def _check(self) -> Stand:
        if self.points is not None:
            given = {"half_length", "half_width"} & self.model_fields_set
            if given and any(getattr(self, k) != type(self).model_fields[k].default for k in given):
                raise InputError(f"stand.points and stand.{min(given)} are both given; give one of them")
        for key in ("stiffness", "natural_length", "damping", "lateral_stiffness", "lateral_damping"):
            value = getattr(self, key)
            if isinstance(value, tuple) and len(value) != len(self.springs):
                raise InputError(f"stand.{key} has {len(value)} values, but there are {len(self.springs)} springs")
        return self

    @property
    def springs(self) -> tuple[units.Triple, ...]:
        """Attachment points, m, body axes from the stiffness centre; (a, b), (a, -b), (-a, -b), (-a, b) in (x, z)."""
        if self.points is not None:
            return self.points
        a, b = self.half_length, self.half_width
        return ((a, 0.0, b), (a, 0.0, -b), (-a, 0.0, -b), (-a, 0.0, b))


class Sensors(Section):
    """Displacements from the rest, along fixed directions, at points of the body."""

    points: Literal["springs"] | Annotated[tuple[units.Position, ...], Field(min_length=1)] = Field(
        "springs", description="their positions; body axes"
    )
    directions: Literal["vertical", "horizontal and vertical"] | tuple[units.Direction, ...] = Field(
        "vertical", description="of each point's sensor, level axes; 'horizontal and vertical' puts three at each point"
    )
    rate: units.Frequency = Field(50.0, description="samples a second")
    duration: units.Duration = 12.24
    noise: Noises = Field(0.0, description="standard deviation of white noise")
    quantisation: units.LengthOrZero = Field(0.0, description="step of the digital reading; 0 for none")
    seed: Annotated[int, units.Whole(least=0, most=2**62)] = 1

    @model_validator(mode="after")
    def _check(self) -> Sensors:
        if self.rate * self.duration < 8.0:
            raise InputError(
                f"sensors.duration is {self.duration:g} s, which at {self.rate:g} Hz makes {self.samples} samples; "
                f"too few for an identification"
            )
        return self

    @property
    def samples(self) -> int:
        """Number of samples, the start among them."""
        return int(self.rate * self.duration + 1e-9) + 1

    @property
    def noisy(self) -> bool:
        """Whether noise or rounding is added to the displacements."""
        return bool(np.any(self.noise)) or self.quantisation > 0.0


class Solver(Section):
    """The time integration."""

    method: Literal["dop853", "rk4", "modified-euler", "dopri5"] = Field(
        "dop853", description="modified-euler is the paper's; dopri5 is adaptive"
    )
    step: units.DurationOrAuto = Field("auto", description="of the methods with a fixed step")
    accuracy: units.Tolerance = Field(1e-8, description="of the highest frequency, for step: auto")
    rtol: units.Tolerance = Field(1e-10, description="relative tolerance of dopri5")
    atol: units.Tolerance = Field(1e-13, description="absolute tolerance of dopri5")


class Identification(Section):
    """How frequencies are read from the sensors, and inertia from the frequencies."""

    method: Literal["varpro", "esprit", "matrix-pencil", "tls-prony", "prony"] = "varpro"
    order: Annotated[int, units.Whole(least=1, most=50)] | Literal["auto"] = Field(
        "auto", description="number of modes; auto: found from the signal"
    )
    way: Literal["fit", "three-frequencies", "shapes", "six-modes", "none"] = Field(
        "fit",
        description="fit: least squares on the six-degree-of-freedom model at the tilted equilibrium; "
        "three-frequencies: the paper's, with the centre of mass known; "
        "shapes: with the stiffness known; six-modes: the whole tensor",
    )


class Case(Section):
    """A case of the system `inertia-stand`."""

    system: Literal["inertia-stand"] = "inertia-stand"
    body: Body
    stand: Stand
    excitation: Excitation
    sensors: Sensors = Sensors()
    solver: Solver = Solver()
    identification: Identification = Identification()
    air: Air | None = Field(
        None,
        description="that moves with the body, about its centre of mass: shapes with centre 0; along x and z the body "
        "moves as much of it as along y; the identification does not know of it; "
        "uncertainties do not enter a simulation",
    )

    @property
    def added(self) -> tuple[float, np.ndarray]:
        """Mass of the air that the body moves vertically, kg, and its moments (3, 3) kg m2."""
        mass, moments = 0.0, np.zeros((3, 3))
        for shape in () if self.air is None else self.air.shapes:
            A, J = shape.added()
            size = self.air.density.value * shape.factor.value  # type: ignore[union-attr]
            mass, moments = mass + size * float(A[1, 1]), moments + size * J
        return mass, moments

    @model_validator(mode="after")
    def _check(self) -> Case:
        n = len(self.stand.springs)
        for k, shape in enumerate(() if self.air is None else self.air.shapes):
            if any(shape.centre) or shape.of != "body":
                raise InputError(
                    f"air.shapes.{k} has centre {list(shape.centre)} of the {shape.of}; in a simulation the air moves "
                    "about the body's centre of mass: leave centre and of out"
                )
        if self.stand.limiters is not None and self.solver.method != "dopri5":
            raise InputError(
                f"solver.method is {self.solver.method!r}, which integrates a body on springs alone; stand.limiters "
                "takes 'dopri5'"
            )
        self.excitation.check_springs(n)
        places = self.stand.springs if self.sensors.points == "springs" else self.sensors.points
        rows = self.sensors.directions
        if isinstance(rows, tuple) and len(rows) != len(places):
            of = "springs" if self.sensors.points == "springs" else "points in sensors.points"
            raise InputError(f"sensors.directions has {len(rows)} rows, but there are {len(places)} {of}")
        if isinstance(self.sensors.noise, tuple) and len(self.sensors.noise) != len(self.sensor_points):
            raise InputError(
                f"sensors.noise has {len(self.sensors.noise)} values, but there are {len(self.sensor_points)} sensors"
            )
        return self

    @property
    def sensor_points(self) -> np.ndarray:
        """(c, 3) m, body axes from the stiffness centre."""
        points = np.array(self.stand.springs if self.sensors.points == "springs" else self.sensors.points)
        return np.repeat(points, 3, axis=0) if self.sensors.directions == "horizontal and vertical" else points

    @property
    def sensor_directions(self) -> np.ndarray:
        """(c, 3) unit vectors, level axes."""
        if isinstance(self.sensors.directions, tuple):
            directions = np.array(self.sensors.directions)
            return np.asarray(directions / np.linalg.norm(directions, axis=1)[:, None])
        each = [[0.0, 1.0, 0.0]] if self.sensors.directions == "vertical" else np.eye(3)
        return np.tile(each, (len(self.sensor_points) // len(each), 1))
