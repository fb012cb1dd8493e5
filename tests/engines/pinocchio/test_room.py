"""The room keeps to itself: cheap to import, and it never talks to the other witnesses."""

import subprocess
import sys

import pytest


def loaded(code: str) -> set[str]:
    """Modules that are loaded after running `code` in a fresh interpreter."""
    text = f"import sys\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_room_costs_no_engine():
    assert "pinocchio" not in loaded("import mechlab.engines.pinocchio")


def test_it_imports_no_other_witness():
    names = loaded("from mechlab.engines.pinocchio import *")
    assert "pinocchio" in names and "mujoco" not in names
    assert not [n for n in names if n.startswith(("mechlab.engines.mujoco", "mechlab.analytic", "mechlab.catalog"))]


def test_integrate_knows_numpy_and_scipy_only():
    names = loaded("import mechlab.integrate")
    assert not {n.split(".")[0] for n in names} & {"pinocchio", "mujoco", "trimesh", "matplotlib"}
    rooms = {n.split(".")[1] for n in names if n.startswith("mechlab.")}
    assert rooms <= {"errors", "integrate"}


def test_unknown_names_are_told():
    import mechlab.engines.pinocchio  # noqa: F401

    room = sys.modules["mechlab.engines.pinocchio"]
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = room.nothing
    assert all(getattr(room, n) is not None for n in room.__all__)
