"""Lengths of the elements of beams and rods, and checks of keys that both have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.elements.inertia import SectionInertia
from evolvent.elements.materials import Material
from evolvent.elements.shapes import CrossSection
from evolvent_base.errors import InputError, counted


def element_lengths(length: float, elements: int, grading: float | tuple[float, ...]) -> np.ndarray:
    """Lengths of the elements, (elements,), m, from the root."""
    if isinstance(grading, tuple):
        ratios = np.array(grading)
    else:
        ratios = grading ** (np.arange(elements) / max(elements - 1, 1))
    found: np.ndarray = length * ratios / ratios.sum()
    return found


def node_arc(length: float, elements: int, grading: float | tuple[float, ...]) -> np.ndarray:
    """Length of the axis from the root to each node, (elements + 1,), m."""
    if grading == 1.0:
        return np.linspace(0.0, length, elements + 1)
    found = np.append(0.0, np.cumsum(element_lengths(length, elements, grading)))
    found[-1] = length
    return found


def check_grading(name: str, grading: float | tuple[float, ...], elements: int) -> None:
    """Refuse a list of another size than the number of elements."""
    if isinstance(grading, tuple) and len(grading) != elements:
        raise InputError(
            f"{name}.grading has {counted(len(grading), 'value')}; it must be one value, or {elements}, one for each "
            f"element"
        )


def halved(part: Any, name: str, keys: Sequence[str]) -> dict[str, Any]:
    """Keys of a beam or rod with every element in halves; `keys` hold values of every node, which are refused."""
    given = next((key for key in keys if getattr(part, key) is not None), None)
    if given is not None:
        raise InputError(
            f"{name}.{given} has values of every node, which elements of half the length do not have; for an estimate "
            f"of the mesh error leave it out, or compare with a case of more elements"
        )
    found: dict[str, Any] = {"elements": 2 * part.elements}
    return found if part.grading == 1.0 else found | {"grading": tuple(np.repeat(part.lengths, 2) / part.length)}


def check_inertia(name: str, inertia: SectionInertia, section: CrossSection, material: Material | None) -> None:
    """Refuse an inertia that no mass has."""
    for xi in (0.0, 1.0):
        try:
            inertia.values(section.at(xi), material)
        except InputError as error:
            raise InputError(f"{name}.inertia.{error}") from None
