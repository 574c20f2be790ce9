"""Points by which fields are integrated over bodies and beams: they have the same mass, centre and second moments."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from evolvent import elements
from evolvent.assembly.builder import Builder
from evolvent.elements.forms import gauss
from evolvent.elements.materials import Material
from evolvent.elements.shapes import CrossSection
from evolvent.families.beams.part import CABLES, Beam
from evolvent.kernels import rigid
from evolvent_base.dense import modes
from evolvent_base.errors import InputError

Array = np.ndarray


def write_field_points(builder: Builder) -> None:
    """Write the points of all bodies that can move, and of all elements, into the family `field_points`."""
    for index, row in enumerate(builder.rows["bodies"]):
        if row["motion"] != rigid.DRIVEN:
            for mass, local in body_points(float(row["mass"]), np.array(row["inertia"], dtype=float)):
                builder.add("field_points", body=index, element=-1, mass=mass, local=local, S=np.zeros(8))
    for name, (family, index) in list(builder.names.items()):
        if family != "beams":
            continue
        beam = builder.specs[name]
        if not isinstance(beam, Beam):
            raise InputError(f"{name!r} is a {type(beam).__name__}, over which a field cannot be integrated")
        first, ends = int(builder.rows["beams"][index]["first_element"]), beam.arc / beam.length
        inertia = elements.OWN_INERTIA if beam.inertia is None else beam.inertia
        for i, length in enumerate(beam.lengths):
            section = beam.section.between(float(ends[i]), float(ends[i + 1]))
            cable = beam.formulation in CABLES
            for mass, S in element_points(float(length), section, beam.material, inertia, cable=cable):
                builder.add("field_points", body=-1, element=first + i, mass=mass, local=np.zeros(3), S=S)


def body_points(mass: float, inertia: Array) -> Iterator[tuple[float, Array]]:
    """Masses and positions (body axes) of at most seven points of a body's mass and inertia (3, 3), about its centre.

    Notes
    -----
    S = tr(J)/2 - J, the second moments; along each of its axes a pair at +-a with the mass S_i/(2 a^2), the rest at
    the centre; a^2 = 3 max(S)/m, so that no mass is below zero. A body without mass, which spins, has all that at
    1 m, and less than nothing at the centre.
    """
    S = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    moments, axes = modes(S)
    largest = float(np.abs(moments).max())
    square = 3.0 * largest / mass if mass > 0.0 else 1.0
    rest = mass
    for moment, axis in zip(moments, axes.T, strict=True):
        if abs(moment) > 1e-14 * largest:
            part = 0.5 * float(moment) / square
            rest -= 2.0 * part
            for sign in (1.0, -1.0):
                yield part, sign * math.sqrt(square) * axis
    if abs(rest) > 1e-14 * abs(mass):
        yield rest, np.zeros(3)


def element_points(
    length: float, section: CrossSection, material: Material, inertia: elements.SectionInertia, *, cable: bool
) -> Iterator[tuple[float, Array]]:
    """Masses and shape functions (8,) of the points of an element: sum m S S^T is its mass matrix.

    Notes
    -----
    Gauss's points along the axis; about it, in a section, four of a quarter of its mass each, at +-sqrt(2 J/m) along
    the principal axes of its second moments J about its mass centre.
    """
    for xi, weight in gauss(4 if section.between(0.0, 0.5) is section else 6):
        per_length, about_y, about_z, product = inertia.values(section.at(xi), material)
        p, px, q, qx = elements.axis_shape(length, xi)
        mass = weight * length * per_length
        if cable:
            yield mass, np.array([p, px, q, qx, 0.0, 0.0, 0.0, 0.0])
            continue
        y = np.array([0.0, 0.0, 1.0 - xi, 0.0, 0.0, 0.0, xi, 0.0])
        z = np.array([0.0, 0.0, 0.0, 1.0 - xi, 0.0, 0.0, 0.0, xi])
        centre = np.array([p, px, 0.0, 0.0, q, qx, 0.0, 0.0]) + inertia.offset[0] * y + inertia.offset[1] * z
        moments, axes = modes(np.array([[about_z, product], [product, about_y]]))
        for moment, axis in zip(moments, axes.T, strict=True):
            across = axis[0] * y + axis[1] * z
            for sign in (1.0, -1.0):
                yield 0.25 * mass, centre + sign * math.sqrt(2.0 * moment / per_length) * across
