"""Wanted surfaces of nets: height z over the plane x, y of the net's axes."""

from __future__ import annotations

import functools
from typing import Annotated

import numpy as np

from evolvent.assembly import expressions
from evolvent.kernels.expression_rows import evaluate_rows
from evolvent.parts.expression import VARIABLES, Constants, HeightExpression, refuse_unused
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import OneOf, Section

Array = np.ndarray
#: Step of differences of a formula, beside the diameter of the aperture.
_STEP = 1e-4

__all__ = ["FormulaSurface", "Paraboloid"]


class Surface(Section):
    """A wanted surface over the aperture, a circle in the plane x, y.

    Attributes
    ----------
    diameter : float, m, of the aperture
    offset : float, m, of the aperture's centre along x
    """

    diameter: units.Length
    offset: units.LengthOrZero = 0.0

    def height(self, x: Array, y: Array) -> Array:
        """Height z, m, of the shape of x and y, m."""
        raise NotImplementedError

    def slopes(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Derivatives of the height by x and y."""
        raise NotImplementedError


class Paraboloid(Surface):
    """A paraboloid of revolution, z = (x^2 + y^2) / 4F, or the part of it beside its axis.

    Parameters
    ----------
    focal_length : float, m
    diameter : float, m
        Of the aperture in the plane x, y.
    offset : float, m
        Of the aperture's centre from the axis of the paraboloid, along x.
    """

    focal_length: units.Length

    def height(self, x: Array, y: Array) -> Array:
        """Height z, m, of the shape of x and y, m."""
        return (x * x + y * y) / (4.0 * self.focal_length)

    def slopes(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Derivatives of the height by x and y."""
        return x / (2.0 * self.focal_length), y / (2.0 * self.focal_length)


class FormulaSurface(Surface):
    """A surface by an expression of x and y.

    Parameters
    ----------
    expression : str
        z, m, as an expression of x and y, m: "0.05*(x**2 + y**2)".
    constants : mapping of names to float
        Of the expression.
    diameter : float, m
        Of the aperture in the plane x, y.
    offset : float, m
        Of the aperture's centre, along x.
    """

    expression: HeightExpression
    constants: Constants | None = None

    def _program(self) -> Array:
        return _compiled(self.expression, None if self.constants is None else tuple(self.constants.items()))

    def height(self, x: Array, y: Array) -> Array:
        """Height z, m, of the shape of x and y, m."""
        z = np.empty(np.size(x))
        evaluate_rows(self._program(), np.stack([np.ravel(x), np.ravel(y)], axis=1), z)
        if not np.isfinite(z).all():
            k = int((~np.isfinite(z)).argmax())
            raise InputError(
                f"surface.expression is not finite at x = {np.ravel(x)[k]:g} m, y = {np.ravel(y)[k]:g} m; it must be, "
                f"in the whole aperture"
            )
        return z.reshape(np.shape(x))

    def slopes(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Derivatives of the height by x and y."""
        h = _STEP * self.diameter

        def along(dx: float, dy: float) -> Array:
            near = self.height(x + dx, y + dy) - self.height(x - dx, y - dy)
            far = self.height(x + 2 * dx, y + 2 * dy) - self.height(x - 2 * dx, y - 2 * dy)
            return np.asarray((8.0 * near - far) / (12.0 * h))

        return along(h, 0.0), along(0.0, h)


@functools.lru_cache(maxsize=8)
def _compiled(text: str, constants: tuple[tuple[str, float], ...] | None) -> Array:
    """Program of an expression, with the names and values of its constants."""
    named = None if constants is None else dict(constants)
    refuse_unused("surface.constants", named, "surface.expression", (text,))
    return np.array(expressions.compile_expression(text, VARIABLES["height"], named, name="surface.expression").code)


WantedSurface = Annotated[Surface, OneOf({"paraboloid": Paraboloid, "formula": FormulaSurface})]
