"""The section `reflector` of a case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import ValidationError

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey
from evolvent_base.schema import Section, sentence


class ReflectorKeys(Section):
    """What is asked of the net of a system.

    Parameters
    ----------
    net : str, optional
        Its name; needed where the system has several.
    frequency : float, Hz, optional
        At which the loss of gain is stated.
    length_error : float, m
        Standard deviation of the lengths to which cords are cut; 0.1 mm if left out.
    limit : float, m, optional
        Of the rms of the best fit: which standard deviation of lengths keeps it, with 95 % of confidence in 95 % of all
        reflectors.
    temperature : float, K, optional
        A change of the temperature of the cords, by which the shift of the surface is stated.
    measured : str, optional
        A CSV file with the columns node, x, y, z (m, axes of the net) of a surface that was measured, or simulated.
    adjust : {"ties", "cords", "all"}
        Which lengths are changed to cancel what was measured.
    after : str, optional
        A file of a run of the same system, whose surface at the end is stated beside that in equilibrium: that of the
        mean places of the nodes over the last swing.
    """

    net: str | None = None
    frequency: units.Frequency | None = None
    length_error: units.Length = 1e-4
    limit: units.Length | None = None
    temperature: units.Temperature | None = None
    measured: Annotated[str, FileKey(endings=(".csv",))] | None = None
    adjust: Literal["ties", "cords", "all"] = "ties"
    after: Annotated[str, FileKey(endings=(".nc",))] | None = None


def keys_of(section: Mapping[str, Any], given: Mapping[str, Any]) -> ReflectorKeys:
    """The keys of a case's section `reflector`, and others in their place.

    Raises
    ------
    InputError
        For keys and values that cannot be used; one sentence.
    """
    try:
        return ReflectorKeys.model_validate({**section, **given})
    except ValidationError as error:
        raise InputError(sentence(error.errors(include_url=False), ReflectorKeys, before="reflector.")) from None
