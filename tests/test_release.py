"""What is released: the archives hold all that is needed and nothing else, and the wheel works with its declared dependencies alone."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

import mechlab

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
KINDS = {".py", ".js", ".css", ".html", ".typed", ".txt"}
"""Kinds of files in the package; .txt is the list of elements of MJCF."""

@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel and the source archive, built as pip builds them."""
    wheel = pytest.importorskip("hatchling.builders.wheel")
    source = pytest.importorskip("hatchling.builders.sdist")
    folder = str(tmp_path_factory.mktemp("dist"))
    (built,) = wheel.WheelBuilder(str(ROOT)).build(directory=folder, versions=["standard"])
    (packed,) = source.SdistBuilder(str(ROOT)).build(directory=folder, versions=["standard"])
    return Path(built), Path(packed)


def test_the_wheel_holds_the_package_and_nothing_else(archives: tuple[Path, Path]) -> None:
    names = zipfile.ZipFile(archives[0]).namelist()
    inside = {n for n in names if n.startswith("mechlab/")}
    on_disk = {
        str(p.relative_to(ROOT)) for p in (ROOT / "mechlab").rglob("*") if p.is_file() and "__pycache__" not in p.parts
    }
    assert inside == on_disk and {Path(n).suffix for n in inside} <= KINDS
    assert {"mechlab/py.typed", "mechlab/viewer/page/page.html"} <= inside
    assert all(n.startswith(("mechlab/", f"mechanism_lab-{PROJECT['version']}.dist-info/")) for n in names)
    assert archives[0].stat().st_size < 4_000_000  # what a user waits for; models and pictures stay in the repository


def test_the_source_archive_builds_the_same_and_holds_no_models(archives: tuple[Path, Path]) -> None:
    with tarfile.open(archives[1]) as packed:
        names = {n.partition("/")[2] for n in packed.getnames()}
    wheel = {n for n in zipfile.ZipFile(archives[0]).namelist() if n.startswith("mechlab/")}
    assert wheel <= names
    assert {n for n in names - wheel if n} == {
        "README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE", "pyproject.toml", "PKG-INFO", ".gitignore",
    }  # fmt: skip


def test_the_wheel_runs_with_its_declared_dependencies_alone(archives: tuple[Path, Path], tmp_path: Path) -> None:
    """A folder of packages that holds the wheel and what it declares, and Python without any other: `run` makes its page."""
    packages = tmp_path / "site"
    zipfile.ZipFile(archives[0]).extractall(packages)
    brought = _closure("mechanism-lab") - {"mechanism-lab"}
    assert {"numpy", "mujoco", "trimesh"} <= brought and not brought & {"pytest", "sphinx", "playwright"}
    for name in brought:
        for file in metadata.files(name) or ():
            first = file.parts[0]
            if first not in ("..", "__pycache__") and not (packages / first).exists():
                (packages / first).symlink_to(Path(file.locate()).parents[len(file.parts) - 2] if len(file.parts) > 1 else file.locate())
    script = "import site, sys; site.addsitedir(sys.argv[1]); from mechlab.cli import main; sys.exit(main(sys.argv[2:]))"
    command = [sys.executable, "-I", "-S", "-c", script, str(packages), "run", "fourbar", "-o", str(tmp_path / "out")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    assert (tmp_path / "out" / "fourbar.html").stat().st_size > 100_000


def _closure(name: str) -> set[str]:
    """Distributions that an installation without extras brings, by their metadata."""
    from packaging.requirements import Requirement

    found: set[tuple[str, str]] = set()
    left = [(name, "")]
    while left:
        name, extra = left.pop()
        name = re.sub(r"[-_.]+", "-", name).lower()
        if (name, extra) in found:
            continue
        found.add((name, extra))
        try:
            requires = metadata.requires(name) or []
        except metadata.PackageNotFoundError:
            found.discard((name, extra))
            continue
        for wanted in map(Requirement, requires):
            if wanted.marker is None or wanted.marker.evaluate({"extra": extra}):
                left += [(wanted.name, e) for e in ("", *wanted.extras)]
    return {name for name, _ in found}


def test_one_version() -> None:
    assert mechlab.__version__ == PROJECT["version"] == metadata.version("mechanism-lab")
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.M)
    assert cited is not None and cited[1] == PROJECT["version"]
    assert f"## [{PROJECT['version']}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    archive = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    assert archive["version"] == PROJECT["version"] and archive["license"] == PROJECT["license"].lower()


def test_public_ci_covers_what_is_promised() -> None:
    """Every Python of the classifiers, the systems of the README, the oldest versions allowed."""
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    promised = {c.rpartition(" ")[2] for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)}
    assert promised == set(re.findall(r'"(3\.\d+)"', text))
    assert all(system in text for system in ("ubuntu-latest", "macos-latest", "windows-latest", "lowest-direct", ".ci/run"))
