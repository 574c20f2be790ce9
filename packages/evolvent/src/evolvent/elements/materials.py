"""Materials."""

from __future__ import annotations

from collections.abc import Iterator

from evolvent.elements.viscoelastic import Viscoelastic
from evolvent_base import units
from evolvent_base.schema import Section


class Material(Section):
    """Linearly elastic material; isotropic, unless `shear` or moduli of other directions are given.

    Parameters
    ----------
    young_modulus : float, Pa
        Young's modulus, along the beam, or along the fibres of a ply (direction 1).
    poisson_ratio : float
        Poisson's ratio, above -1 and up to 0.5; of a ply that of strains across by a stress along the fibres.
    density : float, kg/m^3
        Mass per volume.
    shear : float, Pa, optional
        Shear modulus of a material that is not isotropic, such as a laminate; E/(2 (1 + nu)) if left out. Of a ply that
        in its plane.
    young_modulus_2 : float, Pa, optional
        Of a ply of a shell: Young's modulus across the fibres, in the plane; `young_modulus` if left out.
    shear_13, shear_23 : float, Pa, optional
        Of a ply of a shell: shear moduli along and across the fibres, in planes through the thickness; that in the
        plane if left out.
    thermal_expansion : float, 1/K, optional
        Coefficient of linear thermal expansion, along the beam, or along the fibres of a ply.
    thermal_expansion_2 : float, 1/K, optional
        Of a ply of a shell: that across the fibres, in the plane; `thermal_expansion` if left out.
    tensile_strength : float, Pa, optional
        Stress along the fibres, or of an isotropic material in one direction, at which it fails or yields.
    compressive_strength : float, Pa, optional
        The same in compression; as in tension if left out.
    tensile_strength_2, compressive_strength_2 : float, Pa, optional
        Of a ply across the fibres, in the plane; as along them, and as in tension, if left out.
    shear_strength : float, Pa, optional
        Of a ply in its plane; if left out tensile_strength/sqrt(3), by which the criterion is that of von Mises.
    viscoelastic : mapping, optional
        Relaxation of both moduli by a Prony series; the moduli are those of an instant.
    """

    young_modulus: units.Modulus
    poisson_ratio: units.PoissonRatio = 0.3
    density: units.Density
    shear: units.Modulus | None = None
    young_modulus_2: units.Modulus | None = None
    shear_13: units.Modulus | None = None
    shear_23: units.Modulus | None = None
    thermal_expansion: units.ThermalExpansion | None = None
    thermal_expansion_2: units.ThermalExpansion | None = None
    tensile_strength: units.Strength | None = None
    compressive_strength: units.Strength | None = None
    tensile_strength_2: units.Strength | None = None
    compressive_strength_2: units.Strength | None = None
    shear_strength: units.Strength | None = None
    viscoelastic: Viscoelastic | None = None

    def refusals(self) -> Iterator[str]:
        """Moduli that no material has."""
        if self.young_modulus_2 is not None and self.nu**2 * self.young_modulus_2 >= self.E:
            yield (
                f"young_modulus_2 is {self.young_modulus_2:g} Pa; with the Poisson ratio {self.nu:g} it must be below "
                f"{self.E / self.nu**2:g} Pa"
            )

        others = ("compressive_strength", "tensile_strength_2", "compressive_strength_2", "shear_strength")
        given = next((key for key in others if getattr(self, key) is not None), "")
        if given and self.tensile_strength is None:
            yield f"{given} is given, but tensile_strength is missing; give it too"

    @property
    def E(self) -> float:  # noqa: N802  (the letter of the formulas)
        """Young's modulus, Pa."""
        return self.young_modulus

    @property
    def nu(self) -> float:
        """Poisson's ratio."""
        return self.poisson_ratio

    @property
    def shear_modulus(self) -> float:
        """The key `shear`, else G = E/(2 (1 + nu)), Pa."""
        return self.E / (2.0 * (1.0 + self.nu)) if self.shear is None else self.shear


#: Carbon fibre in epoxy, quasi-isotropic laminate of T300/5208: E = 69.7 GPa, nu = 0.296, 1.5e-6 1/K by laminate theory
#: from the ply's 181, 10.3 and 7.17 GPa, nu = 0.28, 0.02e-6 and 22.5e-6 1/K; density 1600 kg/m^3 (Tsai & Hahn 1980,
#: Introduction to Composite Materials). Of a laminate with most fibres along the beam E is higher and G lower.
CFRP = Material(young_modulus=69.7e9, poisson_ratio=0.296, density=1600.0, thermal_expansion=1.5e-6)


#: The ply of the same: along its fibres, and across them in the plane.
CFRP_UD = Material(
    young_modulus=181e9, poisson_ratio=0.28, density=1600.0, shear=7.17e9, young_modulus_2=10.3e9,
    thermal_expansion=0.02e-6, thermal_expansion_2=22.5e-6,
)  # fmt: skip


#: Carbon fabric in epoxy along warp or weft.
CFRP_WOVEN = Material(young_modulus=65e9, poisson_ratio=0.05, density=1580.0, shear=5e9, thermal_expansion=2.5e-6)


ALUMINIUM = Material(young_modulus=68.3e9, poisson_ratio=0.33, density=2710.0, thermal_expansion=23.6e-6)


STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0, thermal_expansion=12e-6)


TITANIUM = Material(young_modulus=110.3e9, poisson_ratio=0.31, density=4430.0, thermal_expansion=8.6e-6)


BERYLLIUM_COPPER = Material(young_modulus=128e9, poisson_ratio=0.3, density=8250.0, thermal_expansion=17e-6)


ELGILOY = Material(young_modulus=190e9, poisson_ratio=0.3, density=8300.0, shear=77e9, thermal_expansion=12.7e-6)


INVAR = Material(young_modulus=141e9, poisson_ratio=0.29, density=8050.0, thermal_expansion=1.3e-6)


KAPTON = Material(young_modulus=2.5e9, poisson_ratio=0.34, density=1420.0, thermal_expansion=20e-6)


MYLAR = Material(young_modulus=4e9, poisson_ratio=0.38, density=1390.0, thermal_expansion=17e-6)


KEVLAR = Material(young_modulus=112e9, poisson_ratio=0.36, density=1440.0, shear=2e9, thermal_expansion=-4.9e-6)


#: Materials by name in case files.
MATERIALS = {
    "cfrp": CFRP,
    "cfrp-ud": CFRP_UD,
    "cfrp-woven": CFRP_WOVEN,
    "aluminium": ALUMINIUM,
    "steel": STEEL,
    "titanium": TITANIUM,
    "beryllium-copper": BERYLLIUM_COPPER,
    "elgiloy": ELGILOY,
    "invar": INVAR,
    "kapton": KAPTON,
    "mylar": MYLAR,
    "kevlar": KEVLAR,
}


#: Where the values of each material come from; "typical": of no one source, with the range that is found.
SOURCES = {
    "cfrp": "quasi-isotropic T300/5208, laminate theory from the ply's values (Tsai & Hahn 1980)",
    "cfrp-ud": "T300/5208 along the fibres (Tsai & Hahn 1980)",
    "cfrp-woven": "typical, carbon fabric in epoxy along warp or weft: E 55 to 75 GPa, G 4 to 6 GPa, 1 to 4e-6 1/K",
    "aluminium": "6061-T6: MIL-HDBK-5J (2003); expansion Aluminum Association, 20 to 100 C",
    "steel": "structural steel: EN 1993-1-1; density EN 1991-1-1",
    "titanium": "Ti-6Al-4V, annealed: MIL-HDBK-5J (2003); expansion typical, 8.5 to 9.0e-6 1/K",
    "beryllium-copper": "typical, C17200 hardened: E 125 to 131 GPa, 8250 to 8360 kg/m^3, 16.7 to 17.8e-6 1/K",
    "elgiloy": "typical, cold worked and aged: E 186 to 200 GPa, G 75 to 79 GPa, 12 to 13e-6 1/K",
    "invar": "typical, Invar 36: E 137 to 148 GPa, 8050 to 8150 kg/m^3, 0.8 to 1.6e-6 1/K",
    "kapton": "Kapton HN film at 23 C: DuPont, Kapton HN data sheet",
    "mylar": "typical, biaxially drawn polyester film: E 3.5 to 5.2 GPa, 1380 to 1400 kg/m^3, 15 to 20e-6 1/K",
    "kevlar": "typical, Kevlar 49 yarn along it: E 105 to 130 GPa, G 1.5 to 3 GPa, -2 to -5e-6 1/K",
}
