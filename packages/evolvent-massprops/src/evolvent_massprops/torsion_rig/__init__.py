"""A torsion rig: stiffness of the bar by a rod, planar tensor and centre of mass by orientations, wrong records."""

from evolvent_massprops.torsion_rig.adjustment import Fit, Judged
from evolvent_massprops.torsion_rig.answer import RigProperties, moments_over_angle
from evolvent_massprops.torsion_rig.keys import OnRig, load, states_rig
from evolvent_massprops.torsion_rig.measured import evaluate
from evolvent_massprops.torsion_rig.plan import RigMeasurementPlan, RigOption, check, plan

__all__ = [
    "Fit", "Judged", "OnRig", "RigMeasurementPlan", "RigOption", "RigProperties", "check", "evaluate", "load",
    "moments_over_angle", "plan", "states_rig",
]  # fmt: skip
