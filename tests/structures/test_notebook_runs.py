"""A notebook that is executed by a kernel: the last value of each cell shows itself as HTML or a picture."""

from __future__ import annotations

import nbformat
import pytest
from nbclient import NotebookClient

SETUP = """
import evolvent
from evolvent import parts

door = evolvent.System(title="A door")
door.add(parts.RigidBody(mass=1.0, inertia=0.1, position=(0.5, 0.0, 0.0)), "leaf")
door.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("leaf", (-0.5, 0.0, 0.0)), type="revolute", axis=(0, 0, 1)), "hinge")
door.add(parts.JointSpring(joint="hinge", rest=1.0, stiffness=1.0, damping=0.05), "spring")
run = door.simulate(until=2.0)
"""
#: Cells, the kind of output, and what it holds.
SHOWN = {
    "door": ("text/html", "A door"),
    "run.ev": ("text/html", "success"),
    "door.modes()": ("text/html", "Hz"),
    "door.equilibrium()": ("text/html", "equilibrium"),
    "run.ev.plot()": ("text/html", "data:image/png"),
    "run.ev.plot('hinge.angle')": ("image/png", ""),
    "run.ev.animate()": ("text/html", "<iframe"),
    "evolvent.simulate_many(door, {'spring.stiffness': [0.9, 1.1]}, ['hinge.angle.last'], until=1.0).ev": (
        "text/html",
        "spring.stiffness",
    ),
}


@pytest.mark.slow
def test_a_notebook_shows_what_it_holds(tmp_path):
    """Cells run one after the other in one kernel, without an error."""
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in (SETUP, *SHOWN)])
    NotebookClient(book, timeout=240, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    for cell, (kind, text) in zip(book.cells[1:], SHOWN.values(), strict=True):
        shown = [one.data for one in cell.outputs if one.output_type in ("execute_result", "display_data")]
        assert any(kind in data and text in data[kind] for data in shown), cell.source
