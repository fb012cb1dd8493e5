"""Fixtures of the studies."""

from pathlib import Path

import pytest

from tests.studies.swinging import SWING


@pytest.fixture
def swing(tmp_path: Path) -> str:
    file = tmp_path / "swing.py"
    file.write_text(SWING)
    return f"{file}:swing"
