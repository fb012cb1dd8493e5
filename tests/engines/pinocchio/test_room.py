"""The room keeps to itself: cheap to import, and it never talks to the other witnesses."""

import subprocess
import sys


def said(code: str) -> str:
    """What `code` prints in a fresh interpreter."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


def loaded(code: str) -> set[str]:
    """Modules that are loaded after running `code` in a fresh interpreter."""
    return set(said(f"import sys\n{code}\nprint('\\n'.join(sys.modules))").split())


def test_importing_the_room_costs_no_engine():
    assert "pinocchio" not in loaded("import mechlab.engines.pinocchio")


def test_it_imports_no_other_witness():
    names = loaded("import mechlab.engines.pinocchio.engine")
    assert "pinocchio" in names and "mujoco" not in names
    assert not [n for n in names if n.startswith(("mechlab.engines.mujoco", "mechlab.analytic", "mechlab.catalog"))]


def test_integrate_knows_numpy_and_scipy_only():
    names = loaded("import mechlab.integrate")
    assert not {n.split(".")[0] for n in names} & {"pinocchio", "mujoco", "trimesh", "matplotlib"}
    rooms = {n.split(".")[1] for n in names if n.startswith("mechlab.")}
    assert rooms <= {"errors", "integrate", "lazy_dataclass", "on_demand"}


def test_an_engine_that_is_not_installed_says_what_to_install():
    code = "import sys; sys.modules['pinocchio'] = None\n"
    code += "from mechlab.engines.protocol import available\nprint(available('pinocchio'))"
    assert "`pip install pin`" in said(code)
