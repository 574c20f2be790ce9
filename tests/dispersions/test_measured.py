"""Distributions of measured values in a file: `table(FILE.csv)`."""

import json

import numpy as np
import pytest

from evolvent import cases
from evolvent.design import studies
from evolvent.design.studies import measured
from evolvent_base.errors import InputError
from margin_cases import case

KEY = "parts.hinge.stiffness"
#: Measured stiffnesses, mN m/rad.
VALUES = [101.5, 98.2, 99.9, 103.0, 98.2]

#: An inch times a pound (force) for a degree, N m/rad.
IN_LB_DEG = 0.0254 * 4.4482216152605 * 180.0 / np.pi


@pytest.fixture
def folder(tmp_path):
    rows = "\n".join(f"{k + 1},{value}" for k, value in enumerate(VALUES))
    (tmp_path / "springs.csv").write_text(f"sample,stiffness (mN m/rad)\n{rows}\n")
    (tmp_path / "plain.csv").write_text("\n".join(map(str, VALUES)))
    return tmp_path


def study(text, **keys):
    return {
        "study": "s", "case": case(), "sample": "monte-carlo", "samples": 400, "over": {KEY: text},
        "keep": ["hinge.margin"], **keys,
    }  # fmt: skip


def drawn(asked):
    return np.array(asked.axes[0].values)


def test_values_of_a_column_are_drawn_with_its_unit(folder):
    text = "table(springs.csv, stiffness)"
    found = studies.read(study(text), folder=folder)
    np.testing.assert_allclose(np.unique(drawn(found)), 1e-3 * np.unique(VALUES), rtol=1e-12)
    assert found.axes[0].text == text
    u = studies.read(study("uniform(0, 1)")).axes[0].values  # the probabilities of the same seed
    exact = np.quantile(1e-3 * np.array(VALUES), u, method="inverted_cdf")
    np.testing.assert_allclose(drawn(found), exact, rtol=1e-12)


def test_a_study_that_is_kept_needs_the_file_no_longer(folder):
    (folder / "s.yaml").write_text(json.dumps(study("table(springs.csv, stiffness)")))
    found = studies.read(folder / "s.yaml")
    (folder / "springs.csv").unlink()
    again = studies.read(cases.parse_yaml(found.text, "s"))
    np.testing.assert_array_equal(drawn(again), drawn(found))
    assert again.digests == found.digests
    assert cases.parse_yaml(found.text, "s")["over"][KEY].startswith("table(101.5 mN m/rad, 98.2 mN m/rad")


def test_a_column_without_a_head_has_the_unit_of_the_key(folder):
    assert set(drawn(studies.read(study("table(plain.csv)"), folder=folder))) == set(VALUES)


def test_a_long_table_is_stated_by_its_ends(folder):
    text = f"table({', '.join(f'{k}.5' for k in range(1, 90))})"
    assert studies.read(study(text)).axes[0].text == "table(1.5, ... 89.5), 89 values"


@pytest.mark.parametrize(
    ("text", "content", "sentence"),
    [
        ("table(none.csv)", "", "cannot read '{}/none.csv': no such file"),
        ("table(x.csv)", "1\n2\nabc\n4\n5\n", "cannot read 'x.csv': line 3 is no row of the table: 'abc'"),
        ("table(x.csv)", "mass\n1\n\n2\n1e999\n", "'x.csv', line 5: '1e999' is not a number"),
        ("table(x.csv, b)", "a,b\n1,2\n3,\n5,6\n", "'x.csv', line 3: '' is not a number"),
        ("table(x.csv, b)", "a,b\n1,2\n3\n5,6\n", "'x.csv': line 3 is no row of the table: '3'"),
        ("table(x.csv)", "a,b\n1,2\n3,4\n", "'x.csv' has the columns 'a', 'b'; name one, as in table(x.csv, a)"),
        ("table(x.csv)", "1;2\n3;4\n", "'x.csv' has 2 columns; name one, as in table(x.csv, column 1)"),
        ("table(x.csv, c)", "a,b\n1,2\n3,4\n", "column is 'c', which 'x.csv' does not hold; known: a, b"),
        ("table(x.csv)", "a (kg)\n1\n2\n", "'x.csv', column 'a (kg)': 'kg' is a unit of something else"),
        ("table(x.csv)", "mass (kg)\n", "cannot read 'x.csv': it is no table of numbers"),
        ("table(../x.csv)", "1\n2\n", "'../x.csv' must be in the folder of its study, or below"),
        ("table(/etc/x.csv)", "1\n2\n", "'/etc/x.csv' must be in the folder of its study, or below"),
        ("table(x.csv)", "7\nabc\n1\n2\n3\n", "cannot read 'x.csv': line 1 is no row of the table: '7'"),
        ("table(x.csv)", "k (N m/rad)\n1.031\n998\n1.029\n", "whether '.' is the decimal sign or groups thousands"),
        ("table(x.csv)", 'k (N m/rad)\n"1,031"\n"1,029"\n', "whether ',' is the decimal sign or groups thousands"),
        ("table(x.csv)", "1\n" * 10_001, "'x.csv' has 10001 values; at most 10000 are taken"),
    ],
)
def test_errors_name_the_key_the_file_and_the_row(tmp_path, text, content, sentence):
    (tmp_path / "x.csv").write_text(content)
    with pytest.raises(InputError) as refused:
        studies.read(study(text), folder=tmp_path)
    assert str(refused.value).startswith(f"over.{KEY} is '{text}'; ")
    assert sentence.format(tmp_path) in str(refused.value)


@pytest.mark.parametrize(
    ("text", "content", "values"),
    [
        ("table(x.csv)", "stiffness (mNm/rad)\n0,31\n0,29\n", (0.31e-3, 0.29e-3)),
        ("table(x.csv)", "\ufeffstiffness / N m\n0.31\n0.29\n", (0.31, 0.29)),
        ("table(X.CSV, k)", "n;k (in-lb/deg);by\n1;0,031;me\n2;0,029;you\n", (0.031 * IN_LB_DEG, 0.029 * IN_LB_DEG)),
        ("table(x.tsv, k)", "no.\tk\n\tNm/rad\n1\t0.031\n2\t0.029\n", (0.031, 0.029)),
        ("table(x.txt, k (N·m))", "# spring 3\n# k (N·m)\n3.1e-2\n2.9D-02\n", (0.031, 0.029)),
    ],
)  # fmt: skip
def test_files_as_people_have_them(tmp_path, text, content, values):
    (tmp_path / measured.file_of(text)[0]).write_text(content, encoding="utf-8")
    found = studies.read(study(text), folder=tmp_path)
    assert sorted(set(drawn(found))) == pytest.approx(sorted(values), rel=1e-6)
    assert studies.read(cases.parse_yaml(found.text, "s")).digests == found.digests


def test_a_link_out_of_the_folder_is_refused(tmp_path):
    (tmp_path / "x.csv").write_text("1\n2\n")
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "x.csv").symlink_to(tmp_path / "x.csv")
    with pytest.raises(InputError, match="must be in the folder of its study"):
        studies.read(study("table(x.csv)"), folder=tmp_path / "own")


def test_files_are_named_from_another_folder():
    over = {"a": "table(x.csv)", "b": "5%", "c": "table(y.tsv, mass)"}
    assert measured.renamed(over, lambda name: f"below/{name}") == {
        "a": "table(below/x.csv)", "b": "5%", "c": "table(below/y.tsv, mass)",
    }  # fmt: skip
    assert measured.file_of("table(1, 2)") is None


@pytest.mark.slow
def test_the_command_takes_a_file_of_the_current_folder(folder, call, monkeypatch):
    (folder / "own.yaml").write_text(json.dumps(case()))
    below = folder / "below"
    below.mkdir()
    monkeypatch.chdir(below)
    words = ["--keep", "hinge.margin", "--samples", "3", "--no-figures", "--workers", "1"]
    code, out, err = call("disperse", "../own.yaml", "--vary", f"{KEY}=table(../springs.csv, stiffness)", *words)
    assert (code, err) == (0, "")
    assert "3 runs, plain random over 1 draw" in out
    code, _, err = call("disperse", "../own.yaml", "--vary", f"{KEY}=table(../spring.csv)", *words)
    assert code == 2
    assert "cannot read '../spring.csv'" in err
