"""How one mode swings and decays: laws of decay, and what was found of a swing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from evolvent_massprops.identification.signals import Array
from evolvent_massprops.identification.swing_model import Component

#: Laws of decay by name: which of viscous damping, dry friction and quadratic drag act.
LAWS = {
    "viscous": (True, False, False),
    "dry": (False, True, False),
    "quadratic": (False, False, True),
    "mixed": (True, True, True),
}
_WORDS = ("viscous damping", "dry friction", "quadratic drag")


@dataclass(frozen=True, eq=False)
class Swing:
    """How one mode swings and decays.

    Attributes
    ----------
    component : its parameters
    std : of d, D, Q, 1/s; 0 for those that do not act
    last : amplitude at the last sample over that at the first
    amplitude, amplitude_std : rad at the first sample; nan where the frequency does not depend on it. Where it is not
        seen, the deviation is about the largest that it may have.
    """

    component: Component
    std: Array
    last: float
    amplitude: float
    amplitude_std: float

    @property
    def law(self) -> str:
        """In words."""
        words = [w for w, acts in zip(_WORDS, self.component.law, strict=True) if acts]
        return " and ".join(words) if len(words) < 3 else ", ".join(words[:-1]) + " and " + words[-1]

    @property
    def exponential(self) -> bool:
        """Whether its amplitude decays exponentially."""
        return self.component.law == LAWS["viscous"]

    @property
    def follows_amplitude(self) -> bool:
        """Whether its frequency depends on its amplitude."""
        return not self.component.restoring.linear or self.component.free_cube

    def predict(self, time: Array, amplitude: Array) -> Array:
        """(n, c) what sensors with complex amplitudes (c,) read at times (n,), s."""
        first, second = self.component.phasors()
        turn = np.array([[first.real, second.real], [first.imag, second.imag]])
        coefficients = np.linalg.solve(turn, np.array([amplitude.real, amplitude.imag]))
        return np.asarray(self.component.columns(np.asarray(time, dtype=float)) @ coefficients)

    def __str__(self) -> str:
        """Law of decay, with its rates at the first amplitude, and what the frequency does."""
        rates = self.component.rates or ()
        parts = [
            f"{word} {rate:.3g} ± {std:.1g} 1/s"
            for word, rate, std, acts in zip(_WORDS, rates, self.std, self.component.law, strict=True)
            if acts
        ]
        text = f"{', '.join(parts)} at the first amplitude, {self.last:.2g} of which is left at the end"
        if np.isfinite(self.amplitude):
            text += f"; amplitude {self.amplitude:.4g} ± {self.amplitude_std:.1g} rad"
        return text + ("; frequency at zero amplitude" if self.follows_amplitude else "")
