"""The list of MJCF's words against the installed MuJoCo. `python -m tests.formats.test_mjcf_schema` writes it anew."""

import re
import textwrap
from pathlib import Path

import mujoco
import pytest

from mechlab.formats.mjcf import schema
from mechlab.formats.mjcf.schema import words

FILE = Path(schema.__file__).with_name("schema.txt")
ELEMENT = re.compile(r"(?P<space> *)(?:\(world\))?(?P<tag>\w+) \((?P<times>[!?*R])\) *(?P<attributes>.*)")
STEP = 3
"""Blanks by which mj_printSchema indents a child."""


def short_form(printed):
    """The text of schema.txt from that of mj_printSchema: an element a line, indented by one blank a level, with its attributes."""
    lines = []
    for line in filter(str.strip, printed.splitlines()):
        found = ELEMENT.fullmatch(line)
        if found:
            depth = len(found["space"]) // STEP
            lines.append(" ".join([" " * depth + found["tag"], *found["attributes"].split()]))
        else:
            lines[-1] += " " + " ".join(line.split())  # a line of more attributes
    return "".join(f"{line}\n" for line in lines)


def test_the_words_are_those_of_the_installed_mujoco():
    installed = short_form(mujoco.mj_printSchema(False, False)).splitlines()
    ours = FILE.read_text(encoding="ascii").splitlines()
    other = sorted(set(installed) ^ set(ours))
    advice = (
        f"MuJoCo {mujoco.__version__} has other elements or attributes than {FILE.name}: write it anew with "
        "`python -m tests.formats.test_mjcf_schema`, and name the version in schema.py."
    )
    assert ours == installed, "\n".join([advice, *(textwrap.shorten(line, 200) for line in other[:10])])


@pytest.mark.parametrize(("tag", "below"), [("joint", ("body",)), ("geom", ("body",)), ("motor", ("actuator",)), ("option", ())])
def test_mujoco_takes_every_word_of_an_element_and_no_other(tag, below):
    """The engine's own parser as the second source: it refuses a word that is not in the list, and knows those in it."""
    known = words()
    for parent in below:
        known = known.children[parent]
    for attribute in sorted(known.children[tag].attributes | {"nonsense"}):
        element = f'<{tag} {attribute}="x"/>'
        for parent in reversed(below):
            element = f"<{parent}>{element}</{parent}>"
        inside = element.replace("body>", "worldbody>") if below == ("body",) else element
        try:
            mujoco.MjModel.from_xml_string(f"<mujoco>{inside}</mujoco>")
            refused = ""
        except ValueError as error:
            refused = str(error)
        assert ("unrecognized attribute" in refused) == (attribute == "nonsense"), (attribute, refused)


if __name__ == "__main__":
    FILE.write_text(short_form(mujoco.mj_printSchema(False, False)), encoding="ascii")
