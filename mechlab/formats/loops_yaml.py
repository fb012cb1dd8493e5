"""The YAML files that say beside a URDF where its loops close.

* Extended URDF (arXiv 2504.04767, toolbox-parallel-robots): `closed_loop`, pairs of frames; `type`, "6d" (the frames coincide) or
  "3d" (their origins do); `name_mot`, the joints with motors; `joint_name`, `joint_type`, joints that are of another type.
* `loop_closures.yaml` (scikit-robot): `closures`, each with `link_a`, `link_b`, `point` and `axis` of the pin in the root link
  in the zero pose; `independent`, the joints that drive.
"""

from __future__ import annotations

import re
from dataclasses import field
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.formats.model_text import read_text
from mechlab.lazy_dataclass import dataclass
from mechlab.values import short

TYPES = {"3d": "spherical", "6d": "fixed"}
KEYS = ("closed_loop", "type", "name_mot", "joint_name", "joint_type")
RELAY_KEYS = ("closures", "dependent", "independent")
RELAY = "loop_closures.yaml"
LARGEST = 4_000_000
"""Most characters of a YAML file that are read."""
PLAIN = re.compile(r"[A-Za-z_][\w./-]*")
RESERVED = {"y", "n", "yes", "no", "on", "off", "true", "false", "null", "none"}
_Number = int | float


@dataclass(frozen=True)
class Pin:
    """A closure of `loop_closures.yaml`: the two links turn about an axis through a point, both in the root link [m]."""

    link_a: str
    link_b: str
    point: tuple[float, ...]
    axis: tuple[float, ...]


@dataclass(frozen=True)
class LoopsYaml:
    """What a YAML file says of a URDF. pairs: (frame, frame, kind of loop); swaps: joint -> type."""

    name: str
    pairs: tuple[tuple[str, str, str], ...] = ()
    pins: tuple[Pin, ...] = ()
    motors: tuple[str, ...] = ()
    swaps: dict[str, str] = field(default_factory=dict)
    unread: tuple[str, ...] = ()


def read_loops_yaml(path: Path) -> LoopsYaml | None:
    """What a YAML file says of the loops of a URDF; None for a YAML file on something else. Raises MechlabError that names
    the file and the key."""
    content = read_text(path)
    if "closed_loop" not in content and "closures" not in content:
        return None
    return loops_of(content, path.name)


def loops_of(content: str, name: str) -> LoopsYaml | None:
    """As `read_loops_yaml`, of a text."""
    data = _yaml(content, name)
    if not isinstance(data, dict):
        return None
    if "closures" in data:
        return _relay(data, name)
    if "closed_loop" not in data:
        return None
    pairs = _pairs(data["closed_loop"], name)
    kinds = _types(data, len(pairs), name)
    joints, types = _names(data, "joint_name", name), _names(data, "joint_type", name)
    if len(joints) != len(types):
        raise MechlabError(f"{name}: joint_name has {len(joints)} entries, joint_type {len(types)}; they belong together.")
    return LoopsYaml(
        name,
        tuple((a, b, k) for (a, b), k in zip(pairs, kinds, strict=True)),
        motors=_names(data, "name_mot", name),
        swaps=dict(zip(joints, types, strict=True)),
        unread=tuple(str(k) for k in data if k not in KEYS),
    )


def _yaml(content: str, name: str) -> Any:
    import yaml  # 20 ms that other verbs need not pay

    if len(content) > LARGEST:
        raise MechlabError(f"{name}: more than {LARGEST} characters; a list of loops is shorter.")
    try:
        tokens = [type(t).__name__ for t in yaml.scan(content, Loader=yaml.SafeLoader)]
        if "AliasToken" in tokens:  # a few of them nested say more than a memory holds
            raise MechlabError(f"{name}: aliases (*name) are not read; write the value out.")
        return yaml.load(content, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        where = getattr(error, "problem_mark", None)
        line = f", line {where.line + 1}" if where is not None else ""
        raise MechlabError(f"{name}{line}: this is not YAML: {getattr(error, 'problem', None) or type(error).__name__}.") from None


def _pairs(value: Any, name: str) -> list[tuple[str, str]]:
    if not isinstance(value, list) or not all(
        isinstance(p, list) and len(p) == 2 and all(isinstance(x, str) for x in p) for p in value
    ):
        raise MechlabError(f"{name}: closed_loop must be a list of pairs of names, [[frame, frame], ...], got {short(value)}.")
    return [(p[0], p[1]) for p in value]


def _types(data: dict[str, Any], count: int, name: str) -> list[str]:
    given = _names(data, "type", name) or ("6d",) * count  # the writers of the format do the same
    if len(given) != count:
        raise MechlabError(f"{name}: closed_loop has {count} entries, type {len(given)}; they belong together.")
    for kind in given:
        if kind.lower() not in TYPES:
            raise unknown(f"{name}: type", kind, TYPES)
    return [TYPES[k.lower()] for k in given]


def _names(data: dict[str, Any], key: str, name: str) -> tuple[str, ...]:
    value = data.get(key) or []
    if not isinstance(value, list) or not all(isinstance(x, str) for x in value):
        raise MechlabError(f"{name}: {key} must be a list of names, got {short(value)}.")
    return tuple(value)


def _relay(data: dict[str, Any], name: str) -> LoopsYaml:
    pins = []
    closures = data["closures"] or []
    if not isinstance(closures, list):
        raise MechlabError(f"{name}: closures must be a list, got {short(closures)}.")
    for k, item in enumerate(closures):
        what = f"{name}: closures[{k}]"
        if not isinstance(item, dict):
            raise MechlabError(f"{what} must have link_a, link_b, point and axis, got {short(item)}.")
        for key in ("link_a", "link_b"):
            if not isinstance(item.get(key), str):
                raise MechlabError(f"{what}: {key} must be the name of a link, got {short(item.get(key))}.")
        pins.append(Pin(item["link_a"], item["link_b"], _vector(item, "point", what), _vector(item, "axis", what)))
    unread = tuple(str(k) for k in data if k not in RELAY_KEYS)
    return LoopsYaml(name, pins=tuple(pins), motors=_names(data, "independent", name), unread=unread)


def _vector(item: dict[str, Any], key: str, what: str) -> tuple[float, ...]:
    value = item.get(key)
    if not isinstance(value, list) or len(value) != 3 or not all(isinstance(x, _Number) for x in value):
        raise MechlabError(f"{what}: {key} must be three numbers, got {short(value)}.")
    return tuple(float(x) for x in value)


def extended_yaml(pairs: list[tuple[str, str, str]], motors: list[str], swaps: dict[str, str]) -> str:
    """The YAML text of an Extended URDF; the kinds of the pairs are "3d" or "6d"."""
    lines = [
        f"closed_loop: [{', '.join(f'[{_word(a)}, {_word(b)}]' for a, b, _ in pairs)}]",
        f"type: [{', '.join(_word(k) for _, _, k in pairs)}]",
        f"name_mot: [{', '.join(map(_word, motors))}]",
        f"joint_name: [{', '.join(map(_word, swaps))}]",
        f"joint_type: [{', '.join(map(_word, swaps.values()))}]",
    ]
    return "\n".join(lines) + "\n"


def _word(name: str) -> str:
    return name if PLAIN.fullmatch(name) and name.lower() not in RESERVED else "'" + name.replace("'", "''") + "'"
