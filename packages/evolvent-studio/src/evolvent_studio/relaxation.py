"""Fits of Prony series as the page asks for them, and what computes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import ValidationError

from evolvent.design.calibration.relaxation import Relaxation, curves, fit
from evolvent.design.calibration.relaxation.search import MOST_TERMS
from evolvent.design.calibration.relaxation.shifts import LAWS
from evolvent_base import units
from evolvent_base.errors import InputError, naming_keys
from evolvent_base.schema import Section, sentence


class Asked(Section):
    """A Prony series that is fitted to relaxation curves.

    Parameters
    ----------
    data : list of str
        Files, each of one curve or of those of several temperatures.
    column : str
        Name of the column of forces or torques.
    temperatures : list of str, optional
        Name of a column of temperatures, or the temperature of each file.
    shift : optional
        Of relaxation times by temperature; the table if left out.
    reference : float, K, optional
        Temperature at which the series holds; that of the data next to 20 degC if left out.
    terms : int, optional
        Number of terms; by the data if left out.
    ramp : float, s, optional
        Length of the loading before the hold; that of the data if left out.
    deviation : float, optional
        Standard deviation of the column, in its unit; that of the residuals if left out.
    own_forces : bool
        Whether each curve has an instantaneous force of its own, as of other specimens.
    """

    data: tuple[str, ...]
    column: str
    temperatures: tuple[str, ...] = ()
    shift: Literal[*LAWS] | None = None  # type: ignore[valid-type]
    reference: units.AbsoluteTemperature | None = None
    terms: Annotated[int, units.Whole(least=1, most=MOST_TERMS)] | None = None
    ramp: units.DurationOrZero | None = None
    deviation: units.PositiveNumber | None = None
    own_forces: bool = False


#: What messages call arguments that are fields of the page.
_FIELDS = {"column": "column", "temperatures": "temperature", "own_forces": "own forces"}
#: Keys that are no options: what they say depends on the files.
OF_FILES = ("data", "column", "temperatures")


def asked(content: Any) -> Asked:
    """What is asked for, checked.

    Raises
    ------
    InputError
    """
    if not isinstance(content, Mapping):
        raise InputError("a relaxation fit is a mapping of keys to values")
    try:
        return Asked.model_validate(dict(content))
    except ValidationError as error:
        raise InputError(sentence(error.errors(include_url=False), Asked)) from None


def check(of: Asked, paths: Sequence[str]) -> None:
    """Refuse files and columns that hold no curves of relaxation.

    Raises
    ------
    InputError
    """
    with naming_keys(_FIELDS):
        curves.read(paths, of.column, temperatures=of.temperatures, ramp=of.ramp)


def fitted(of: Asked, paths: Sequence[str], report: Callable[[int], None]) -> Relaxation:
    """The fitted series.

    Parameters
    ----------
    paths : of the files
    report : called with the number of terms that is tried

    Raises
    ------
    InputError
        If the data are no relaxation, or do not determine what is asked for.
    """
    options = {name: getattr(of, name) for name in Asked.model_fields if name not in OF_FILES}
    with naming_keys(_FIELDS):
        return fit.fit_files(paths, of.column, temperatures=of.temperatures, report=report, **options)
