"""Studies: many cases of one system, over keys that vary, on all cores or on a cluster.

A study is a YAML file::

    study: payout                     # its name
    case: heliogyro                 # a built-in case, a file beside the study, or a case's keys
    set: {blade.segments: inextensible, solver.method: dopri5}
    sample: grid                    # or list, latin-hypercube, monte-carlo
    over:
      spool.rate: {from: 2 rad/s, to: 4 rad/s, points: 11}
      blade.nodes: [10, 20, 40]
    keep: [body_rate.last, tip_lag.max]

``over`` holds for ``grid`` lists or {from, to, points, spacing: linear or log}; for ``list`` lists of one length; for
the others {from, to} (uniform) or {mean, std} (normal), with ``samples``. ``seed`` fixes all that is drawn. ``keep``
names variables of the run, with ``.first``, ``.last``, ``.min``, ``.max`` or ``.mean`` over its time, and statistics;
left out, all that has no time. ``batch`` is the number of cases a task.

Of a structure, ``over`` takes keys of its parts (``parts.boom.length``), and ``keep`` full names of variables
(``hub.rate.z.last``), which stand in the results with ``_`` for dots and blanks.

``stages`` has every case run several times, each run from the end of the one before::

    stages:
      - {name: wind, set: {phase: wind}}
      - {name: deploy, set: {phase: deploy, drive: null}}
    over: {rib.thickness: [0.2 mm, 0.3 mm], deploy.damping.alpha: [0, 0.1 1/s]}
    keep: [wind.tip_speed_peak, deploy.tip_radius.last]

A key of ``over`` that begins with a stage's name varies in that stage alone; what is kept begins with one, and stands
in the results as ``deploy_tip_radius_last``, over dimensions such as ``deploy_time``. The runs are kept in the study's
folder, ``stages/000001-deploy.nc``, and are not computed again. A stage that fails ends its case.

Built-in studies are files ``*.study.yaml`` beside their system.

A system's definition (`evolvent.analysis.definition.SystemDefinition`) may have more for studies: `seed_key`,
`start_key`, `check_follows`, `run_batch` and `study_figures`.
"""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.design.studies.catalogue import built_in, text
    from evolvent.design.studies.runner import sweep
    from evolvent.design.studies.study import Study, read
    from evolvent.design.studies.variants import simulate_many

__all__ = ["Study", "built_in", "open", "read", "simulate_many", "sweep", "text"]

_LAZY = {
    "Study": "study", "built_in": "catalogue", "read": "study", "simulate_many": "variants", "sweep": "runner",
    "text": "catalogue",
}  # fmt: skip


def open(folder: str | os.PathLike[str]) -> xr.Dataset:  # noqa: A001  (named as evolvent.open is)
    """Read the results of a study.

    Parameters
    ----------
    folder : str or path, in which the study was run

    Returns
    -------
    xarray.Dataset, as `evolvent.sweep` returned it

    Raises
    ------
    InputError
        If the folder holds no study, or one that is not finished.
    """
    from evolvent.design.studies import runner, store  # cases are listed without xarray

    runner.check_installed()
    return store.read(folder)


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(f"evolvent.design.studies.{_LAZY[name]}"), name)
    raise AttributeError(f"module 'evolvent.design.studies' has no attribute {name!r}")
