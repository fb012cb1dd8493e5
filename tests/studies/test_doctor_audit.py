"""Audits over folders: which files count, what a row says, the page and the JSON."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.studies.doctor.audit import Audit, AuditRow, ModelPath, examine, models_under
from mechlab.studies.doctor.licences import licence_of, recognised
from tests.studies.patients import arm, fourbar


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    top = tmp_path_factory.mktemp("models")
    for name in ("good", "bad/inner"):
        (top / name).mkdir(parents=True)
    (top / "LICENSE").write_text("MIT License\n\nCopyright")
    (top / "bad" / "COPYING").write_text("Apache License\n  Version 2.0, January 2004")
    (top / "good" / "fourbar.xml").write_text(fourbar())
    (top / "good" / "arm.urdf").write_text(arm())
    (top / "bad" / "soft.xml").write_text(fourbar(equality=""))
    (top / "bad" / "refused.xml").write_text("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>")
    (top / "bad" / "scene.xml").write_text('<mujoco><include file="inner/part.xml"/></mujoco>')
    (top / "bad" / "inner" / "part.xml").write_text(fourbar(shift=1e-2))
    (top / "notes.xml").write_text("<notes><mujocoish/></notes>")
    return top


@pytest.fixture(scope="module")
def found(folder: Path) -> Audit:
    return ml.audit([folder], jobs=2)


def test_files_that_others_include_and_other_xml_do_not_count(folder: Path) -> None:
    models, skipped = models_under([folder])
    assert {m.name.split("/", 1)[1] for m in models} == {
        "good/fourbar.xml", "good/arm.urdf", "bad/soft.xml", "bad/refused.xml", "bad/scene.xml",
    } and skipped == 1  # fmt: skip
    assert [m.path.name for m in models_under([folder / "bad" / "inner" / "part.xml"])[0]] == ["part.xml"]


def test_a_row_says_what_the_doctor_says(folder: Path, found: Audit) -> None:
    rows = {r.name.rpartition("/")[2]: r for r in found.rows}
    assert {n: r.verdict for n, r in rows.items()} == {
        "fourbar.xml": "healthy", "arm.urdf": "healthy", "soft.xml": "do not trust", "refused.xml": "refused", "scene.xml": "do not trust",
    }  # fmt: skip
    good, scene = rows["fourbar.xml"], rows["scene.xml"]
    assert (good.kind, good.bodies, good.freedoms, good.loops, good.read) == ("MJCF", 4, 1, 1, "whole")
    assert good.worst == ("", "", "") and scene.worst[:2] == ("error", "gap") and rows["arm.urdf"].freedoms == 2
    assert good.seconds > 0 and [r.verdict for r in found.rows][0] == "do not trust"
    assert {r.licence for r in found.rows if "/good/" in r.name} == {"MIT"} and scene.licence == "Apache-2.0"


def test_a_file_that_takes_too_long_is_not_examined(folder: Path) -> None:
    model = ModelPath(folder / "good" / "fourbar.xml", folder, "models/good/fourbar.xml")
    assert examine(model, {}, 0.01).verdict == "not examined" and examine(model, {}, 60.0).verdict == "healthy"


def test_page_and_json_name_no_folder_of_this_machine(folder: Path, found: Audit, tmp_path: Path) -> None:
    paths = found.save(tmp_path)
    page, data = (paths[k].read_text() for k in ("html", "json"))
    assert str(folder.parent) not in page + data and len(re.findall(r"<tr data-verdict", page)) == 5
    assert page.count("<script") == 1 and "http" not in page  # nothing from elsewhere
    document = json.loads(data)
    assert document["counts"] == {"do not trust": 2, "refused": 1, "healthy": 2}
    keys = {"name", "kind", "bodies", "freedoms", "loops", "read", "lost", "verdict", "worst", "seconds", "licence"}
    assert keys <= set(document["models"][0])


def test_names_are_escaped() -> None:
    from mechlab.studies.doctor.audit_page import audit_page

    row = AuditRow("a/<b>.xml", "a", "MJCF", verdict="refused", findings=(("error", "refused", "<script>alert(1)</script>"),))
    page = audit_page(Audit((row,)))
    assert "<script>alert" not in page and "&lt;b&gt;" in page


def test_the_verb_takes_folders(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pick = tmp_path / "pick.txt"
    pick.write_text("# two\n*/good/*\n")
    assert main(["doctor", str(folder), "--pick", str(pick), "-o", str(tmp_path / "a.html"), "--jobs", "2"]) == 0
    out = capsys.readouterr().out
    assert "2 model files: 2 healthy" in out and (tmp_path / "a.html").is_file()
    assert main(["doctor", str(folder), "--pick", str(pick), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["models"]) == 2
    (tmp_path / "empty").mkdir()
    assert main(["doctor", str(tmp_path / "empty")]) == 1 and "no MJCF" in capsys.readouterr().err
    assert main(["doctor", str(folder), "--licences", str(pick)]) == 1


def test_licences(folder: Path, tmp_path: Path) -> None:
    assert recognised("Licensed under the Apache License, Version 2.0") == "Apache-2.0"
    assert recognised("BSD 3-Clause License\nRedistribution and use in source and binary forms") == "BSD-3-Clause"
    assert recognised("all rights reserved") == ""
    bare = tmp_path / "m.xml"
    bare.write_text("<mujoco/>")
    assert licence_of(bare, tmp_path, "x/m.xml", {"x/*": "CC0"}) == "CC0" and licence_of(bare, tmp_path, "y/m.xml", {"x/*": "CC0"}) == ""
    assert licence_of(folder / "good" / "fourbar.xml", folder, "x/fourbar.xml", {"x/*": "CC0"}) == "MIT"
