"""Constants of the elements, built once in NumPy: sections, quadratic forms of the formulations, mass, loads."""

from evolvent.elements.forms import (
    FORMULATIONS,
    PARTS,
    STRAIGHT,
    Form,
    beam_form,
    beam_parts,
    cable_bending,
    cable_form,
    cable_parts,
    cable_stretch_form,
    cable_stretch_parts,
    line_stiffness,
    straight_beam,
    straight_cable,
)
from evolvent.elements.inertia import axis_shape, beam_mass, cable_mass, gravity_vector, load_vector
from evolvent.elements.sections import General, Material, Properties, Rectangle, Section, Taper

__all__ = [
    "FORMULATIONS",
    "PARTS",
    "STRAIGHT",
    "Form",
    "General",
    "Material",
    "Properties",
    "Rectangle",
    "Section",
    "Taper",
    "axis_shape",
    "beam_form",
    "beam_mass",
    "beam_parts",
    "cable_bending",
    "cable_form",
    "cable_mass",
    "cable_parts",
    "cable_stretch_form",
    "cable_stretch_parts",
    "gravity_vector",
    "line_stiffness",
    "load_vector",
    "straight_beam",
    "straight_cable",
]
