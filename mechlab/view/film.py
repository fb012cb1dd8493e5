"""A film of a Story: frames by MuJoCo's renderer without a window, MP4 (H.264) by ffmpeg."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import EngineMissing, MechlabError
from mechlab.files import unfinished
from mechlab.view.picture import Drawing
from mechlab.view.story import Story
from mechlab.view.tempo import tempo

FPS = 30
SAMPLES = 2
MOST_EDGES = 1500
MOST_FRAMES = 3600
SLOW_MOTION_SECONDS = 15.0

Progress = Callable[[int, int], None]


def write_mp4(
    story: Story,
    path: str | os.PathLike[str],
    size: tuple[int, int] = (960, 720),
    fps: int = FPS,
    speed: float | None = None,
    toward: tuple[float, float, float] | None = None,
    progress: Progress = lambda done, total: None,
) -> Path:
    """Writes a film of the whole story and returns the path, whole or not at all.

    size: width, height [pixels], even; speed: seconds of the story in a second of the film (default: `film_span`,
    which slows down what the eye could not follow, and then shows the beginning);
    toward: as of `write_png`; progress(done, total) is told every frame.
    Raises EngineMissing where ffmpeg, MuJoCo or its system library is missing; MechlabError for a story that does not
    move, odd sizes, or a film of more than 3600 frames.
    """
    encoder = find_ffmpeg()
    if len(story.t) < 2:
        raise MechlabError(f"story {story.title!r} does not move; a film needs at least two recorded times.")
    if size[0] % 2 or size[1] % 2 or min(size) < 16:
        raise MechlabError(f"size: width and height of a film must be even and at least 16, got {size}.")
    if fps <= 0 or (speed is not None and not speed > 0):
        raise MechlabError(f"speed and fps must be positive, got {speed!r} and {fps!r}.")
    pace, end = film_span(story, fps)
    if speed is not None:
        pace, end = speed, float(story.t[-1])
    count = 1 + int(np.floor((end - story.t[0]) / pace * fps + 1e-9))
    if count > MOST_FRAMES:
        raise MechlabError(
            f"the film would have {count} frames, the limit is {MOST_FRAMES}: give a higher speed than {pace:g}."
        )
    times = story.t[0] + np.arange(count) * pace / fps

    def frames() -> Iterable[NDArray[np.uint8]]:
        with Drawing(story, size, toward, most_edges=MOST_EDGES) as drawing:
            for k, time in enumerate(times):
                frame = story.frame(float(time))
                yield drawing.draw(frame, SAMPLES, upto=frame, sun=0.0)
                progress(k + 1, count)

    return _encode(encoder, frames(), Path(path), size, fps)


def film_span(story: Story, fps: int = FPS) -> tuple[float, float]:
    """(speed, last time [s]) of a film without a given speed: slow motion ends after SLOW_MOTION_SECONDS of film."""
    pace = tempo(story, fps).speed
    end = float(story.t[-1])
    return pace, min(end, float(story.t[0]) + SLOW_MOTION_SECONDS * pace) if pace < 1.0 else end


def film_sentence(story: Story, fps: int = FPS) -> str:
    """What a film without a given speed shows, in words; "" when it shows the whole story at its own pace."""
    pace, end = film_span(story, fps)
    if end < story.t[-1]:
        return f"The film shows the first {end - story.t[0]:.3g} s at {pace:g}\u00d7. {tempo(story, fps).sentence}"
    return tempo(story, fps).sentence


def find_ffmpeg() -> str:
    """The ffmpeg of this system, or the one that imageio-ffmpeg brings. Raises EngineMissing that says how to get one."""
    found = shutil.which("ffmpeg")
    if found:
        return found
    try:
        return str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise EngineMissing(
            "A film is encoded by ffmpeg, which was not found. Try: pip install 'mechlab[film]' (imageio-ffmpeg), "
            "or install the system package ffmpeg."
        ) from error


def _encode(encoder: str, frames: Iterable[NDArray[np.uint8]], path: Path, size: tuple[int, int], fps: int) -> Path:
    with unfinished(path) as film, tempfile.TemporaryFile() as complaints:
        command = [
            encoder, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}",
            "-r", str(fps), "-i", "-", "-an", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
            "-movflags", "+faststart", "-f", "mp4", str(film),
        ]  # fmt: skip
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=complaints) as process:
            assert process.stdin is not None
            try:
                for frame in frames:
                    process.stdin.write(frame.tobytes())
                process.stdin.close()
            except BrokenPipeError:
                pass  # ffmpeg has ended; its own words follow
            except BaseException:
                process.kill()
                raise
        complaints.seek(0)
        words = complaints.read().decode("utf-8", "replace").strip()
        if process.returncode:
            raise MechlabError(f"ffmpeg ({encoder}) failed with code {process.returncode}: {words}")
    return path
