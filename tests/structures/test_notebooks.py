"""Runs as tables, and what notebooks show."""

from __future__ import annotations

import json

import numpy as np
import pytest

import evolvent
from evolvent import InputError, parts
from evolvent.results import happened
from evolvent_base import showing
from evolvent_base.answer import Answer, Section, Table


def door():
    """A door that swings open and latches, and an event on its way."""
    system = evolvent.System(title="A <door>")
    system.add(parts.RigidBody(mass=1.0, inertia=0.1, position=(0.5, 0.0, 0.0)), "door")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("door", (-0.5, 0.0, 0.0)), type="revolute", axis=(0, 0, 1)), "hinge")
    system.add(
        parts.JointSpring(
            joint="hinge", start=0.0, rest=2.0, stiffness=1.0, latch="45 deg", latch_stiffness=50.0, latch_damping=1.0
        ),
        "spring",
    )  # fmt: skip
    system.add(parts.Event(law="y - 0.25", variables={"y": "door.position.y"}, constants={}), "half")
    return system


@pytest.fixture(scope="module")
def run():
    """Its run."""
    return door().simulate(until=3.0)


def test_latches_and_events_are_tables(run):
    """The latch at 45 deg has its time and rate: of the energy (1/2) k (rest^2 - (rest - angle)^2) = (1/2) J rate^2."""
    latches, inertia = run.ev.latches, 0.1 + 0.25
    assert list(latches.latch.values) == ["spring"]
    assert latches.rate_unit.values[0] == "rad/s"
    rate = np.sqrt((2.0**2 - (2.0 - np.pi / 4.0) ** 2) / inertia)
    assert np.isclose(float(latches.rate[0]), rate, rtol=1e-4)
    assert float(latches.time[0]) == float(run["spring"].latch_time[-1])
    events = run.ev.events
    assert list(events.part.values) == ["half", "spring"]
    assert list(events.what.values) == ["event", "latched"]
    assert float(events.time[1]) == float(latches.time[0])
    assert np.all(np.diff(events.time) > 0.0)
    height, before = run["door"].position[:, 1].values, run.time.values < float(latches.time[0])
    assert np.isclose(float(events.time[0]), np.interp(0.25, height[before], run.time.values[before]), atol=1e-3)


def test_tables_and_attributes_survive_a_file(run, tmp_path):
    """A file has the same tables; statistics are a mapping of numbers; the method has one name."""
    path = tmp_path / "run.nc"
    run.ev.save(path)
    read = evolvent.open(path)
    assert read.ev.events.identical(run.ev.events)
    assert read.ev.latches.identical(run.ev.latches)
    assert dict(read.ev.statistics) == dict(run.ev.statistics)
    assert run.ev.statistics["steps"] > 0
    assert read.attrs["method"] == run.attrs["method"]
    assert "solver" not in run.attrs
    with pytest.raises(TypeError):
        run.ev.statistics["steps"] = 0
    run.attrs["events"] = json.dumps({"time": [0.0], "part": [], "what": []})
    run.ev.save(path)
    with pytest.raises(InputError, match="'events' must hold columns of one length"):
        evolvent.open(path)
    run.attrs["events"] = read.attrs["events"]


def test_runs_without_events():
    """The tables are there, and empty."""
    system = evolvent.System()
    system.add(parts.Point(mass=1.0, velocity=(1.0, 0.0, 0.0)), "ball")
    run = system.simulate(until=1.0)
    assert run.ev.events.sizes["event"] == 0
    assert run.ev.latches.sizes["latch"] == 0
    assert "events" not in run.attrs
    assert happened.events_of(run).to_pandas().empty


def test_notebooks_show_objects_in_short(run):
    """Every text is escaped; status, latches, sizes and warnings are there."""
    system = door()
    html = system._repr_html_()
    assert "A &lt;door&gt;" in html
    assert "<door>" not in html
    assert "joint-spring" in html
    html = run.ev._repr_html_()
    assert "success" in html
    assert "spring" in html
    assert "deg/s" in html
    assert "samples" in html
    assert "<door>" not in html
    warned = run.copy()
    warned.attrs["warning"] = "<b>loose</b>"
    assert "&lt;b&gt;loose&lt;/b&gt;" in warned.ev._repr_html_()
    table = Table(heads=["head"], rows=[[str(k)] for k in range(24)])
    long = Answer(title="long", sections=[Section(title="rows", blocks=[table])])
    modes = system.modes(count=1)
    assert "frequency, Hz" in modes._repr_html_()
    assert "12 more rows" in showing.notebook(long)


@pytest.mark.slow
def test_notebooks_show_figures_and_animations(run, tmp_path):
    """Figures are images; an animation is its page in a frame, escaped and without access to the notebook."""
    assert run.ev.plot("spring.angle")._repr_png_()[:4] == b"\x89PNG"
    assert run.ev.plot()._repr_html_().count("<img") == len(run.ev.plot())
    page = run.ev.animate()
    html = page._repr_html_()
    assert 'sandbox="allow-scripts"' in html
    assert html.count("<iframe") == 1
    assert "<script" not in html
    assert run.ev.animate(tmp_path / "a.html") == str(tmp_path / "a.html")
    assert (tmp_path / "a.html").read_bytes() == page.content


def test_margins_and_calibrations_in_notebooks():
    """Margins show their table."""
    html = evolvent.load("solar-array").margin(motion=False)._repr_html_()
    assert "least margin" in html
    assert "hinge 1" in html


def test_only_public_names_are_listed():
    """`dir` lists what the package offers and nothing else."""
    assert set(dir(evolvent)) == {*evolvent.__all__, "__version__"}
    assert all(getattr(evolvent, name) is not None for name in dir(evolvent))


def test_remove_and_replace():
    """A part goes only where nothing refers to it; another one takes its place and name."""
    system = door()
    with pytest.raises(InputError) as error:
        system.remove("hinge")
    assert str(error.value) == "'hinge' cannot be removed: 'spring' refers to it; remove it first"
    with pytest.raises(InputError, match="'door' cannot be removed: 'hinge', 'half' refer to it; remove them first"):
        system.remove("door")
    with pytest.raises(InputError, match="no part is called 'sprng'; did you mean 'spring'"):
        system.remove("sprng")
    spring = system.remove("spring")
    assert "spring" not in system.parts
    assert spring.stiffness == 1.0
    system.add(spring, "spring")
    before = system.replace("door", parts.RigidBody(mass=2.0, inertia=0.2, position=(0.5, 0.0, 0.0)))
    assert before.mass == 1.0
    assert next(iter(system.parts)) == "door"
    assert system.parts["door"].mass == 2.0
    heavier = door()
    heavier._parts["door"] = system.parts["door"]
    assert np.array_equal(system.assemble().y, heavier.assemble().y)
    with pytest.raises(InputError, match="is not a part"):
        system.replace("door", 3)
    with pytest.raises(InputError, match="no part is called 'gate'"):
        system.replace("gate", spring)


def test_replacing_after_values_are_varied():
    """A system that has shared its assembly with variants is assembled again with the other part."""
    system = door()
    system.with_values({"spring.stiffness": 2.0}).assemble()
    system.replace("spring", system.parts["spring"].replaced(stiffness=3.0, rest=1.0))
    fresh = door()
    fresh.replace("spring", system.parts["spring"])
    assert system.assemble().model.coordinates["stiffness"][0] == 3.0
    found, expected = system.simulate(until=0.5), fresh.simulate(until=0.5)
    assert np.array_equal(found["spring"].angle, expected["spring"].angle)


def test_files_of_older_versions_are_read(run, tmp_path):
    """The method was called `solver` there; the digest of such a file holds."""
    path, older = tmp_path / "older.nc", run.copy()
    older.attrs = {("solver" if key == "method" else key): value for key, value in run.attrs.items()}
    evolvent.save(older, path)
    read = evolvent.open(path)
    assert read.attrs["method"] == run.attrs["method"]
    assert "solver" not in read.attrs
    assert "warning" not in read.attrs
