"""The project as a whole: the README's promises, the order of the rooms, no engine before it is needed."""

import ast
import re
import subprocess
import sys
from collections.abc import Container, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "mechlab"

# Top to bottom, as in the design: a room imports only rooms above it.
ROOMS = (
    "on_demand", "lazy_dataclass", "errors", "algebra_threads", "clock", "files", "processes", "progress", "units", "values", "tables",
    "results", "analytic", "integrate", "mechanism", "shapes", "experiment", "formats", "engines", "kit", "catalog", "lab",
    "studies", "viewer", "api", "cli",
)  # fmt: skip
# The lab and its studies know entries, not the catalog. Engines know no closed form: witnesses must not talk before the trial.
STRANGERS = {"engines": {"analytic"}, "lab": {"catalog"}, "studies": {"catalog"}}
ENGINES = {
    "pinocchio": {"pinocchio", "coal"},
    "mujoco": {"mujoco"},
    "own": set(),
    "peers": {"exudyn", "pydrake", "opensim", "mujoco_warp", "warp", "newton", "pylinkage"},
}
"""Folders of `engines/`, which do not import each other, and the packages that each of them alone may import."""
NUMPY_AND_SCIPY_ALONE = ("analytic", "integrate", "mechanism", "formats")
HEAVY = ("pinocchio", "mujoco", "meshcat", "trimesh", "yourdfpy", "matplotlib", "rich", "scipy", "numpy")


def room_files(room: str) -> list[Path]:
    folder = PACKAGE / room
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [p for p in [PACKAGE / f"{room}.py"] if p.exists()]


def imported(path: Path) -> Iterator[tuple[str, int]]:
    """Full names of everything that a file imports, at any depth of its code, with the line."""
    package = path.relative_to(ROOT).with_suffix("").parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((f"{module}.{alias.name}", node.lineno) for alias in node.names)


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def owning_module(name: str, modules: Container[str]) -> str:
    """The file behind the full name of what is imported; empty where it is none of ours."""
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name


def rooms_imported(path: Path) -> Iterator[tuple[str, int]]:
    for name, line in imported(path):
        first, _, rest = name.partition(".")
        if first == "mechlab":
            yield rest.split(".")[0], line


def run_python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=300)


def text_files() -> list[Path]:
    """What git tracks or would track. Skips where there is no git, as in an unpacked archive."""
    try:
        listing = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT, capture_output=True, text=True, check=True,
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    paths = [ROOT / name for name in listing.stdout.split("\0") if name]
    return [p for p in paths if p.is_file() and b"\0" not in p.read_bytes()[:4096]]


def readme_command(name: str) -> str:
    """The command below a marker of the README; .ci/run finds it the same way and runs it."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(rf"^<!-- command: {name} -->\n(?:[^`].*\n|\n)*```sh\n(.*?)^```$", text, re.M | re.S)
    assert len(blocks) == 1, f"README.md needs one fenced sh block below <!-- command: {name} -->"
    return str(blocks[0]).strip()


def test_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) < 100


def test_readme_has_two_set_up_commands_install_included() -> None:
    commands = [readme_command("run"), readme_command("test")]
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    set_up = [line for line in text.splitlines() if re.search(r"\bpip3? install\b|-m venv\b", line)]
    assert set_up == commands  # each on one line, and no third
    assert all("-m venv" in command and "pip install" in command for command in commands)
    assert "mechlab run " in commands[0] and "pytest" in commands[1]


def test_ci_runs_the_commands_of_the_readme() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "readme_command run" in script and "readme_command test" in script
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o100
    found = re.search(r"^readme_command\(\) \{.*?^\}$", script, re.M | re.S)
    assert found is not None
    for name in ("run", "test"):
        call = ["bash", "-c", f"{found[0]}\nreadme_command {name}"]
        printed = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
        assert printed == readme_command(name)


def test_every_room_is_in_the_list() -> None:
    found = {p.stem for p in PACKAGE.iterdir() if p.suffix == ".py" or (p.is_dir() and any(p.rglob("*.py")))}
    assert found - {"__init__", "__main__"} <= set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_rooms_above_it(room: str) -> None:
    allowed = {*ROOMS[: ROOMS.index(room) + 1]} - STRANGERS.get(room, set())
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {other}"
        for path in room_files(room)
        for other, line in rooms_imported(path)
        if other in ROOMS and other not in allowed
    ]
    assert not wrong


@pytest.mark.parametrize("engine", ENGINES)
def test_engines_do_not_know_each_other(engine: str) -> None:
    others = tuple(f"mechlab.engines.{other}." for other in ENGINES if other != engine)
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in room_files(f"engines/{engine}")
        for name, line in imported(path)
        if f"{name}.".startswith(others)
    ]
    assert not wrong


def test_an_engine_stays_in_its_room() -> None:
    owner = {package: engine for engine, packages in ENGINES.items() for package in packages}
    # MuJoCo Warp is fed a compiled MjModel, as a peer in charts and as the way of our own models to a GPU
    fed = [("mujoco", PACKAGE / "engines" / "peers" / "mujoco_warp.py"), ("peers", PACKAGE / "engines" / "mujoco" / "warp_steps.py")]
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for name, line in imported(path)
        if (home := owner.get(name.split(".")[0])) and PACKAGE / "engines" / home not in path.parents
        if (home, path) not in fed
    ]
    assert not wrong


def test_no_circle_of_files() -> None:
    """Imports inside functions count: a circle that hides there is a circle."""
    modules = {module_name(path): path for path in PACKAGE.rglob("*.py")}
    edges = {
        module: {
            target
            for name, _ in imported(path)
            for target in [owning_module(name, modules)]
            if target not in ("", module)
        }
        for module, path in modules.items()
    }
    order = TopologicalSorter(edges)
    try:
        order.prepare()
    except CycleError as circle:
        raise AssertionError(" -> ".join(circle.args[1])) from None


@pytest.mark.parametrize("room", NUMPY_AND_SCIPY_ALONE)
def test_a_room_imports_with_numpy_and_scipy_alone(room: str) -> None:
    files = [path.relative_to(ROOT).with_suffix("") for path in room_files(room)]
    if not files:
        pytest.skip(f"there is no {room} yet")
    modules = [".".join(file.parts).removesuffix(".__init__") for file in files]
    done = run_python(
        "import importlib, sys\n"
        "class Blocker:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        own = {*sys.stdlib_module_names, 'numpy', 'scipy', 'mechlab'}\n"
        "        if name.split('.')[0] not in own and not name.startswith('_sysconfigdata'):\n"
        "            raise ModuleNotFoundError(f'blocked: {name}', name=name)\n"
        "sys.meta_path.insert(0, Blocker())\n"
        f"for module in {modules!r}:\n"
        "    importlib.import_module(module)\n"
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "code",
    [
        "import mechlab",
        "from mechlab.cli import main; assert main(['--help']) == 0",
        "from mechlab.cli import main; assert main(['solve', '--help']) == 0",
    ],
)
def test_no_engine_is_imported_before_it_is_needed(code: str) -> None:
    done = run_python(
        f"{code}\nimport sys\nassert not {{*sys.modules}} & {{*{HEAVY!r}}}, {{*sys.modules}} & {{*{HEAVY!r}}}"
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("verb", [["list"], ["show", "fourbar"], ["show", "delta6"]])
def test_list_and_show_need_numpy_alone(verb: list[str]) -> None:
    """Importing scipy costs more than the whole command."""
    done = run_python(
        f"from mechlab.cli import main; assert main({verb!r}) == 0\n"
        f"import sys\nfound = {{*sys.modules}} & {{'scipy', 'trimesh', 'matplotlib', 'mujoco', 'pinocchio'}}; assert not found, found"
    )
    assert done.returncode == 0, done.stderr


def test_no_local_paths_and_no_registry_addresses() -> None:
    local = re.compile(r"(?<![\w.}])/(?:work|root|home|Users|farm|opt/ml|tmp/\w+)/|[A-Z]:\\\\?Users")
    registry = re.compile(r"\b(?:files\.)?(?:pypi|pythonhosted|npmjs)\.org\b")
    wrong = []
    for path in text_files():
        if path.suffix in (".html", ".svg") or path == Path(__file__).resolve():
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
            if local.search(line) or registry.search(line):
                wrong.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    assert not wrong
