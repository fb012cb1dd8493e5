"""The engine's process-wide hooks, made safe: one control function per MjData, and warnings kept off the terminal.

MuJoCo has one control callback for the whole process. Here it only dispatches: it looks up the function that belongs to
the MjData it is called for, so runs in several threads do not see each other, and data without a function are passed on
to the callback that was there before. The engine calls it inside every evaluation of the equations of motion, hence at
all four stages of RK4, with the time and state of that stage.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

_lock = threading.Lock()
_controllers: dict[int, Callable[[], None]] = {}
_previous_control: Any = None
_quiet = 0
_previous_warning: Any = None


def _dispatch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    function = _controllers.get(data._address)
    if function is not None:
        function()
    elif _previous_control is not None:
        _previous_control(model, data)


@contextmanager
def controlled(data: mujoco.MjData, function: Callable[[], None]) -> Iterator[None]:
    """Within the block the engine calls `function()` whenever it evaluates the equations of motion of `data`.

    What the function raises is kept, later calls do nothing, and the error is raised when the block ends: an exception
    must not cross the C code of the engine. The callback is unregistered in any case.
    """
    global _previous_control
    errors: list[BaseException] = []

    def guarded() -> None:
        if errors:
            return
        try:
            function()
        except BaseException as error:  # also KeyboardInterrupt: it is raised at the end of the block
            errors.append(error)

    with _lock:
        if not _controllers:
            _previous_control = mujoco.get_mjcb_control()
            mujoco.set_mjcb_control(_dispatch)
        _controllers[data._address] = guarded
    try:
        yield
    finally:
        with _lock:
            del _controllers[data._address]
            if not _controllers:
                mujoco.set_mjcb_control(_previous_control)
                _previous_control = None
        if errors:
            raise errors[0]


def _silent(message: str) -> None:
    """The engine's warnings are counted in MjData and told in the health record."""


@contextmanager
def quiet() -> Iterator[None]:
    """Within the block the engine neither prints its warnings nor writes them to MUJOCO_LOG.TXT."""
    global _quiet, _previous_warning
    with _lock:
        if _quiet == 0:
            _previous_warning = mujoco.get_mju_user_warning()
            mujoco.set_mju_user_warning(_silent)
        _quiet += 1
    try:
        yield
    finally:
        with _lock:
            _quiet -= 1
            if _quiet == 0:
                mujoco.set_mju_user_warning(_previous_warning)
                _previous_warning = None
