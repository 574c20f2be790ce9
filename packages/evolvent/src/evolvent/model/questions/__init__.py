"""Questions of solvers and results about a family's records, in groups by who asks, and answers of more than one value.

A group is a field of `evolvent.model.family.Family`; one that is left out has no answers.
"""

from evolvent.model.questions.adjoint import AdjointSupport as AdjointSupport
from evolvent.model.questions.advice import Advice as Advice
from evolvent.model.questions.base import Call as Call, End as End, Moment as Moment, Records as Records
from evolvent.model.questions.contacts import Contacts as Contacts
from evolvent.model.questions.coupling import Coupling as Coupling
from evolvent.model.questions.drives import Drives as Drives
from evolvent.model.questions.energies import Energies as Energies
from evolvent.model.questions.explicit import Explicit as Explicit
from evolvent.model.questions.friction import Friction as Friction
from evolvent.model.questions.implicit import Implicit as Implicit
from evolvent.model.questions.inertia import Inertia as Inertia
from evolvent.model.questions.laws import DRIVE as DRIVE, EVENT as EVENT, Law as Law, calls_law as calls_law
from evolvent.model.questions.node_events import Equations as Equations, NodeEvents as NodeEvents
from evolvent.model.questions.notes import Notes as Notes
from evolvent.model.questions.parts import Parts as Parts, TouchFace as TouchFace, TouchPoint as TouchPoint
from evolvent.model.questions.rows import CONSTRAINT as CONSTRAINT, Rows as Rows
from evolvent.model.questions.samples import (
    BETWEEN as BETWEEN,
    CLEARED as CLEARED,
    NEARER as NEARER,
    SUMMED as SUMMED,
    Samples as Samples,
)
from evolvent.model.questions.stability import Bound as Bound, Felt as Felt, Stability as Stability
from evolvent.model.questions.state import (
    Block as Block,
    Coordinates as Coordinates,
    LinearizedPoint as LinearizedPoint,
    Positions as Positions,
    State as State,
    along as along,
    skew as skew,
)
from evolvent.model.questions.statics import Statics as Statics, never as never
from evolvent.model.questions.step import Step as Step
from evolvent.model.questions.switching import Switching as Switching
from evolvent.model.questions.torques import Torques as Torques
