"""Ties of a net: what pulls its nodes onto the wanted surface."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from evolvent.parts.base import Reference
from evolvent_base import units
from evolvent_base.schema import OneOf, Section

Array = np.ndarray

__all__ = ["Anchors", "HungNet", "RearNet"]


class Ties(Section):
    """What pulls the nodes of a net onto the wanted surface, along its axis.

    Parameters
    ----------
    tension : float, N, optional
        Of each tie; if left out, those by which the nodes are on the wanted surface.
    stiffness : float, N
        E A of a tie.
    """

    tension: units.PositiveForce | None = None
    stiffness: units.PositiveForce


class Anchors(Ties):
    """Ties to points of a body below the nodes.

    Parameters
    ----------
    to : str
        A body, or the ground.
    length : float, m
        Of all ties, under tension.
    """

    to: Annotated[str, Reference(what="a body")] = "ground"
    length: units.Length


class Behind(Ties):
    """Ties to a rear net, which holds them by its tensions.

    Parameters
    ----------
    ratio : float
        Force densities of the net over those of the rear net.
    """

    ratio: units.PositiveNumber = 1.0

    def below(self, x: Array) -> Array:
        """Where the nodes of the rear net (n, 3) are for nodes of the net, m, before ties pull; its rim is there."""
        raise NotImplementedError


class RearNet(Behind):
    """Ties to a rear net, which mirrors the net.

    Its heights are those of the net times `ratio`, the other way, and its tensions hold the ties.

    Parameters
    ----------
    gap : float, m
        Between both nets where the height of the wanted surface is zero.
    ratio : float
        Height of the rear net over that of the net.
    """

    gap: units.Length

    def below(self, x: Array) -> Array:
        """Nodes of the rear net (n, 3) that mirror those of the net, m."""
        return np.asarray(x * [1.0, 1.0, -self.ratio] - [0.0, 0.0, self.gap])


class HungNet(Behind):
    """Ties to a rear net that hangs below the net, between standoffs of what holds the rim of the net.

    Parameters
    ----------
    drop : float, m
        Length of the standoffs, along the axis.
    """

    drop: units.Length

    def below(self, x: Array) -> Array:
        """The net (n, 3), m, shifted down."""
        return np.asarray(x - [0.0, 0.0, self.drop])


AnyTies = Annotated[Ties, OneOf({"anchors": Anchors, "rear": RearNet, "hung": HungNet})]
