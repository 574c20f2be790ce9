"""Constants of the elements, built once in NumPy: sections, quadratic forms of the formulations, mass, loads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.elements.forms import (
        FORMULATIONS as FORMULATIONS,
        PARTS as PARTS,
        STRAIGHT as STRAIGHT,
        Form as Form,
        beam_form as beam_form,
        beam_parts as beam_parts,
        cable_bending as cable_bending,
        cable_form as cable_form,
        cable_parts as cable_parts,
        cable_stretch_energy as cable_stretch_energy,
        cable_stretch_form as cable_stretch_form,
        cable_stretch_parts as cable_stretch_parts,
        line_stiffness as line_stiffness,
        line_strains as line_strains,
        section_stiffness as section_stiffness,
        straight_beam as straight_beam,
        straight_cable as straight_cable,
    )
    from evolvent.elements.heat import HeatBalance as HeatBalance
    from evolvent.elements.helices import helix as helix, helix_stiffness_ratio as helix_stiffness_ratio
    from evolvent.elements.inertia import (
        OWN_INERTIA as OWN_INERTIA,
        SectionInertia as SectionInertia,
        beam_mass as beam_mass,
        cable_mass as cable_mass,
    )
    from evolvent.elements.materials import (
        ALUMINIUM as ALUMINIUM,
        CFRP as CFRP,
        KAPTON as KAPTON,
        STEEL as STEEL,
        Material as Material,
    )
    from evolvent.elements.sections import (
        General as General,
        Lenticular as Lenticular,
        SectionStiffness as SectionStiffness,
        Taper as Taper,
        TapeSection as TapeSection,
    )
    from evolvent.elements.shape_functions import axis_shape as axis_shape
    from evolvent.elements.shapes import (
        Angle as Angle,
        Arc as Arc,
        Circle as Circle,
        CrossSection as CrossSection,
        IBeam as IBeam,
        Properties as Properties,
        Rectangle as Rectangle,
        Strip as Strip,
        Tube as Tube,
    )
    from evolvent.elements.winding import (
        bending_stiffness_ratio as bending_stiffness_ratio,
        bent_element as bent_element,
        coil as coil,
        nodal as nodal,
        resampled as resampled,
    )

__getattr__, __dir__, __all__ = lazy.attach(
    __name__,
    submodules=["laminates", "strength"],
    submod_attrs={
        "forms": [
            "FORMULATIONS", "PARTS", "STRAIGHT", "Form", "beam_form", "beam_parts", "cable_bending", "cable_form",
            "cable_parts", "cable_stretch_energy", "cable_stretch_form", "cable_stretch_parts", "line_stiffness",
            "line_strains", "section_stiffness", "straight_beam", "straight_cable",
        ],
        "heat": ["HeatBalance"],
        "helices": ["helix", "helix_stiffness_ratio"],
        "inertia": ["OWN_INERTIA", "SectionInertia", "beam_mass", "cable_mass"],
        "materials": ["ALUMINIUM", "CFRP", "KAPTON", "STEEL", "Material"],
        "sections": ["General", "Lenticular", "SectionStiffness", "Taper", "TapeSection"],
        "shape_functions": ["axis_shape"],
        "shapes": ["Angle", "Arc", "Circle", "CrossSection", "IBeam", "Properties", "Rectangle", "Strip", "Tube"],
        "winding": ["bending_stiffness_ratio", "bent_element", "coil", "nodal", "resampled"],
    },
)  # fmt: skip
