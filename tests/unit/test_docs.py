"""What the guide to the warnings quotes is what the code says, and the code on the pages runs."""

import ast
import pathlib
import re

import pytest

import evolvent
from evolvent.exports import table
from evolvent.exports.request import Request
from evolvent_base import packages

ROOT = pathlib.Path(__file__).parents[2]
WARNINGS = [ROOT / "docs" / "guide" / name for name in ("warnings.md", "warnings-stands.md")]


def texts(node: ast.AST) -> list[str]:
    """Every text in a module, with \x00 for what an f-string puts in."""
    found = []
    for inner in ast.walk(node):
        if isinstance(inner, ast.JoinedStr):
            parts = (v.value if isinstance(v, ast.Constant) else "\x00" for v in inner.values)
            found.append("".join(str(part) for part in parts))
        elif isinstance(inner, ast.Constant) and isinstance(inner.value, str):
            found.append(inner.value)
    return found


def words(text: str) -> str:
    """The words of a text alone."""
    return " ".join(re.findall(r"[A-Za-z]+", text))


def quoted() -> list[str]:
    """The quotations that head the entries of the pages."""
    page = "\n".join(path.read_text(encoding="utf-8") for path in WARNINGS)
    return [" ".join(quote.split()) for quote in re.findall(r'\*\*"(.*?)"\*\*', page, flags=re.DOTALL)]


@pytest.mark.slow
def test_warnings_are_quoted_as_they_are():
    quotes = quoted()
    assert len(quotes) > 40
    pieces = {piece.strip(" ;,") for quote in quotes for piece in quote.split("...")}
    missing = {piece for piece in pieces if len(piece) > 3}
    for path in (path for folder in packages.folders().values() for path in folder.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        found = words(re.sub(r'\bf"', '"', source))
        if any(words(piece) in found for piece in missing):  # else it need not be parsed
            corpus = "\n".join(texts(ast.parse(source)))
            missing = {piece for piece in missing if piece not in corpus}
    assert not missing


RUN = evolvent.run
#: Keys that make runs of the pages short.
SHORT = {"heliogyro": {"solver.duration": "20 s"}}
#: Pages with Python, which goes on from block to block.
PAGES = (
    "index", "quickstart", "guide/model-your-own", "guide/loads", "guide/contact", "guide/beams",
    "guide/identification", "guide/sharing", "guide/stepping", "guide/sensitivities",
)  # fmt: skip


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A folder with the results and tables that the pages read."""
    folder = tmp_path_factory.mktemp("pages")
    run = evolvent.run("heliogyro", {"solver.duration": "1 s"})
    evolvent.results.save(run, folder / "run.nc")
    table.write(run, str(folder / "wind-csv"), Request())
    return folder


@pytest.fixture(scope="module")
def run_once():
    """`evolvent.run` that runs the same case once, and shorter: more than one page begins with it."""
    runs = {}

    def run(case, changes=None, **options):
        key = repr((case, changes, options))
        if key not in runs:
            runs[key] = RUN(case, SHORT.get(case, {}) | (changes or {}), **options)
        return runs[key]

    return run


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive:UserWarning")
def test_the_python_of_the_pages_runs(page, saved, run_once, monkeypatch):
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    monkeypatch.setattr(evolvent, "run", run_once)
    monkeypatch.chdir(saved)
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    assert blocks
    names: dict = {"__name__": page}
    for k, block in enumerate(blocks):
        # a law is compiled from its source, which must be in a file
        path = saved / f"{page.replace('/', '_')}_{k}.py"
        path.write_text(block)
        exec(compile(block, str(path), "exec"), names)
    plt.close("all")


def test_the_page_on_beams_names_every_section_and_material():
    """The table of materials holds the values and sources of the package."""
    from evolvent.elements.materials import MATERIALS, SOURCES
    from evolvent.elements.sections import UNIFORM

    page = (ROOT / "docs" / "guide" / "beams.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`\{([a-z-]+): ", page)) == {*UNIFORM, "strip", "taper", "stiffness", "tape", "lenticular"}
    rows = re.findall(r"^\| `(\S+)` \| (\S+) \| (\S+) \| (\S+) \| (\S+) \| (.*) \|$", page, flags=re.MULTILINE)
    assert sorted(row[0] for row in rows) == sorted(MATERIALS)
    for name, E, G, density, expansion, source in rows:
        found = MATERIALS[name]
        assert found.thermal_expansion is not None
        values = found.E / 1e9, found.shear_modulus / 1e9, found.density, found.thermal_expansion * 1e6
        assert [float(x) for x in (E, G, density, expansion)] == pytest.approx(values, rel=5e-3)
        assert source == SOURCES[name]
