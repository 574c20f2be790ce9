"""Observations of fields: their resultant, power and work."""

from __future__ import annotations

from evolvent.results.observe.variables import Observed, integral
from evolvent.results.observe.view import View


def observe_field(view: View, name: str) -> Observed:
    """Resultant of a field on all masses, its power, and its work by the trapezoidal rule."""
    found = Observed()
    found.results("fields", view.fields["fields"], view.index(name))
    work = integral(view.t, found.variables["power"].values)
    found.scalar("work", work, "J", "work since the first sample, by the trapezoidal rule over the samples")
    found.plots = ["force"]
    return found
