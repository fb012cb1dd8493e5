"""MuJoCo's own web viewer (running, pushing bodies, stepping back). It opens its port to the whole network; a warning says so."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from typing import Any

from mechlab.errors import EngineMissing

WARNING = (
    "warning: MuJoCo's web viewer listens on ALL network interfaces, without a password: everybody who can reach this "
    "computer can move the model and send it files. Use it on a network you trust, or behind a firewall; `mechlab view "
    "NAME` without --studio stays on this computer."
)


def open_studio(scene: str | os.PathLike[str], title: str) -> None:
    """Serves MuJoCo's web viewer with the model file `scene` until it is closed or interrupted; prints WARNING on stderr.

    Raises EngineMissing where MuJoCo is missing or older than 4.0, which brought this viewer.
    """
    launcher, protocol, app = _studio_modules()
    mujoco = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_path(str(Path(scene)))
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    print(WARNING, file=sys.stderr, flush=True)
    config = protocol.ViewerConfig(title=title, gfx="web")
    launcher.run(config, model=model, data=data, plugins=[app.App(), *app.SIM_PLUGINS])


def _studio_modules() -> tuple[Any, Any, Any]:
    try:
        names = ("launch_web", "viewer_protocol", "app")
        launcher, protocol, app = (importlib.import_module(f"mujoco.studio.{name}") for name in names)
    except ImportError as error:
        raise EngineMissing(
            f"MuJoCo's web viewer needs mujoco 4.0 or later ({error}). Try: pip install 'mujoco>=4.0'"
        ) from error
    return launcher, protocol, app
