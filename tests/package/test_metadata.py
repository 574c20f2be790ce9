"""What the files around the package say agrees: version, date, names, lower bounds, licences, shipped files."""

import fnmatch
import importlib.metadata
import importlib.util
import json
import pathlib
import re
import sys

import pytest
import yaml

import evolvent
from evolvent_base import packages

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import workspace  # noqa: E402

PROJECT = workspace.root()
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
CODEMETA = json.loads((ROOT / "codemeta.json").read_text("utf-8"))
RECIPE = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text("utf-8"))
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
#: Names of conda-forge that differ from those of pyproject.toml.
CONDA = {"matplotlib-base": "matplotlib"}


@pytest.fixture(scope="module")
def lowest():
    """The module tools/lowest.py."""
    spec = importlib.util.spec_from_file_location("lowest", ROOT / "tools" / "lowest.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# ------------------------------------------------------------------------------------------------ version


def test_one_version_everywhere():
    assert re.fullmatch(r"\d+\.\d+\.\d+", evolvent.__version__)
    found = {
        "CITATION.cff": CITATION["version"],
        "codemeta.json": CODEMETA["version"],
        "recipe.yaml": RECIPE["context"]["version"],
    }
    assert found == dict.fromkeys(found, evolvent.__version__)


def test_the_packages_need_one_another_in_this_version():
    for name, project in workspace.projects().items():
        own = [one for one in project["dependencies"] if workspace.is_own(one)]
        assert all(one.endswith(f"=={evolvent.__version__}") for one in own), name


def test_what_the_packages_offer_is_what_a_missing_one_is_named_for():
    for name, project in workspace.projects().items():
        points = project.get("entry-points", {})
        offer = packages.OFFERS[name]
        assert sorted(points.get("evolvent.commands", {})) == list(offer.commands), name
        assert sorted(points.get("evolvent.systems", {})) == list(offer.systems), name
    assert set(workspace.projects()) == set(packages.OFFERS)


def test_licences_of_the_packages_are_those_of_the_repository():
    for path in (path for name in ("LICENSE", "PROVENANCE.md") for path in ROOT.glob(f"packages/*/{name}")):
        assert path.read_bytes() == (ROOT / path.name).read_bytes(), path


def test_one_date_of_release():
    date = CITATION["date-released"].isoformat()
    assert CODEMETA["datePublished"] == date


def test_the_changelog_has_the_version_and_its_date():
    """A section that is not released yet, or is headed by this version and date."""
    heads = re.findall(r"^## \[(.+?)\](?: - (\S+))?", (ROOT / "CHANGELOG.md").read_text("utf-8"), flags=re.MULTILINE)
    first = next((head for head in heads if head[0] != "Unreleased"), None)
    assert heads
    assert first in (None, (evolvent.__version__, CITATION["date-released"].isoformat()))


# ------------------------------------------------------------------------------------------------ dependencies


def test_every_dependency_has_a_lower_bound_that_the_table_explains(lowest):
    rows = re.findall(r"^\| ([a-z0-9_]+) \| ([\d.]+) \| (\d{4}-\d{2}) \|", CONTRIBUTING, flags=re.MULTILINE)
    table = {name: version for name, version, _ in rows}
    assert table.pop("python") == PROJECT["requires-python"].removeprefix(">=")
    assert table == lowest.bounds(PROJECT, [])


def test_core_packages_are_supported_for_two_years():
    """SPEC 0: no bound of a core package is younger than two years on the day when bounds were set."""
    day = re.search(r"Bounds were last set on\s+(\d{4})-(\d{2})-\d{2}", CONTRIBUTING)
    limit = (int(day[1]) - 2, int(day[2]))
    rows = re.findall(r"^\| (\w+) \| [\d.]+ \| (\d{4})-(\d{2}) \| SPEC 0 \|", CONTRIBUTING, flags=re.MULTILINE)
    assert {name for name, _, _ in rows} == {"numpy", "scipy", "matplotlib"}  # xarray's bound has its own reason
    for name, year, month in rows:
        months = 12 * (int(year) - limit[0]) + int(month) - limit[1]
        assert 0 <= months <= 3, name  # the oldest series inside the window


def test_what_is_installed_satisfies_the_bounds(lowest):
    for name, bound in lowest.bounds(PROJECT, []).items():
        installed = [int(n) for n in re.findall(r"\d+", importlib.metadata.version(name))[:3]]
        assert installed >= [int(n) for n in bound.split(".")], name


def test_bounds_of_extras_are_found(lowest):
    assert {"dask", "zarr", "nicegui", "numpy"} <= set(lowest.bounds(PROJECT, ["studio"]))
    with pytest.raises(SystemExit, match="no extra 'wrong'"):
        lowest.bounds(PROJECT, ["wrong"])
    with pytest.raises(SystemExit, match="'numpy' has no lower bound"):
        lowest.bounds({"dependencies": ["numpy"], "optional-dependencies": {}}, [])


def test_the_recipe_asks_for_what_the_package_asks_for(lowest):
    run = dict(line.partition(",")[0].split(" >=") for line in RECIPE["requirements"]["run"])
    upper = {line.partition(",")[2] for line in RECIPE["requirements"]["run"]} - {""}
    assert upper == {found.partition(",")[2] for found in PROJECT["dependencies"]} - {""}
    assert RECIPE["context"]["python_min"] == PROJECT["requires-python"].removeprefix(">=")
    assert run.pop("python") == "${{ python_min }}"
    assert {CONDA.get(name, name): bound for name, bound in run.items()} == lowest.bounds(PROJECT, [])
    assert RECIPE["about"]["license"] == PROJECT["license"]
    assert RECIPE["about"]["license_file"] == PROJECT["license-files"]
    entries = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == entries


def test_codemeta_and_citation_agree_with_the_project():
    assert sorted(CODEMETA["softwareRequirements"]) == sorted(PROJECT["dependencies"])
    assert CODEMETA["name"] == PROJECT["name"]
    assert CODEMETA["description"] == PROJECT["description"] == RECIPE["about"]["summary"]
    assert CODEMETA["keywords"] == CITATION["keywords"]
    assert [a["name"] for a in CITATION["authors"]] == [a["name"] for a in PROJECT["authors"]]
    assert [address.rpartition("/")[2] for address in CODEMETA["license"]] == CITATION["license"]


def test_the_record_of_an_archive_is_the_citation():
    record = json.loads((ROOT / ".zenodo.json").read_text("utf-8"))
    assert record["title"] == CITATION["title"]
    assert record["description"].split() == CITATION["abstract"].split()
    assert record["version"] == CITATION["version"]
    assert record["publication_date"] == CITATION["date-released"].isoformat()
    assert record["license"] in CITATION["license"]
    assert record["creators"] == CITATION["authors"]
    assert record["keywords"] == CITATION["keywords"]


def test_bounds_from_above_are_what_was_tried():
    """CONTRIBUTING states it; the classifiers and the bound of numba go no further, and are widened with it."""
    tried = dict(re.findall(r"(Python|numba) (\d+\.\d+)", re.search(r"Tried up to ([^;]+);", CONTRIBUTING)[1]))
    (numba,) = (one for one in PROJECT["dependencies"] if one.startswith("numba>"))
    major, minor = map(int, tried["numba"].split("."))
    assert numba.endswith(f"<{major}.{minor + 1}")
    assert f"Programming Language :: Python :: {tried['Python']}" == max(
        (c for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)), key=lambda c: int(c.rpartition(".")[2])
    )
    installed = tuple(map(int, importlib.metadata.version("numba").split(".")[:2]))
    assert installed <= (major, minor)
    if installed == (major, minor):
        from evolvent.compiled import interfaces

        assert interfaces.missing() == ""


def test_workflows_run_commands_that_exist():
    start = (ROOT / "start.py").read_text("utf-8")
    commands = set()
    for path in (ROOT / ".github" / "workflows").glob("*.yml"):
        jobs = yaml.safe_load(path.read_text("utf-8"))["jobs"]
        steps = [step for job in jobs.values() for step in job["steps"]]
        commands |= {found[1] for step in steps if (found := re.match(r"python start\.py (\w+)", step.get("run", "")))}
        folders = [word for step in steps for word in step.get("run", "").split() if word.startswith("tests/")]
        assert all((ROOT / folder).is_dir() for folder in folders), path
    assert {"test", "quick", "lowest", "wheel", "docs"} == commands
    assert all(f'"{word}": {word},' in start for word in commands)


def test_classifiers_name_the_supported_versions():
    minor = [int(c.rsplit(".", 1)[1]) for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)]
    assert minor == list(range(int(PROJECT["requires-python"].rsplit(".", 1)[1]), max(minor) + 1))
    assert "Typing :: Typed" in PROJECT["classifiers"]
    assert all((folder / "py.typed").read_bytes() == b"" for folder in packages.folders().values())


def test_hooks_use_the_checkers_of_the_project():
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    (repository,) = config["repos"]
    hooks = {hook["id"]: hook for hook in repository["hooks"]}
    assert {"ruff-check", "ruff-format", "mypy", "import-linter", "end-of-file-fixer"} <= set(hooks)
    pins = {pin for hook in hooks.values() for pin in hook.get("additional_dependencies", ())}
    assert all(re.fullmatch(r"[a-z-]+==[\d.]+", pin) for pin in pins)


# ------------------------------------------------------------------------------------------------ shipped files


#: Folders of sources.
FOLDERS = tuple(sorted(ROOT.glob("packages/*/src")))


def files_that_are_not_code() -> list[str]:
    """Data, assets and pictures that the wheel and the source archive hold."""
    kept = []
    for folder in (*FOLDERS, "docs/images", "docs/_static", "examples", "paper", "recipe"):
        kept += (ROOT / folder).rglob("*")
    kept += [*(ROOT / "benchmarks").glob("history.jsonl"), ROOT / "docs" / "comparison.json"]
    made = {"_kernels", "__pycache__"}
    return [
        path.relative_to(ROOT).as_posix()
        for path in kept
        if path.is_file() and path.suffix not in (".py", ".pyc", ".md", ".rst") and not made & set(path.parts)
    ]


def test_every_shipped_file_has_its_provenance():
    page = (ROOT / "PROVENANCE.md").read_text("utf-8")
    patterns = [p for row in re.findall(r"^\| (`.+?) \|", page, flags=re.MULTILINE) for p in re.findall("`(.+?)`", row)]
    shipped = files_that_are_not_code()
    assert len(shipped) > 40
    assert [name for name in shipped if not any(fnmatch.fnmatch(name, pattern) for pattern in patterns)] == []
    unused = [p for p in patterns if not p.startswith("benchmarks/") and not list(ROOT.glob(p))]
    assert unused == []


def test_data_of_others_keep_their_notice():
    page = " ".join((ROOT / "PROVENANCE.md").read_text("utf-8").split())
    assert "Copyright (c) 1990-2022 UC Regents" in page
    assert "The above copyright notice and this permission notice shall be included" in page
    assert "PROVENANCE.md" in PROJECT["license-files"]
