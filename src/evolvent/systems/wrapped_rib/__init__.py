r"""Wrapped rib: a thin strip is wound round a rigid hub by a drive, is held there, and springs open by its own bending.

The hub is a cylinder of radius R about z, its middle at the origin. A rib of length L is hinged or clamped at
(R, 0, 0), several ribs evenly round the hub; it starts straight, pointing outwards, and winds counterclockwise in the
plane z = 0. Its flat side faces the hub. EI and EA are its bending and axial stiffness, m its mass per length.

The parts of a case (`structure`) are the body "hub", and of each rib k from 1 the beam "rib-k", its joint "root-k", its
contact with the hub "contact-k", its drive "drive-k" and, of turns that touch, "layer-k". Closed forms: `reference`.
Theory, and where the paper is in error or silent: docs/systems/wrapped-rib.md.

Source: Yi, Yuan, Dong, Li (2017), a wrapped-rib antenna's rib wound round its hub.
"""

from evolvent.definition import SystemDefinition
from evolvent.systems.wrapped_rib.case import Case
from evolvent.systems.wrapped_rib.chart import study_figures
from evolvent.systems.wrapped_rib.show import figures, motion, numbers
from evolvent.systems.wrapped_rib.simulate import plan, stepping
from evolvent.systems.wrapped_rib.start import check_follows
from evolvent.systems.wrapped_rib.structure import build


class WrappedRib(SystemDefinition):
    """The system `wrapped-rib`."""

    Case = Case
    start_key = "start"
    build = staticmethod(build)
    plan = staticmethod(plan)
    stepping = staticmethod(stepping)
    check_follows = staticmethod(check_follows)
    numbers = staticmethod(numbers)
    figures = staticmethod(figures)
    motion = staticmethod(motion)
    study_figures = staticmethod(study_figures)


SYSTEM = WrappedRib()
