"""Reduced models of Nastran's files, against the same models in memory and against Nastran's own frequencies.

The files are a test of pyYeti (BSD 3-clause), which it installs: two external superelements by NX Nastran 9 in inches,
four common grids, one of which has output coordinates of its own.
"""

from __future__ import annotations

import pathlib
import shutil

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.elements import nastran
from evolvent.elements.reduced_files import read_model
from evolvent.elements.reduced_models import ReducedModel

pytestmark = pytest.mark.slow
pyyeti = pytest.importorskip("pyyeti")
FOLDER = pathlib.Path(pyyeti.__file__).parent / "tests" / "nas2cam_extseout"
GRIDS = (3, 11, 19, 27)
#: kg of the unit of mass, lbf s2/in.
MASS = 175.126835
#: Frequencies of both together, Hz: `assemble.out` of the same folder, modes 7 to 14.
ASSEMBLED = (1.698800, 1.767487, 1.857720, 3.419612, 7.024210, 7.025409, 10.72361, 10.98255)
#: Mass (lbf s2/in) and height of its centre (in): `outboard.out`.
WEIGHED, CENTRE = 1.590384, (184.6398, 150.0, 150.0)


@pytest.fixture(name="outboard", scope="module")
def _outboard() -> ReducedModel:
    return read_model(str(FOLDER / "outboard.op4"))


def copied(folder: pathlib.Path, *names: str) -> None:
    for name in names:
        shutil.copyfile(FOLDER / name, folder / name)


def test_mass_and_centre_are_those_of_nastran(outboard: ReducedModel) -> None:
    Z = outboard.rigid_motions
    whole = Z.T @ outboard.mass @ Z
    assert whole[0, 0] == pytest.approx(WEIGHED, rel=1e-6)
    first = whole[:3, 3:]
    assert (first[1, 2], first[2, 0], first[0, 1]) == pytest.approx(WEIGHED * np.array(CENTRE), rel=1e-6)
    assert outboard.names == tuple(f"grid{k}" for k in GRIDS)
    assert outboard.positions[1] == pytest.approx([600.0, 300.0, 300.0])
    assert outboard.recovery.shape == (24, outboard.size)


def test_two_superelements_have_the_frequencies_of_nastran() -> None:
    """Grid 11 has displacements in other axes, and the inner one a motion without inertia."""
    found = System()
    for name in ("outboard", "inboard"):
        body = parts.ReducedBody(file=str(FOLDER / f"{name}.op4"), length_unit="1 inch", mass_unit=MASS)
        found.add(body, name)
    for k in GRIDS:
        found.add(parts.Joint(a=f"outboard.grid{k}", b=f"inboard.grid{k}", type="clamp"), f"clamp{k}")
    computed = found.modes(count=14).frequency_hz
    assert np.abs(computed[:6]).max() < 1e-3
    assert computed[6:] == pytest.approx(np.array(ASSEMBLED), rel=1e-6)


def test_dmig_entries_are_the_same_model(outboard: ReducedModel, tmp_path: pathlib.Path) -> None:
    """Entries that refer to grids and components in a file with the points."""
    import pandas as pd
    from pyyeti import nastran as library

    table = library.asm2uset(str(FOLDER / "outboard.asm"))[0]
    raw = library.op4.read(str(FOLDER / "outboard.op4"))
    index = pd.MultiIndex.from_arrays(
        [table.index.get_level_values(name) for name in ("id", "dof")], names=("id", "dof")
    )
    entries = {
        name: pd.DataFrame(raw[own], index=index, columns=index) for name, own in (("KAAX", "kxx"), ("MAAX", "mxx"))
    }
    path = tmp_path / "outboard.pch"
    library.wtdmig(str(path), entries)
    path.write_text(path.read_text() + (FOLDER / "outboard.asm").read_text())
    found = read_model(str(path))
    assert found.names == outboard.names
    assert np.abs(found.stiffness - outboard.stiffness).max() < 1e-6 * np.abs(outboard.stiffness).max()
    assert np.abs(found.mass - outboard.mass).max() < 1e-6 * np.abs(outboard.mass).max()


def test_points_of_another_file(outboard: ReducedModel, tmp_path: pathlib.Path) -> None:
    """Bulk data under another name, whose order is that of SECONCT, or of numbers."""
    copied(tmp_path, "outboard.op4")
    text = (FOLDER / "outboard.asm").read_text()
    plain = text[: text.index("\nSECONCT ")] + text[text.index("\nGRID*") :]
    for name, content in (("given.bdf", text), ("plain.bdf", plain)):
        (tmp_path / name).write_text(content)
        body = parts.ReducedBody(file=str(tmp_path / "outboard.op4"), bulk=str(tmp_path / name))
        assert body.model.names == outboard.names
        assert body.model.stiffness == pytest.approx(outboard.stiffness)


def test_files_that_do_not_fit_are_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match=r"grid 475 has the components 2 in the matrices; .* needs all six"):
        read_model(str(FOLDER / "reduced_bset_notall6.op4"))
    with pytest.raises(InputError, match="has no DMIG entries KAAX and MAAX"):
        read_model(str(FOLDER / "inboard.op2"))
    copied(tmp_path, "outboard.op4", "inboard.asm")
    path = str(tmp_path / "outboard.op4")
    with pytest.raises(InputError, match=r"matrices alone; .* outboard\.asm or outboard\.pch"):
        read_model(path)
    with pytest.raises(InputError, match=r"have 32 components, but the matrices .* have 46 rows"):
        read_model(path, bulk=str(tmp_path / "inboard.asm"))
    (tmp_path / "text.op4").write_bytes(b"no matrices")
    with pytest.raises(InputError, match="cannot read"):
        read_model(str(tmp_path / "text.op4"), bulk=str(tmp_path / "inboard.asm"))
    with pytest.raises(InputError, match="leave bulk out"):
        read_model(str(tmp_path / "model.npz"), bulk=path)


def test_without_the_package_a_sentence_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "pyyeti", None)
    with pytest.raises(InputError, match=r"need the package pyyeti: pip install 'evolvent\[nastran\]'"):
        nastran.read_nastran(str(FOLDER / "outboard.op4"))


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ("GRDSET,,,,,,7", r"has an entry GRDSET, which is not read; write its coordinate systems on the entries GRID"),
        ("grdset                                                 7", r"has an entry GRDSET"),
        ("INCLUDE 'more.bdf'", r"has an entry INCLUDE, which is not read; put the file into this one"),
        ("CORD1R,7,3,11,19", r"has an entry CORD1R, which is not read; write CORD2R"),
        ("CORD1C*,7,3,11,19", r"has an entry CORD1C"),
        ("CORD3G,7,1,1,A", r"has an entry CORD3G, which is not read; points are read of GRID, SPOINT, CORD2R"),
        ("SEQGP,3,7", r"has an entry SEQGP"),
        ("SELOC,10,1,2,3,1,2,3", r"has an entry SELOC"),
        ("GRIDB,9,,,,,,1", r"has an entry GRIDB"),
        ("EPOINT,9", r"has an entry EPOINT"),
        ("GRID\t9\t\t1.\t2.\t3.", r"has an entry GRID with tabs"),
        ("GRID,3,,1.,2.,3.", r"has GRID 3 twice"),
        ("GRID    3                       1.      2.      3.", r"has GRID 3 twice"),
    ],
)
def test_entries_that_place_points_are_read_or_refused(tmp_path: pathlib.Path, entry: str, sentence: str) -> None:
    copied(tmp_path, "outboard.op4", "outboard.asm")
    with (tmp_path / "outboard.asm").open("a") as file:
        file.write(f"\n{entry}\n")
    with pytest.raises(InputError, match=sentence):
        read_model(str(tmp_path / "outboard.op4"))


def test_coordinate_systems_given_twice_are_refused(tmp_path: pathlib.Path) -> None:
    copied(tmp_path, "outboard.op4", "outboard.asm")
    with (tmp_path / "outboard.asm").open("a") as file:
        file.write(2 * "CORD2C,907,0,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\n")
    with pytest.raises(InputError, match="coordinate system 907 twice"):
        read_model(str(tmp_path / "outboard.op4"))


def test_entries_that_place_no_points_are_passed_over(outboard: ReducedModel, tmp_path: pathlib.Path) -> None:
    copied(tmp_path, "outboard.op4", "outboard.asm")
    with (tmp_path / "outboard.asm").open("a") as file:
        file.write("\n$ GRDSET is not used\nPARAM,GRDPNT,0\nGRAV,1,0,9.81,0.,0.,1.\nCQUAD4,1,1,3,11,19,27\n")
    found = read_model(str(tmp_path / "outboard.op4"))
    np.testing.assert_array_equal(found.stiffness, outboard.stiffness)


@pytest.mark.parametrize("name", ["kxx", "mxx"])
def test_structural_damping_is_refused(tmp_path: pathlib.Path, name: str) -> None:
    from pyyeti import nastran as library

    copied(tmp_path, "outboard.asm")
    raw = library.op4.read(str(FOLDER / "outboard.op4"))
    raw = {key: raw[key] for key in ("kxx", "mxx")}
    raw[name] = raw[name] * (1.0 + 0.02j)
    library.op4.write(str(tmp_path / "outboard.op4"), raw)
    with pytest.raises(InputError, match=rf"{name.upper()} has imaginary parts, such as structural damping"):
        read_model(str(tmp_path / "outboard.op4"))
    raw[name] = raw[name].real + 0j  # which has none
    library.op4.write(str(tmp_path / "outboard.op4"), raw)
    assert read_model(str(tmp_path / "outboard.op4")).size > 0


def test_structural_damping_of_dmig_entries_is_refused(tmp_path: pathlib.Path) -> None:
    import pandas as pd
    from pyyeti import nastran as library

    table = library.asm2uset(str(FOLDER / "outboard.asm"))[0]
    raw = library.op4.read(str(FOLDER / "outboard.op4"))
    index = pd.MultiIndex.from_arrays(
        [table.index.get_level_values(name) for name in ("id", "dof")], names=("id", "dof")
    )
    entries = {
        "KAAX": pd.DataFrame(raw["kxx"] * (1.0 + 0.02j), index=index, columns=index),
        "MAAX": pd.DataFrame(raw["mxx"], index=index, columns=index),
    }
    path = tmp_path / "outboard.pch"
    library.wtdmig(str(path), entries)
    path.write_text(path.read_text() + (FOLDER / "outboard.asm").read_text())
    with pytest.raises(InputError, match="KAAX has imaginary parts"):
        read_model(str(path))
