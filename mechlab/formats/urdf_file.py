"""A URDF file with the files beside it that close its loops -> ModelFile: mechanism, what is left out, what was decided.

Read beside NAME.urdf: our own NAME.json, then NAME.yaml or another YAML file of the folder that closes frames of this URDF
(robot.yaml), then loop_closures.yaml there or in config/. Without any of them, frames closing_X_1, closing_X_2 close.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from mechlab.errors import MechlabError, explained, unknown
from mechlab.experiment.model_file import LeftOut, ModelFile
from mechlab.formats.loops_yaml import RELAY, LoopsYaml, Pin, read_loops_yaml
from mechlab.formats.mjcf.source import clean
from mechlab.formats.urdf_assemble import StaysOpen, assemble
from mechlab.formats.urdf_fillers import without_fillers
from mechlab.formats.urdf_left_out import left_out, suspected
from mechlab.formats.urdf_loops import Closure, closing_frames, declared, in_parent, point_loop
from mechlab.formats.urdf_meshes import read_surfaces
from mechlab.formats.urdf_read import SWAPS, UNLIMITED, bodies_of, frames_of, ground_shapes_of, relations_of
from mechlab.formats.urdf_sidecar import whole_from_sidecar
from mechlab.formats.urdf_source import KINDS, UrdfText, number_of
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Placement, frame_along, unit
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Drive, Loop
from mechlab.mechanism.tree import depth_first
from mechlab.tables import counted, listed

BALL = re.compile(r"spherical|rotule", re.IGNORECASE)
"""Names of joints that an Extended URDF is to read as ball joints."""


@explained
def from_urdf(content: str) -> Mechanism:
    """The Mechanism in a URDF text, with the loops that the text itself declares, assembled; raises MechlabError that names
    what it cannot read. `read_urdf` reads the files beside it, too, and says what is left out."""
    return _built(UrdfText(content), [])[0]


def read_urdf(path: Path, content: str) -> ModelFile:
    """The URDF at a path, of this content, with the files beside it; raises MechlabError that names what it cannot read."""
    text = UrdfText(content)
    whole = whole_from_sidecar(path, content)
    if whole is not None:
        mechanism, note = whole
        return ModelFile(path, "URDF", mechanism, (), (note,) if note else ())
    text.surfaces, text.unread = read_surfaces(text.root, path.parent)
    found, notes = _companions(path, text)
    try:
        mechanism, left, more = _built(text, found)
    except StaysOpen as error:
        mechanism, left, more = _with_balls(text, found, error)
    return ModelFile(path, "URDF", mechanism, (*left_out(text), *left), (*text.notes, *notes, *more))


# -- the files beside ------------------------------------------------------------------------------------------------


def _companions(path: Path, text: UrdfText) -> tuple[list[LoopsYaml], list[str]]:
    """The YAML files that close this URDF, and sentences on those that close another one."""
    found: list[LoopsYaml] = []
    notes: list[str] = []
    for file in _yaml_files(path):
        loops = read_loops_yaml(file)
        if loops is None:
            continue
        missing = [n for n in _used(loops) if n not in text.links and n not in text.joints]
        if not missing:
            found.append(loops)
        elif file.stem in (path.stem, "robot") or file.name == RELAY:
            raise MechlabError(
                f"{file.name} beside it closes loops of other links: {listed(missing, 6)} {'is' if len(missing) == 1 else 'are'} not "
                f"in this URDF. Existing: {listed(sorted({*text.links, *text.joints}), 6)}."
            )
        else:
            notes.append(f"{file.name} beside it closes loops of another URDF and was not read")
    extended = [x for x in found if x.pairs]
    if len(extended) > 1:
        own = [x for x in extended if Path(x.name).stem == path.stem] or extended[:1]
        notes.append(f"{', '.join(x.name for x in extended if x is not own[0])} closes loops of this URDF, too; {own[0].name} was read")
        found = [x for x in found if x is own[0] or x not in extended]
    return found, notes


def _yaml_files(path: Path) -> Iterator[Path]:
    folder = path.parent
    if not folder.is_dir():
        return
    beside = sorted(p for p in folder.iterdir() if p.suffix.lower() in (".yaml", ".yml") and p.name != RELAY and p.is_file())
    yield from sorted(beside, key=lambda p: (p.stem != path.stem, p.stem != "robot", p.name))
    for place in (folder, folder / "config", folder.parent / "config", folder.parent):
        if (place / RELAY).is_file():
            yield place / RELAY
            return


def _used(loops: LoopsYaml) -> list[str]:
    names = [n for a, b, _ in loops.pairs for n in (a, b)] + [n for p in loops.pins for n in (p.link_a, p.link_b)]
    return list(dict.fromkeys(names))


# -- the mechanism ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Asked:
    """What the YAML files ask for: closures, joint types, motors; and sentences."""

    closures: list[Closure]
    swaps: dict[str, str]
    motors: list[str]
    left: list[LeftOut]
    notes: list[str]


def _built(text: UrdfText, files: Sequence[LoopsYaml]) -> tuple[Mechanism, tuple[LeftOut, ...], tuple[str, ...]]:
    asked = _asked(text, files)
    closures = [*declared(text), *asked.closures]
    if not closures:
        closures = closing_frames(text)
    closures = _unique(closures)
    given = bodies_of(text, asked.swaps)
    relations, drives = relations_of(text, asked.swaps), _drives(text, asked)
    used = [n for r in relations for n, _ in r.coefficients] + [d.on for d in drives]
    folded = without_fillers(given, [c.loop for c in closures], frames_of(text), used)
    parts: dict[str, object] = {
        "name": clean(text.root.get("name") or "robot"),
        "bodies": depth_first(folded.bodies),
        "loops": tuple(folded.loops),
        "relations": relations,
        "drives": drives,
        "frames": tuple(folded.frames),
        "ground_shapes": ground_shapes_of(text),
    }
    mechanism, notes = assemble(parts)
    parted = tuple(x for c in closures for x in c.left)
    left = [LeftOut("part of a joint that closes a loop", parted, "a loop has no limits or damping")] if parted else []
    if folded.lost:
        left.append(LeftOut("frame", tuple(folded.lost), "it stands between two joints that became a loop"))
    closed = {n for f in files for n in _used(f)} | {n for c in closures for n in (c.loop.name,)}
    seen = [] if closures else list(suspected(text, closed))
    return mechanism, (*asked.left, *left), (*_sources(closures), *asked.notes, *folded.notes, *notes, *seen)


def _with_balls(
    text: UrdfText, files: Sequence[LoopsYaml], error: StaysOpen
) -> tuple[Mechanism, tuple[LeftOut, ...], tuple[str, ...]]:
    """The mechanism with the joints that are called ball joints as such, where the loops of an Extended URDF close only so: its
    writers name them "spherical", and some leave them out of `joint_name`."""
    named = [n for n, j in text.joints.items() if BALL.search(n) and j.get("type") in ("revolute", "continuous")]
    names = [n for n in named if not any(n in f.swaps for f in files)]
    extended = [f for f in files if f.pairs]
    if not names or not extended:
        raise error
    balls = replace(extended[0], swaps=extended[0].swaps | dict.fromkeys(names, "SPHERICAL"))
    try:
        mechanism, left, notes = _built(text, [balls, *(f for f in files if f is not extended[0])])
    except MechlabError:
        raise error from None
    note = (
        f"as {balls.name} says it the loops do not close; they do with the {len(names)} joints that are called spherical as ball joints, "
        f"and so they were read. Say it there: joint_name: [{', '.join(names)}], joint_type: [SPHERICAL, one for each]"
    )
    return mechanism, left, (note, *notes)


def _asked(text: UrdfText, files: Sequence[LoopsYaml]) -> _Asked:
    out = _Asked([], {}, [], [], [])
    for file in files:
        for a, b, kind in file.pairs:
            out.closures.append(Closure(point_loop(text, _pair_name(a, b), a, b, file.name, kind), file.name))
        out.closures.extend(Closure(_pin_loop(text, pin, file.name), file.name) for pin in file.pins)
        for joint, swap in file.swaps.items():
            if swap not in SWAPS:
                raise unknown(f"{file.name}: joint_type of {joint}", swap, SWAPS)
            if joint not in text.joints or text.joints[joint] in text.closing:  # other readers of the format pass over it
                out.left.append(LeftOut(f"joint_type in {file.name}", (joint,), f"{no_joint(text, joint)}; it stays as it is"))
                continue
            out.swaps[joint] = swap
        for joint in file.motors:
            if joint in text.joints and text.joints[joint] not in text.closing:
                out.motors.append(joint)
            else:
                out.left.append(LeftOut(f"motor in {file.name}", (joint,), no_joint(text, joint)))
        if file.unread:
            out.left.append(LeftOut(f"key of {file.name}", file.unread, "mechlab does not read this key"))
    if out.swaps:
        changed = [f"{name} is {kind}" for name, kind in out.swaps.items()]
        source = next(f.name for f in files if f.swaps)
        out.notes.append(f"joints of another type than in the URDF, by {source}: {listed(changed, 6)}")
    return out


def no_joint(text: UrdfText, name: str) -> str:
    """Half a sentence on a joint that does not exist, with the likeliest one that does."""
    close = get_close_matches(name, text.joints, n=1)
    return "no joint of this URDF has that name" + (f", did you mean {close[0]!r}?" if close else "")


def _pair_name(a: str, b: str) -> str:
    """The common part of the two names: closedloop1_A, closedloop1_B close the loop closedloop1."""
    stem = ""
    for x, y in zip(a, b, strict=False):
        if x != y:
            break
        stem += x
    return clean(stem.rstrip("_-.")) if len(stem.rstrip("_-.")) >= 3 else clean(f"{a}_{b}")


def _pin_loop(text: UrdfText, pin: Pin, what: str) -> Loop:
    """The pin through a point along an axis, both in the root link in the zero pose."""
    axis = frame_along(np.array(unit(pin.axis, f"{what}: axis")))
    place = Placement.of(axis, np.array(pin.point))
    ends = []
    for link in (pin.link_a, pin.link_b):
        body, placement = text.place(link, what)
        ends.append((body, placement @ in_parent(text, link, text.ground) @ place))
    (body_a, first), (body_b, second) = ends
    return Loop(clean(f"{pin.link_a}_{pin.link_b}"), "revolute", body_a, body_b, first, second)


def _unique(closures: Sequence[Closure]) -> list[Closure]:
    """The closures with a name each; a second one of the same two ends falls away."""
    out: list[Closure] = []
    ends: set[tuple[object, ...]] = set()
    taken: set[str] = set()
    for closure in closures:
        loop = closure.loop
        key = (loop.kind, loop.body_a, loop.placement_a, loop.body_b, loop.placement_b)
        if key in ends:
            continue
        ends |= {key, (loop.kind, loop.body_b, loop.placement_b, loop.body_a, loop.placement_a)}
        name, k = loop.name, 2
        while name in taken:
            name, k = f"{loop.name}_{k}", k + 1
        taken.add(name)
        out.append(replace(closure, loop=replace(loop, name=name)))
    return out


def _drives(text: UrdfText, asked: _Asked) -> tuple[Drive, ...]:
    """A motor for each named joint that still has one coordinate; its limit is the joint's limit of effort."""
    out = []
    for name in dict.fromkeys(asked.motors):
        joint = text.joints[name]
        if name in asked.swaps or joint.get("type") not in KINDS:
            asked.notes.append(f"the motor {name!r} has no joint with one coordinate and was not made")
            continue
        limit = joint.find("limit")
        effort = 0.0 if limit is None else number_of(limit, "effort", 0.0)
        given = text.joint_names[name]
        out.append(Drive(given, given, limit=effort if 0.0 < effort < UNLIMITED else None))
    return tuple(out)


def _sources(closures: Sequence[Closure]) -> tuple[str, ...]:
    """A sentence on each source of loops."""
    groups: dict[str, list[Loop]] = {}
    for closure in closures:
        groups.setdefault(closure.source, []).append(closure.loop)
    return tuple(
        f"{counted(len(loops), 'loop')} closed by {source}: {listed([f'{x.name} ({x.kind})' for x in loops], 6)}"
        for source, loops in groups.items()
    )
