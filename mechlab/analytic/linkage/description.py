"""What a linkage is made of: elements with names, sizes and modes, each built on those before it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from mechlab.errors import MechlabError, unknown


@dataclass(frozen=True)
class Step:
    """One element of a linkage: kind, the names it uses and makes, its numbers, its mode (0: it has none)."""

    kind: str
    name: str
    uses: tuple[str, ...] = ()
    makes: tuple[str, ...] = ()
    sizes: tuple[Any, ...] = ()
    mode: int = 0


@dataclass(frozen=True)
class Description:
    """A chain of groups; every method returns a new one with one more. Raises MechlabError for names used twice."""

    name: str
    steps: tuple[Step, ...] = ()

    def pivot(self, name: str, x: float, y: float) -> Self:
        """A pin fixed to the ground at (x, y) [m]."""
        return self._with(Step("pivot", name, makes=(name,), sizes=(x, y)))

    def crank(self, name: str, pivot: str, pin: str, length: float) -> Self:
        """A driven link from `pivot` to the new `pin`: class I. Its input has the link's name."""
        return self._with(Step("crank", name, (pivot,), (name, pin), (length,)))

    def point(self, name: str, link: str, distance: float, angle: float = 0.0) -> Self:
        """A point of a link, `distance` from its first pin at `angle` from its direction."""
        return self._with(Step("point", name, (link,), (name,), (distance, angle)))

    def guide(self, name: str, x: float, y: float, angle: float = 0.0, offset: float = 0.0) -> Self:
        """A straight guide of the ground through (x, y), in the direction of `angle`."""
        return self._with(Step("guide", name, makes=(name,), sizes=(x, y, angle, offset)))

    def guide_on(self, name: str, link: str, angle: float = 0.0, offset: float = 0.0) -> Self:
        """A straight guide on a moving link, through its first pin, at `angle` from its direction."""
        return self._with(Step("guide_on", name, (link,), (name,), (angle, offset)))

    def rrr(
        self, joint: str, links: tuple[str, str], pins: tuple[str, str], lengths: tuple[float, float], mode: int = 1
    ) -> Self:
        """Dyad RRR: links[k] from pins[k] to the new `joint`; mode +1: the joint lies left of the way pins[0] -> pins[1]."""
        return self._with(Step("RRR", joint, pins, (*links, joint), lengths, mode))

    def rrp(self, joint: str, link: str, pin: str, guide: str, length: float, mode: int = 1) -> Self:
        """Dyad RRP: a rod from `pin` to the new `joint`, which slides along `guide`; the slide has the joint's name."""
        return self._with(Step("RRP", joint, (pin, guide), (link, joint), (length,), mode))

    def rpr(self, link: str, pivot: str, pin: str, offset: float = 0.0, mode: int = 1) -> Self:
        """Dyad RPR: a slotted link about `pivot` that guides `pin`; the slide has the link's name."""
        return self._with(Step("RPR", link, (pivot, pin), (link,), (offset,), mode))

    def prp(self, joint: str, guides: tuple[str, str]) -> Self:
        """Dyad PRP: the new `joint` where two guides cross; slides JOINT_1 and JOINT_2."""
        return self._with(Step("PRP", joint, guides, (joint,)))

    def rpp(self, name: str, pin: str, guide: str, angle: float) -> Self:
        """Dyad RPP: a cross slide at `angle` to a guide carries `pin`; slides NAME_1 along the guide, NAME_2 along the cross."""
        return self._with(Step("RPP", name, (pin, guide), (name,), (angle,)))

    def class_three(
        self, name: str, links: tuple[str, str, str, str], pins: tuple[str, str, str], legs: tuple[float, float, float],
        platform: tuple[complex, complex], mode: int = 1, joints: tuple[str, ...] = (),
    ) -> Self:  # fmt: skip
        """A platform (links[3]) on three legs from `pins`; `platform`: its 2nd and 3rd corner seen from the 1st, in its axes.
        joints: names of the corners (default NAME_1 to NAME_3).
        mode +n or -n: the n-th mode, in the order of the first leg's angle, of those with det J of that sign."""
        corners = joints or tuple(f"{name}_{k}" for k in (1, 2, 3))
        return self._with(Step("III", name, pins, (*links, *corners), (legs, platform), mode))

    def class_four(
        self, name: str, links: tuple[str, str, str, str], pins: tuple[str, str], first: tuple[complex, complex],
        second: tuple[complex, complex], lengths: tuple[float, float], mode: int = 1, joints: tuple[str, ...] = (),
    ) -> Self:  # fmt: skip
        """Two ternary links (links[0] on pins[0], links[1] on pins[1]) joined by links[2], links[3]; `first`, `second`: their
        two far joints in their own axes; `joints`: names of these four (default NAME_1 to NAME_4); mode as of `class_three`,
        in the order of the angle of links[0]."""
        four = joints or tuple(f"{name}_{k}" for k in (1, 2, 3, 4))
        return self._with(Step("IV", name, pins, (*links, *four), (first, second, lengths), mode))

    def _with(self, step: Step) -> Self:
        used = {n for s in self.steps for n in s.makes}
        for n in step.makes:
            if n in used:
                raise MechlabError(
                    f"linkage {self.name!r}: the name {n!r} is used twice; give every link and point its own."
                )
        if step.kind in ("RRR", "RRP", "RPR") and step.mode not in (1, -1):
            raise MechlabError(
                f"linkage {self.name!r}: {step.kind} {step.name!r}: mode must be +1 or -1, got {step.mode!r}."
            )
        return replace(self, steps=(*self.steps, step))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the driven links."""
        return tuple(s.name for s in self.steps if s.kind == "crank")

    def with_modes(self, modes: Mapping[str, int]) -> Self:
        """The same linkage with other modes, by name of the group; raises MechlabError that lists the groups."""
        names = {s.name for s in self.steps if s.mode}
        for name in modes:
            if name not in names:
                raise unknown(f"linkage {self.name!r}: group with modes", name, names)
        return replace(
            self, steps=tuple(replace(s, mode=modes.get(s.name, s.mode)) if s.mode else s for s in self.steps)
        )
