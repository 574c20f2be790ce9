"""Kinds of jobs: what they are called, the files of their results, and how the page shows them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

#: Files of a job.
CASE, RUN, STUDY, CERTIFICATE = "case.yaml", "run.nc", "study", "certificate.html"
MARGINS, DISPERSION, DISPERSED = "margins.html", "dispersion.html", "dispersion.csv"
#: Folder of a calibration, its page, the case with the fitted values, and the fitted law of a relaxation.
CALIBRATION, REPORT, FITTED, LAW = "calibration", "report.html", "case.yaml", "viscoelastic.yaml"
#: Modes, and the packed motion of one of them.
MODES, MODE = "modes.nc", "mode-{}.motion"
#: Page of a storage, its equilibria and its table of forces.
STORAGE, STORED, RELAXED = "storage.html", "storage.nc", "storage.csv"
#: Page of a reflector, its lengths to cut, and its table of cords.
REFLECTOR, CUT, CORDS = "reflector.html", "reflector.json", "reflector.csv"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of jobs.

    Attributes
    ----------
    title : str, what a job is called, such as "Margins"
    row : str, what its row in the list of runs says of it
    result : str, file or folder of the results
    last : str, file of that folder that is written last, '' of a file
    report : tuple of str, path of the page with the results; empty of kinds without
    kept : mapping, what a download is called -> file beside the results
    view : str, what shows the results (`evolvent_studio.drafts.View.kind`)
    of_case : bool, whether it computes one case
    analysis : str, what it finds of a case with parts, on its button beside the one that runs the case; '' without
    needs : str, section of the case without which it has no button; '' where any case will do
    many : str, what of it is counted, such as "cases"; '' where it computes one thing
    unit : str, of the number that says how far it is
    counted : bool, whether how far it is is a number; if not, it sends sentences
    resumed : bool, whether it goes on where it was cancelled
    at_once : bool, whether it keeps nothing when it is cancelled
    """

    title: str
    row: str
    result: str
    last: str = ""
    report: tuple[str, ...] = ()
    kept: Mapping[str, str] = dataclasses.field(default_factory=dict)
    view: str = "report"
    of_case: bool = False
    analysis: str = ""
    needs: str = ""
    many: str = ""
    unit: str = ""
    counted: bool = True
    resumed: bool = False
    at_once: bool = False


#: All kinds, in the order of their buttons.
KINDS: Mapping[str, Kind] = {
    "run": Kind(title="Run", row="", result=RUN, view="run", of_case=True, unit=" s"),
    "equilibrium": Kind(
        title="Equilibrium", row="equilibrium", result=RUN, view="run", of_case=True, at_once=True,
        unit=" of the load factor",
        analysis="static equilibrium under the loads, as set by the key equilibrium",
    ),
    "modes": Kind(
        title="Modes", row="modes", result=MODES, view="modes", of_case=True, at_once=True, unit=" modes",
        analysis="frequencies and shapes about the equilibrium, as set by the keys equilibrium and modes",
    ),
    "margin": Kind(
        title="Margins", row="margins", result=MARGINS, report=(MARGINS,), of_case=True, at_once=True,
        analysis="torque and force margins of every hinge and slide over its travel, as set by the key margin",
    ),
    "storage": Kind(
        title="Storage", row="storage", result=STORAGE, report=(STORAGE,), of_case=True, at_once=True, needs="store",
        kept={"Equilibria over storage (NetCDF)": STORED, "Forces before and after (CSV)": RELAXED},
        analysis="forces, shapes, margins and deployment before and after storage, as set by the key store",
    ),
    "reflector": Kind(
        title="Reflector", row="reflector", result=REFLECTOR, report=(REFLECTOR,), of_case=True, at_once=True,
        needs="reflector", kept={"Lengths to cut (JSON)": CUT, "Cords (CSV)": CORDS},
        analysis="lengths to cut, tensions and errors of the surface of a net, as set by the key reflector",
    ),
    "sweep": Kind(
        title="Study", row="study", result=STUDY, last="results.zarr", view="study", many="cases", unit=" cases",
        resumed=True,
    ),
    "disperse": Kind(
        title="Dispersion", row="dispersion", result=STUDY, last="results.zarr", report=(DISPERSION,), many="runs",
        unit=" runs", resumed=True, kept={"All runs (CSV)": DISPERSED},
    ),
    "calibrate": Kind(
        title="Calibration", row="calibration", result=CALIBRATION, last=REPORT, report=(CALIBRATION, REPORT),
        counted=False, resumed=True,
    ),
    "relaxation": Kind(
        title="Relaxation fit", row="relaxation fit", result=CALIBRATION, last=REPORT, report=(CALIBRATION, REPORT),
        counted=False, at_once=True,
    ),
    "identify": Kind(
        title="Identification", row="identification", result=CERTIFICATE, report=(CERTIFICATE,), view="measure",
        counted=False, at_once=True,
    ),
}  # fmt: skip
