"""Broken JSON, MJCF and URDF: whatever is changed, the readers answer with a mechanism or a MechlabError."""

import copy
import json
import random
import warnings
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from mechanism_zoo import arm, looped, planetary
from test_mjcf_read import ORDINARY
from test_urdf import ROBOT, chain

from mechlab.errors import MechlabError
from mechlab.formats import from_json, from_mjcf, from_urdf, to_json, to_mjcf, to_urdf

JUNK = [None, True, 0, -1, 1e308, "", "x", [], {}, [1], {"a": 1}, "1/0", "nan", "ground", "yaw"]
WORDS = [
    "",
    "x",
    "0",
    "-1",
    "1 2",
    "1e308",
    "nan",
    "inf",
    "1 0 0",
    "world",
    "base",
    "0 0 0",
    "true",
    "false",
    "disable",
]
TAGS = ["body", "joint", "geom", "foo", "link", "site"]


def places(value, path=()):
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


def read(reader, text):
    """True where the text is read, and what was read can be written; False for a MechlabError; anything else is raised."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numbers such as 1e308 overflow
        try:
            m = reader(text)
            assert from_json(to_json(m)) == m
            to_mjcf(m)
            to_urdf(m)
        except MechlabError:
            return False
    return True


def judge(reader, intact, bodies, broken_texts):
    """The intact file is read before, between and after its broken twins, always as the same mechanism of so many bodies.

    Of the broken ones a share is read, because what was changed does not matter or is another sound mechanism (a colour, a
    name, a length); a share is refused.
    """
    first = reader(intact)
    assert len(first.bodies) == bodies and first.joints
    found = []
    for k, broken in enumerate(broken_texts):
        found.append(read(reader, broken))
        if k % 10 == 0:
            assert reader(intact) == first
    assert 0.05 < np.mean(found) < 0.9


def broken_json(data):
    rng = random.Random(1)
    everywhere = [p for p in places(data) if p]
    for _ in range(200):
        broken, path = copy.deepcopy(data), rng.choice(everywhere)
        inside = broken
        for key in path[:-1]:
            inside = inside[key]
        if rng.random() < 0.2 and isinstance(inside, dict):
            del inside[path[-1]]
        else:
            inside[path[-1]] = rng.choice(JUNK)
        yield json.dumps(broken)


@pytest.mark.parametrize("make", [arm, planetary, lambda: looped("universal")])
def test_json(make):
    m = make()
    assert from_json(to_json(m)) == m
    judge(from_json, to_json(m), len(m.bodies), broken_json(json.loads(to_json(m))))


CASES = [
    (from_mjcf, ORDINARY, 6), (from_mjcf, to_mjcf(arm()), 4), (from_mjcf, to_mjcf(looped("cylindrical")), 4),
    (from_mjcf, to_mjcf(looped("revolute")), 4), (from_urdf, ROBOT.replace("TYPE", "revolute"), 2), (from_urdf, to_urdf(chain()), 4),
]  # fmt: skip
"""Reader, intact text, and the bodies that it has by hand (the two joints of `upper` turn about two points: one body more)."""


def broken_xml(text):
    rng = random.Random(2)
    for _ in range(150):
        root = ET.fromstring(text)
        element, kind = rng.choice(list(root.iter())), rng.random()
        if kind < 0.5 and element.attrib:
            element.set(rng.choice(list(element.attrib)), rng.choice(WORDS))
        elif kind < 0.6 and element.attrib:
            del element.attrib[rng.choice(list(element.attrib))]
        elif kind < 0.8 and len(element):
            element.remove(rng.choice(list(element)))
        elif kind < 0.9:
            element.append(copy.deepcopy(rng.choice(list(root.iter())[1:])))
        else:
            element.tag = rng.choice(TAGS)
        yield ET.tostring(root, encoding="unicode")


@pytest.mark.parametrize(("reader", "text", "bodies"), CASES)
def test_xml(reader, text, bodies):
    judge(reader, text, bodies, broken_xml(text))
