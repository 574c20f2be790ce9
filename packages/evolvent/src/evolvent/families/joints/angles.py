"""Angles and travels of joints at samples."""

from __future__ import annotations

from evolvent.compiled.jit import INTEGERS, MATRIX, VECTOR, entry, inlined
from evolvent.kernels import axial, rigid
from evolvent.model import MODEL, family_type


@entry(VECTOR, MATRIX, INTEGERS, family_type("coordinates"), MODEL, MATRIX)
@inlined
def coordinate_at_samples(t, y, s, coordinates, model, found):  # type: ignore[no-untyped-def]
    """Angle within half a turn, or travel, and its rate, of a coordinate at samples.

    Parameters
    ----------
    t : (nt,) float, s; y : (nt, ny) float
    s : (1,) int, zero, the switch of the coordinate
    coordinates : (1,) records of the family `coordinates`
    found : (2, nt) float, output
    """
    for k in range(t.size):
        rigid.kinematics(t[k], y[k], model)
        axial.measure_coordinate(y[k], s, coordinates, model.bodies, 0)
        found[0, k], found[1, k] = coordinates[0].angle, coordinates[0].rate
