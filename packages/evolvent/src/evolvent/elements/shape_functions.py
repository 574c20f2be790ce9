"""Shape functions of the axis of an element."""

from __future__ import annotations

from typing import Any


def axis_shape(length: Any, xi: Any, *, order: int = 0) -> tuple[Any, Any, Any, Any]:
    """Shape functions of r_p, r_p,x, r_q, r_q,x on the axis (Hermite's), or their derivatives by x = length xi.

    Parameters
    ----------
    length : float, m, or an array
    xi : float or array of any shape
    order : {0, 1, 2}, of the derivative
    """
    if order == 0:
        return (
            1.0 - 3.0 * xi**2 + 2.0 * xi**3,
            length * (xi - 2.0 * xi**2 + xi**3),
            3.0 * xi**2 - 2.0 * xi**3,
            length * (xi**3 - xi**2),
        )
    if order == 1:
        return (
            (6.0 * xi**2 - 6.0 * xi) / length,
            1.0 - 4.0 * xi + 3.0 * xi**2,
            (6.0 * xi - 6.0 * xi**2) / length,
            3.0 * xi**2 - 2.0 * xi,
        )
    return (
        (12.0 * xi - 6.0) / length**2,
        (6.0 * xi - 4.0) / length,
        (6.0 - 12.0 * xi) / length**2,
        (6.0 * xi - 2.0) / length,
    )
