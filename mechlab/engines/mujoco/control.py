"""The engine's process-wide hooks, made safe: one control function per MjData, and warnings kept off the terminal.

MuJoCo has one control callback for the whole process. Here it only dispatches: it looks up the function that belongs to
the MjData it is called for, so runs in several threads do not see each other, and data without a function are passed on
to the callback that was there before. The engine calls it inside every evaluation of the equations of motion, hence at
all four stages of RK4, with the time and state of that stage.

MuJoCo cannot compile a model while a Python callback is set (the compiler makes a step of data that Python does not
know), so compiling waits for runs with laws in other threads to end, and they for it.

The callback is taken out when no `engine` block of this process is under way any more, not before: a thread that is
inside the engine at that moment would fail. Code that steps MuJoCo in other threads without `engine` takes that risk.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

from mechlab.errors import MechlabError

Controller = tuple[Callable[[], None], list[BaseException]]
"""What is called for a MjData, and what it has raised."""

_bare_lock = threading.RLock()
_lock = threading.Condition(_bare_lock)
_controllers: dict[int, Controller] = {}
_compiling = 0
_mine = threading.local()
_users = 0
_stepping: list[None] = []
_uninstalling = False
_installed = False
_previous_control: Any = None
_previous_warning: Any = None


@contextmanager
def engine() -> Iterator[None]:
    """Within the block the engine may be called from this thread; it neither prints its warnings nor writes them to
    MUJOCO_LOG.TXT."""
    _enter()
    try:
        yield
    finally:
        _leave()


@contextmanager
def compiling() -> Iterator[None]:
    """Within the block a model may be compiled: no control callback is set. Raises MechlabError inside `controlled`."""
    global _compiling
    if getattr(_mine, "controlled", 0):
        raise MechlabError("a force law cannot compile a MuJoCo model while it acts; make the model before the run.")
    with _lock:
        _lock.wait_for(lambda: not _installed)
        _compiling += 1
    try:
        with engine():
            yield
    finally:
        with _lock:
            _compiling -= 1
            _lock.notify_all()


@contextmanager
def controlled(data: mujoco.MjData, function: Callable[[], None]) -> Iterator[None]:
    """As `engine`; and the engine calls `function()` whenever it evaluates the equations of motion of `data`.

    What the function raises is kept, later calls do nothing, and the error is raised when the block ends: an exception
    must not cross the C code of the engine.
    """
    errors: list[BaseException] = []
    with engine():
        _install(data._address, (function, errors))
        _mine.controlled = getattr(_mine, "controlled", 0) + 1
        try:
            yield
        finally:
            _mine.controlled -= 1
            _controllers.pop(data._address, None)
            if errors:
                raise errors[0]


def begin_step() -> None:
    """From now until `end_step` this thread may step the engine: as `engine`, for callers that step one by one and have
    silenced the warnings of their MjData (`silence`). It takes a quarter of the time."""
    _stepping.append(None)
    if _uninstalling:  # it has read `_stepping` before this thread stood there, or will read it: wait for its end
        with _bare_lock:
            pass


def end_step() -> None:
    """See `begin_step`."""
    _stepping.pop()
    if _installed:
        with _bare_lock:
            _uninstall()


def silence(data: mujoco.MjData) -> None:
    """The engine prints a warning when it counts the first of its kind; from now on each kind counts from 1."""
    for warning in data.warning:
        warning.number = 1


def _dispatch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    found = _controllers.get(data._address)
    if found is not None:
        function, errors = found
        if not errors:
            try:
                function()
            except BaseException as error:  # also KeyboardInterrupt: it is raised at the end of the block
                errors.append(error)
    elif _previous_control is not None:
        _previous_control(model, data)


def _silent(message: str) -> None:
    """Print nothing: the engine's warnings are counted in MjData and reported in the health record."""


def _enter() -> None:
    global _users, _previous_warning
    with _lock:
        if _users == 0:
            _previous_warning = mujoco.get_mju_user_warning()
            mujoco.set_mju_user_warning(_silent)
        _users += 1


def _install(address: int, controller: Controller) -> None:
    global _installed, _previous_control
    with _lock:
        _lock.wait_for(lambda: not _compiling)
        _controllers[address] = controller
        if not _installed:
            _previous_control = mujoco.get_mjcb_control()
            mujoco.set_mjcb_control(_dispatch)
            _installed = True


def _leave() -> None:
    global _users, _previous_warning
    with _lock:
        _users -= 1
        if _users:
            return
        mujoco.set_mju_user_warning(_previous_warning)
        _previous_warning = None
        _uninstall()


def _uninstall() -> None:
    """Take the control callback out when nobody is inside the engine any more; the lock is held."""
    global _installed, _previous_control, _uninstalling
    _uninstalling = True
    try:
        if _users or _stepping:
            return
        if _installed:
            mujoco.set_mjcb_control(_previous_control)
        _installed, _previous_control = False, None
        _lock.notify_all()
    finally:
        _uninstalling = False
