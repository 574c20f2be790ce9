"""The parts' energies and momenta add up to the root's, in every family under every method that has it; and files."""

from __future__ import annotations

import io

import numpy as np
import pytest
import xarray as xr
from numba import config

import cf
import families.plain  # noqa: F401  (all families enter their cases)
from evolvent.analysis.runs import plan
from evolvent.analysis.trees import tree
from evolvent.assembly import families as table
from evolvent.model.family import EXPLICIT, IMPLICIT
from evolvent.results import netcdf, variables
from evolvent_base.errors import InputError
from families.case import CASES
from families.rows import FAMILIES
from observe.seeing import Seen, close

#: Units of all variables.
UNITS = {
    "1", "s", "m", "m s-1", "m-1", "rad", "rad s-1", "N", "N m", "N s", "N m-1", "J", "J m-1", "J m-2", "W", "kg m s-1",
    "kg m2 s-1", "K", "K m-1", "A", "Hz", "W m-2",
}  # fmt: skip
METHODS = ("rk4", "generalized-alpha")
#: Solvers of each family.
SOLVERS = {row.name: row.solvers for row in FAMILIES}
#: Families whose case has an event, behind which samples lie within steps and are interpolated; or whose bristles are
#: damped by the step.
WITHIN_STEPS = ("an adhesion", "a motor's drivetrain")


def seen(family: str, method: str) -> Seen:
    """A short run of a family's case."""
    case = CASES[family]()
    assembly = case.system().assemble()
    try:
        table.check(assembly, IMPLICIT if method == "generalized-alpha" else EXPLICIT)
    except InputError as error:
        pytest.skip(str(error))
    end = min(case.end, 5e-3 * max(round(400.0 * case.step / 5e-3), 1))  # samples at ends of steps of 1e-3 s
    step = case.step if method == "rk4" else max(case.step, 1e-3)
    prepared, why = plan(assembly, np.linspace(0.0, end, 6), method=method, step=step)
    solution = prepared.run()
    assert solution.success, solution.message
    return Seen(solution.assembly, solution, tree(solution, case="", why=why))


def total(found: Seen, variable: str) -> np.ndarray:
    """Sum of a variable over all parts that have it."""
    zero = np.zeros(found.tree[variable].shape if variable in found.tree.data_vars else found.t.shape)
    return sum((group[variable].values for group in found.tree.children.values() if variable in group), zero)


def outside_of_extremes(found: xr.DataTree) -> list[str]:
    """Variables of which samples lie outside their extremes over all steps, which then are those of another field.

    But for the last sample: explicit methods note starts of steps, and the end of a run is a sample in any case.
    """
    outside = []
    for part, group in found.children.items():
        for name, one in group.data_vars.items():
            over = variables.extremes_of(one)
            if over is not None:
                size = 1e-9 + 1e-6 * np.nanmax(np.abs(over))
                if np.any(one.values[:-1] < over[0] - size) or np.any(one.values[:-1] > over[1] + size):
                    outside.append(f"{part}.{name}")
    return outside


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("family", sorted(CASES))
def test_parts_add_up(family: str, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kinetic and elastic energies, linear and angular momenta; extremes; then the tree as a file and back."""
    monkeypatch.setattr(xr, "open_datatree", None)  # which reads what was not written here
    found = seen(family, method)
    assert outside_of_extremes(found.tree) == []
    scale = float(np.abs(found.tree["energy"].values).max()) + 1e-9
    for variable in ("energy_kinetic", "energy_elastic"):
        off = 1e-5 if family in WITHIN_STEPS and method != "rk4" else 1e-9
        np.testing.assert_allclose(total(found, variable), found.tree[variable], atol=off * scale, err_msg=variable)
    if family in WITHIN_STEPS and method != "rk4":
        return
    close(total(found, "momentum") + 1.0, found.tree["momentum"].values + 1.0)
    angular = total(found, "angular_momentum")
    for group in found.tree.children.values():  # of bodies and points, what their centres add about the origin
        if group.attrs["kind"] in ("rigid-body", "point") and "momentum" in group:
            angular = angular + np.cross(group["position"].values, group["momentum"].values)
    close(angular + 1.0, found.tree["angular_momentum"].values + 1.0)
    for group in (found.tree, *found.tree.children.values()):
        for name, variable in group.to_dataset(inherit=False).variables.items():
            if name != "axis":
                assert variable.attrs["units"] in UNITS, name
                assert variable.attrs["long_name"], name
    if method == "rk4" and IMPLICIT in SOLVERS[family]:  # files are the same, and reading them takes the longest
        return
    image = netcdf.image(found.tree)
    assert cf.faults(io.BytesIO(image), needs=()) == []
    xr.testing.assert_identical(netcdf.read(io.BytesIO(image)), found.tree)


def test_momenta_of_an_implicit_run_load_nothing_of_explicit_methods() -> None:
    """The whole tree of a beam on a joint."""
    from evolvent.assembly import needs
    from evolvent.equations import inventory, rhs

    needs.unload()
    found = seen("a joint that is a constraint", "generalized-alpha")
    assert np.all(np.isfinite(found.tree["angular_momentum"]))
    assert not any(function.is_loaded for function in (rhs.rhs, inventory.inventory) if not config.DISABLE_JIT)
