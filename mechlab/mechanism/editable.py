"""The parts of a mechanism under construction, and what changes, renames, removes or attaches them."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

from mechlab.errors import MechlabError
from mechlab.mechanism import edit
from mechlab.mechanism.attach import MakesMechanism, attach
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.given import Number, si
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body
from mechlab.tables import counted


class Editable(edit.Parts):
    """Lists of parts, and the methods that edit them; each returns the object itself."""

    def __repr__(self) -> str:
        parts = {"loop": len(self.loops), "relation": len(self.meshes), "curve": len(self.curves), "drive": len(self.drives)}
        found = [counted(len(self.bodies), "body", "bodies"), *(counted(n, one) for one, n in parts.items() if n)]
        return f"Builder of {self.name}: {', '.join(found)}; .build() or .assemble(guess) makes the Mechanism"

    def change_body(self, name: str, /, *, mass: Number | None = None, **fields: object) -> Self:
        """Change a body: fields as of `Body` (parent, placement, joints, inertia, shapes); `mass` [kg] scales its inertia.

        Raises MechlabError for a body or field that does not exist, or a mass for a body without inertia.
        """
        if mass is not None:
            what = f"{self.name}: body {name!r}: mass"
            part = edit.find(self, name, "body")[1]
            assert isinstance(part, Body)
            old = part.inertia
            if "inertia" in fields or not old.mass:
                raise MechlabError(
                    f"{what}: it has no inertia to scale, or gets another: give inertia=Inertia(...) alone."
                )
            ratio = (m := si(mass, what, "kg", low=0.0)) / old.mass
            xx, yy, zz, xy, xz, yz = (ratio * x for x in old.tensor)
            fields["inertia"] = replace(old, mass=m, tensor=(xx, yy, zz, xy, xz, yz))
        edit.change(self, name, "body", fields)
        return self

    def change(self, name: str, /, *, kind: str | None = None, **fields: object) -> Self:
        """Change fields of any part, as of its dataclass: `change("crank", kind="drive", limit=5.0)`. `kind` (body, joint,
        loop, relation, shaft, spring, drive, frame, curve) where several parts have the name.

        Raises MechlabError for a name or field that does not exist. Another name: `rename`.
        """
        edit.change(self, name, kind, fields)
        return self

    def rename(self, old: str, new: str, kind: str | None = None) -> Self:
        """Give a part another name, and everything that refers to it. Raises MechlabError for a name that is taken."""
        edit.rename(self, old, new, kind)
        return self

    def remove(self, name: str, kind: str | None = None, *, with_dependents: bool = False) -> Self:
        """Take a part away; a body whose joint is removed is welded to its parent. `with_dependents`: also everything that
        stands on it. Raises MechlabError that lists what does, otherwise."""
        edit.remove(self, name, kind, with_dependents)
        return self

    def attach(
        self, other: Mechanism | MakesMechanism, at: str = GROUND, prefix: str = "", turned: Placement = IDENTITY
    ) -> Self:
        """Attach another mechanism (a Mechanism, or a Design at its default fidelity) with its ground at a frame or a body
        of this one, placed by `turned` in it. All its names get the prefix; gravity stays that of this mechanism.

        Raises MechlabError for a name that exists already (give a prefix), and for a frame or body that does not exist.
        """
        attach(self, other, at, prefix, turned)
        return self
