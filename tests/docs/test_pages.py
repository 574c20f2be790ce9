"""README and pages: commands exist, tutorials run, links lead somewhere, no built-in case is left out."""

from __future__ import annotations

import importlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tomllib

import click
import numpy as np
import pytest

from evolvent import cases
from evolvent.design import studies
from evolvent_base import cli
from evolvent_papers import laboratory

ROOT = pathlib.Path(__file__).parents[2]
DOCS = ROOT / "docs"
#: Folders and pages that a build writes, at times beside the tests: others are written by hand.
MADE = {"_build", "jupyter_execute", "examples"}


def is_made(path: pathlib.Path) -> bool:
    """Whether a path in the documentation is written by a build: all subfolders of the reference are."""
    first, *others = path.relative_to(DOCS).parts or ("",)
    return first in MADE or (first == "reference" and len(others) > 1)


WRITTEN = [ROOT / "README.md", *sorted(path for path in DOCS.rglob("*.md") if not is_made(path))]
TUTORIALS = sorted(
    path
    for folder in ("tutorials", "how-to")
    for path in (DOCS / folder).glob("*.md")
    if path.stem not in ("index", "day")  # `test_day` runs the commands of that one
)


def name_of(path: pathlib.Path) -> str:
    return path.relative_to(ROOT).as_posix()


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)


def commands() -> list[tuple[str, str]]:
    """Commands of the package in shell blocks and in the text, and the pages that they are on."""
    found = []
    for path in WRITTEN:
        text = path.read_text(encoding="utf-8")
        lines = [line for block in blocks(text, "sh") for line in block.splitlines()]
        plain = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
        lines += [" ".join(inline.split()) for inline in re.findall(r"`(evolvent [a-z][^`]*)`", plain)]
        found += [(line, name_of(path)) for line in lines if line.startswith("evolvent ")]
    return sorted(set(found))


def test_readme_is_short_and_opens_with_what_it_is():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.split()) <= 900
    first = next(part for part in text.split("\n\n") if not part.startswith("#"))
    assert first == "A Python package for simulating how cables, booms, ribs and blades deploy from spacecraft."
    assert (DOCS / "images" / "deployment.gif").stat().st_size < 2e6


@pytest.mark.slow
def test_the_python_of_the_readme_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (program,) = blocks((ROOT / "README.md").read_text(encoding="utf-8"), "python")
    assert len([line for line in program.splitlines() if line and not re.match("import|from", line)]) <= 10
    names: dict = {}
    exec(program, names)
    assert names["run"].attrs["status"] == "success"
    assert (tmp_path / "slew.png").exists()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive:UserWarning")
def test_the_notebook_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    """Without the outputs of a run: they would be those of one version and one machine."""
    import matplotlib.pyplot as plt

    monkeypatch.chdir(tmp_path)
    cells = json.loads((ROOT / "examples" / "first-steps.ipynb").read_text(encoding="utf-8"))["cells"]
    programs = [cell for cell in cells if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in programs)
    names: dict = {}
    for cell in programs:
        exec("".join(cell["source"]), names)
    plt.close("all")
    least = [float(line) for line in capsys.readouterr().out.split()]
    assert least[1] < 0.0 < least[0]


@pytest.mark.parametrize(("line", "page"), commands())
def test_a_command_of_the_pages_exists_with_its_options(line, page):
    """Options and built-in cases; files are not looked for."""
    words = shlex.split(re.split(r" [>|] | {2,}#", line)[0], comments=True)[1:]
    root = click.Context(cli.commands, info_name="evolvent", **cli.commands.context_settings)
    command = cli.commands.get_command(root, words[0])
    assert command is not None, line
    context = click.Context(command, info_name=words[0], parent=root)
    values = [word for word in words[1:] if word != "..."]
    _, rest, _ = command.make_parser(context).parse_args(values)
    known = {*cases.built_in(), *studies.built_in()}
    if words[0] in ("run", "show", "sweep", "equilibrium", "modes") and rest and rest[0].islower():
        name = rest[0]
        assert name in known or "." in name or name in ("pantograph", "name"), line


def anchors(path: pathlib.Path) -> set[str]:
    """Those of the headings of a page, as Git hosts and Sphinx name them."""
    heads = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    plain = [re.sub(r"\]\([^)]*\)", "", head).lower() for head in heads]
    return {re.sub(r"[^\w\- ]", "", head).strip().replace(" ", "-") for head in plain}


@pytest.mark.parametrize("path", WRITTEN, ids=name_of)
def test_links_lead_to_files_and_headings(path):
    """To files of the repository, so that no link is dead on a Git host, and not to what a build writes."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        file, _, anchor = target.partition("#")
        if re.match("[a-z]+:", target):
            continue
        found = (path.parent / file).resolve() if file else path
        assert found.exists(), target
        assert not (found.is_relative_to(DOCS) and is_made(found)), target
        assert not anchor or found.suffix != ".md" or anchor in anchors(found), target


def test_pages_made_from_numbers_are_those_numbers(monkeypatch: pytest.MonkeyPatch):
    """`python docs/_ext/made_pages.py` writes them."""
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    assert importlib.import_module("made_pages").changed() == {}


def test_every_set_of_measurements_has_a_page_that_states_its_bands(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    tables = importlib.import_module("band_tables")
    named = [name for text in tables.pages(DOCS).values() for name in tables.sets_in(text)]
    assert sorted(named) == sorted(laboratory.SETS)


def test_links_to_examples_become_links_to_the_gallery(monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    links = importlib.import_module("links")
    text = "[a](../../examples/rib_modes.py), [b](../examples/GALLERY_HEADER.rst), [c](../examples/stand.yaml)"
    assert links.to_pages(text) == "[a](../examples/rib_modes), [b](examples/index), [c](../examples/stand.yaml)"


@pytest.mark.slow
@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive:UserWarning")
def test_a_tutorial_runs(path, monkeypatch, capsys):
    import matplotlib.pyplot as plt

    monkeypatch.chdir(path.parent)
    cells = blocks(path.read_text(encoding="utf-8"), r"\{code-cell\} python")
    assert cells
    names: dict = {"__name__": path.stem}
    for number, cell in enumerate(cells):
        exec(compile(cell, f"{path.stem}-{number}", "exec"), names)
    plt.close("all")
    check(path.stem, names)


def check(tutorial: str, names: dict) -> None:
    """What the text of a tutorial says of its numbers."""
    if tutorial == "boom":
        assert names["found"] == pytest.approx(names["rayleigh"], rel=5e-3)
        assert names["difference"] < 0.03
        ratios = dict(zip(names["durations"] / names["period"], names["ratios"], strict=True))
        assert max(ratios, key=ratios.get) == pytest.approx(1.0, abs=0.2)
        assert ratios[2.0] == pytest.approx(1.0, abs=0.02)
    elif tutorial == "tether":
        limit = names["ARM"] * names["RATE"] / 2.0
        slack = [value <= 0.0 for value in names["tension"]]
        assert slack == [speed > limit for speed in names["speeds"]]
        assert max(names["lag"]) == pytest.approx(3.14159, abs=0.05)
        assert "warning" not in names["run"].attrs
        momentum = names["run"].angular_momentum.sel(axis="z").values
        assert momentum == pytest.approx(momentum[0], rel=1e-3)  # wound thread of 11 g is ignored
    elif tutorial == "panel":
        assert abs(float(names["hinge"].latch_rate[-1])) == pytest.approx(names["rate"], rel=1e-3)
        undamped = names["rate"] * (names["inertia"] * names["LATCH"]) ** 0.5
        assert undamped < float(names["hinge"].latch_torque_peak[-1]) < 1.01 * undamped
        assert names["torques"][-1] == pytest.approx(names["dampings"][-1] * names["rate"], rel=0.01)
        assert min(names["torques"]) < 0.85 * names["torques"][0]
    elif tutorial == "wound-rib":
        assert names["run"].attrs["status"] == "success"
        assert 0.0 < names["lift"] < 0.01 * names["R"]
        assert 1.0 < names["speed"] / names["deployment_speed"](names["strip"]) < 1.05
    elif tutorial == "test-stand":
        found, true = names["found"], names["swing"].inertia_true
        for output, value, expanded in zip(found.outputs, found.values, found.expanded, strict=True):
            assert abs(value - float(true.sel(component=output.key[1:]))) < expanded
        labels = [share.label for share in names["rows"]]
        assert all(label.startswith("stand.") for label in labels[:5])
        assert labels.index("noise: frequencies") > 5
    elif tutorial == "sail":
        assert float(names["largest"].sel(formula="body_rate_corrected")) < 0.5
    elif tutorial == "ratchet":
        assert names["found"] == pytest.approx(
            [names["rate"], names["peak"], names["LOAD"] / names["RADIUS"]], rel=0.02
        )
        assert max(names["hard"].attrs["status"], names["soft"].attrs["status"]) == "success"
        assert float(names["soft"]["wheel"].angle[-1]) == pytest.approx(names["math"].radians(80), abs=0.01)
    elif tutorial == "winch":
        segment = names["DENSITY"] * names["LENGTH"] / names["NODES"] * names["G"] * names["RADIUS"]
        assert names["largest"] < 0.6 * segment
        assert names["found"] == pytest.approx(names["work"], rel=5e-3)
        assert float(abs(names["run"].energy_defect).max()) < 1e-6 * names["work"]
    elif tutorial == "stiff-rod":
        assert names["axial"] == pytest.approx(0.7e-3, rel=0.05)
        assert names["bending"] == pytest.approx(7.82, abs=0.005)
        assert max(names["rows"]) > 5.0 * names["axial"]
        for found, expected, iterations, defect in names["rows"].values():
            assert found == pytest.approx(expected, rel=5e-4)
            assert iterations < 15.0
            assert defect < 1e-7
    elif tutorial == "hold-down":
        assert names["found"] == pytest.approx(names["by_hand"], rel=1e-4)
        assert float(names["run"]["hold-down"].closed[-1]) == 0.0
    elif tutorial == "separation":
        assert names["found"] == pytest.approx(names["by_hand"], rel=2e-3)
        assert names["deviations"] == pytest.approx([names["same_as"]] * 2, rel=0.2)
    elif tutorial == "spin":
        assert names["found"] == pytest.approx(names["by_hand"], rel=1e-4)
    elif tutorial == "unequal-wings":
        assert names["found"] == pytest.approx(names["by_hand"], rel=3e-3)
        assert abs(float(names["rate"][-1])) < 0.01
    elif tutorial == "yo-yo":
        assert names["largest"] < 1e-6
        assert names["found"] == pytest.approx(names["by_hand"], rel=1e-5)
    elif tutorial == "reel-law":
        assert names["found"] == pytest.approx(names["by_hand"], rel=0.01)
    elif tutorial == "boom-payout":
        assert names["found"] == pytest.approx(names["by_hand"], rel=1e-3)
    elif tutorial == "nastran-panel":
        assert names["found"] == pytest.approx(names["by_hand"], rel=2e-3)
        assert len(names["run"].ev.latches.to_pandas()) == 1
    elif tutorial == "motor":
        assert float(names["rate"][-1]) == pytest.approx(names["steady"], rel=1e-3)
        assert names["margins"].least == pytest.approx(names["stall"] / names["required"] - 1, rel=1e-9)
        assert names["margins"].least < 0.0
    elif tutorial == "monte-carlo":
        assert names["found"].upper.value == np.sort(names["found"].values)[-2]
        assert 0.95 < names["covered"] < 1.0
        assert names["found"].moments["mean"] == pytest.approx(names["times"].mean(), rel=0.01)
        expected = np.array([0.5 * 0.05, 0.5 * 0.03 / 3**0.5]) / np.hypot(0.5 * 0.05, 0.5 * 0.03 / 3**0.5)
        assert np.abs(names["found"].regression.coefficients) == pytest.approx(expected, abs=0.1)
    elif tutorial == "optimise":
        assert names["stiffness"] == pytest.approx(names["by_hand"], rel=1e-3)
        assert names["rate"] == pytest.approx(names["expected"], rel=1e-3)
        assert float(names["run"]["hinge"].latch_time[-1]) <= names["LIMIT"] * (1 + 1e-9)
    elif tutorial == "storage":
        before, after = names["found"].margins
        assert names["least"] < after.least < before.least  # the last of the loop is 40 degC
        assert names["spring"].left == pytest.approx(1.0 - sum(share for share, _ in names["spring"].prony))
    else:
        pytest.fail(f"no check of the tutorial {tutorial}")


def test_the_gallery_has_a_picture_of_every_built_in_case():
    pictures = {path.stem for path in (DOCS / "images" / "cases").glob("*.png")}
    assert pictures == set(cases.built_in())
    text = (DOCS / "images" / "cases.py").read_text(encoding="utf-8")
    assert set(re.findall(r'^    "([a-z-]+)": Frame', text, flags=re.MULTILINE)) == set(cases.built_in())


def test_the_reference_has_a_page_for_each_part_case_and_command(monkeypatch: pytest.MonkeyPatch):
    """Those that a build writes have keys and class; what else `evolvent.parts` has is on a page by hand."""
    pytest.importorskip("sphinx")
    from evolvent import parts
    from evolvent.parts import registry

    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    pages = importlib.import_module("pages").every()
    assert len({(page.folder, page.name) for page in pages}) == len(pages)
    found = {folder: {page.name: page for page in pages if page.folder == folder} for folder in ("parts", "cases")}
    own = {name: kind for name, kind in registry.kinds().items() if kind.__module__.startswith("evolvent.")}
    assert own.keys() <= found["parts"].keys()
    assert set(cases.systems()) <= found["cases"].keys()
    for name, kind in own.items():
        assert f".. autoclass:: evolvent.parts.{kind.__name__}\n" in found["parts"][name].text
        assert all(f"| `{key}` |" in found["parts"][name].text for key in kind.model_fields), name
    assert "| `parts" not in found["cases"]["structure"].text
    by_hand = (DOCS / "reference" / "profiles.md").read_text(encoding="utf-8")
    others = {name for name in parts.__all__ if name not in {kind.__name__ for kind in own.values()}}
    assert set(re.findall(r"evolvent\.parts\.(\w+)", by_hand)) == others


def test_the_table_of_layers_is_that_of_the_import_linter():
    """In CONTRIBUTING: the same layers in the same order, and every module of the package in one of them."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (contract,) = (one for one in contracts if one.get("containers") == ["evolvent"])
    wanted = [sorted(name.strip() for name in layer.split("|")) for layer in contract["layers"]]
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text.partition("| layer |")[2].partition("\n\n")[0]
    rows = [row.split("|")[1] for row in table.splitlines()[2:]]
    found = [sorted(name.rstrip("/") for name in re.findall(r"`([^`]+)`", row)) for row in rows]
    assert found == wanted
    package = ROOT / "packages/evolvent/src/evolvent"
    modules = {path.stem for path in package.glob("*.py")} - {"__init__"}
    folders = {path.name for path in package.iterdir() if (path / "__init__.py").exists()}
    assert sorted(name for row in found for name in row) == sorted(modules | folders)
    assert {name for row in rows for name in re.findall(r"`([^`]+)/`", row)} == folders


def test_the_glossary_is_sorted_and_linked():
    terms = re.findall(
        r"^([a-z][a-z -]*)\n    \S", (DOCS / "glossary.md").read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    assert len(terms) > 15
    assert terms == sorted(terms)
    assert "(glossary.md)" in (DOCS / "index.md").read_text(encoding="utf-8")


CHROMIUM = os.environ.get("EVOLVENT_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, on the path or in $EVOLVENT_CHROMIUM")
def test_search_works_in_pages_opened_as_files(tmp_path):
    """Two pages with the theme and the settings of the documentation, searched from file://."""
    for package in ("sphinx", "myst_parser", "pydata_sphinx_theme"):
        pytest.importorskip(package)
    sync_api = pytest.importorskip("playwright.sync_api")
    conf = (DOCS / "conf.py").read_text(encoding="utf-8")
    settings = [line for line in conf.splitlines() if re.match(r"html_(theme|show_\w+|copy_source) = ", line)]
    assert "html_show_search_summary = False" in settings
    (tmp_path / "conf.py").write_text("\n".join(['extensions = ["myst_parser"]', *settings]))
    (tmp_path / "index.md").write_text("# Start\n\nNothing here.\n\n```{toctree}\nspool\n```\n")
    (tmp_path / "spool.md").write_text("# Spools\n\nA thread leaves the reel.\n")
    build = [sys.executable, "-m", "sphinx", "-q", "-W", ".", "out"]
    done = subprocess.run(build, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page()
        failed: list[str] = []
        page.on("requestfailed", lambda request: failed.append(request.url))
        page.on("pageerror", lambda error: failed.append(str(error)))
        page.goto((tmp_path / "out" / "search.html").as_uri() + "?q=reel")
        page.wait_for_selector(".search-summary:has-text('finished')", timeout=20_000)
        found = page.locator("#search-results ul.search li a").all_inner_texts()
        browser.close()
    assert found == ["Spools"]
    assert failed == []
