"""The motion of a Story as a film (MP4, H.264 by ffmpeg, frames by MuJoCo's renderer), and as plots for print (SVG)."""

from __future__ import annotations

import importlib
import io
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import EngineMissing, MechlabError, install_extra
from mechlab.files import unfinished, write
from mechlab.viewer.framing import tempo
from mechlab.viewer.picture import Drawing
from mechlab.viewer.story import Array, Story

FPS = 30
SAMPLES = 2  # pictures averaged in a frame
MOST_EDGES = 1500
MOST_FRAMES = 3600
SLOW_MOTION_SECONDS = 15.0  # length of a film in slow motion

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
    """Writes a film of the story, whole or not at all, and returns the path.

    size: width, height [pixels], even; speed: seconds of the story in a second of the film (default: by `film_span`,
    slow motion of the beginning where the motion is too fast to see);
    toward: as of `write_png`; progress(done, total) is called after every frame.
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
    """Sentence on speed and length of a film without a given speed; "" for the whole story at its own pace."""
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
            f"A film is encoded by ffmpeg, which was not found. Try: {install_extra('film')} (imageio-ffmpeg), "
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
                pass  # ffmpeg has ended; its error message is read below
            except BaseException:
                process.kill()
                raise
        complaints.seek(0)
        words = complaints.read().decode("utf-8", "replace").strip()
        if process.returncode:
            raise MechlabError(f"ffmpeg ({encoder}) failed with code {process.returncode}: {words}")
    return path


# The curves of the page: colour-blind-safe, with a dash pattern each.
CURVES = (
    ("#0072b2", "-"),
    ("#d55e00", (0, (7, 3))),
    ("#009e73", (0, (2, 2))),
    ("#a64d79", (0, (9, 3, 2, 3))),
    ("#3b3b3b", (0, (1, 1.5))),
    ("#b58900", (0, (12, 4))),
)
MOST_PLOTS = 3
INK, FAINT = "#1b2330", "#5b6470"
STYLE: Any = {
    "svg.hashsalt": "mechlab",
    "svg.fonttype": "none",  # letters as text, not as curves: two thirds of the size, and it can be searched
    "font.sans-serif": ["DejaVu Sans", "Arial"],
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": FAINT,
    "path.simplify_threshold": 0.5,
}


def motion_svg(story: Story) -> str:
    """Up to three plots over time, and next to them the paths of named points in the plane in which they move most.

    The text is the same for the same story. Raises MechlabError for a story without motion or without anything to plot.
    """
    import matplotlib
    from matplotlib.figure import Figure

    plots = [p for p in story.plots if not (story.traces and p.title == "points")][:MOST_PLOTS]
    if len(story.t) < 2 or not (plots or story.traces):
        raise MechlabError(f"{story.title}: there is no motion to plot; expected a run with channels or named points.")
    rows = max(len(plots), 1)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, max(1.9 * rows + 0.5, 3.6)), layout="constrained", facecolor="white")
        both = bool(plots) and bool(story.traces)
        grid = figure.add_gridspec(rows, 2 if both else 1, width_ratios=(1.9, 1.0) if both else None)
        first: Any = None
        for k, plot in enumerate(plots):
            axes = first = figure.add_subplot(grid[k, 0], sharex=first)
            for (name, values), (color, dash) in zip(plot.series.items(), CURVES, strict=False):
                axes.plot(story.t, values, color=color, ls=dash, lw=1.5, label=name)
            axes.set_title(f"{plot.title} [{plot.unit}]" if plot.unit else plot.title, fontsize=10.5, loc="left")
            _sober(axes)
            axes.margins(x=0.0)
            axes.tick_params(labelbottom=k == len(plots) - 1)
            axes.legend(fontsize=9, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.04), handlelength=2.4)
        if plots:
            first.set_xlabel("time [s]")
        if story.traces:
            _paths(figure.add_subplot(grid[:, -1]), dict(story.traces))
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None}, bbox_inches="tight", pad_inches=0.08)
    return _PATHS.sub(_short_path, out.getvalue())


_PATHS = re.compile(r'(?<= d=")[^"]*')
_LONG = re.compile(r"-?\d+\.\d{3,}")


def _short_path(path: re.Match[str]) -> str:
    """The data of a path [pt] with two decimals, which is a hundredth of the width of a hair line, and without line breaks."""
    rounded = _LONG.sub(lambda x: f"{float(x[0]):.2f}".rstrip("0").rstrip("."), path[0])
    return re.sub(r"\s*\n\s*", "", rounded)


def write_motion_svg(story: Story, path: Path) -> Path:
    """Write `motion_svg` to a file, whole or not at all."""
    return write(path, motion_svg(story))


def _sober(axes: Any) -> None:
    axes.grid(True, color="#e3e6ea", lw=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=9, colors=FAINT)


def _paths(axes: Any, traces: dict[str, Array]) -> None:
    """Paths in the two world directions in which they extend most, with a dot where each begins."""
    extent = np.max([np.ptp(points, axis=0) for points in traces.values()], axis=0)
    across, up = sorted(np.argsort(-extent, kind="stable")[:2])
    for (name, points), (color, dash) in zip(traces.items(), CURVES, strict=False):
        axes.plot(points[:, across], points[:, up], color=color, ls=dash, lw=1.5, label=name)
        axes.plot(points[0, across], points[0, up], "o", color=color, ms=5)
    axes.set_aspect("equal", adjustable="box", anchor="N")
    axes.set_title("paths of points", fontsize=10.5, loc="left")
    axes.set_xlabel(f"{'xyz'[across]} [m]")
    axes.set_ylabel(f"{'xyz'[up]} [m]")
    low, high = axes.get_ylim()
    if high - low < 0.35 * float(extent[across]):  # a flat box would leave no room for the curve
        middle, half = 0.5 * (low + high), 0.175 * float(extent[across])
        axes.set_ylim(middle - half, middle + half)
    axes.legend(
        fontsize=9,
        frameon=False,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        borderaxespad=4.4,
        ncols=2,
        handlelength=2.2,
    )
    _sober(axes)
