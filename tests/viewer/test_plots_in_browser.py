"""Plots in a real browser: every recorded channel, values under the pointer, zoom, tables and pictures of what is shown."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.experiment.recording import Recording
from mechlab.viewer import Story, from_poses, write_page
from mechlab.viewer.channels import FEWEST, MOST_BYTES, Channels, recorded_channels

Look = Callable[..., Any]

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def recording() -> Recording:
    return api.simulate("fourbar")


@pytest.fixture(scope="module")
def page(look: Look, recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = write_page(api.story(recording), tmp_path_factory.mktemp("plots") / "page.html")
    return look(path.as_uri(), width=1100, height=800)


def place(page: Any, area: Any, time: float) -> tuple[float, float]:
    """Where a time of the shown window is in a plot [px]."""
    box = area.bounding_box()
    start, span = page.evaluate("[lab.curves.window.start, lab.curves.window.span]")
    return box["x"] + 56 + (time - start) / span * (box["width"] - 70), box["y"] + 60


def test_every_recorded_channel_can_be_found_and_plotted(page: Any, recording: Recording) -> None:
    page.locator("#channels summary").click()
    page.locator(".channel").first.wait_for()
    names = page.locator(".channel input").evaluate_all("all => all.map(x => x.value)")
    assert names == list(recording.channels)
    page.get_by_label("Search channels").fill("rate rad")
    seen = page.locator(".channel:not([hidden]) input").evaluate_all("all => all.map(x => x.value)")
    assert seen == [n for n, u in recording.units.items() if "rate" in n and "rad" in u and n in recording.channels]
    page.get_by_label("Search channels").fill("rocker_angle_accel")
    page.locator(".channel:not([hidden]) input").check()
    plot = page.locator("figure.plot").first
    assert "channels in rad/s\u00b2" in plot.inner_text()
    for time in (0.2, 1.1):
        k = int(np.abs(recording.t - time).argmin())
        page.evaluate("t => lab.seek(t)", float(recording.t[k]))
        text = plot.locator(".legend b").inner_text().replace("\u2212", "-").split("\u00a0")[0]
        assert float(text) == pytest.approx(recording.channels["rocker_angle_accel"][k], rel=6e-4)
    page.get_by_role("button", name="Remove the plot").click()
    assert page.locator("#channels input:checked").count() == 0
    with pytest.raises(Exception, match="channel 'rocker' does not exist"):
        page.evaluate("lab.curves.picker.choose('rocker')")


def test_hovering_reads_the_value_under_the_pointer(page: Any, recording: Recording) -> None:
    area = page.locator(".plot-area").first
    area.scroll_into_view_if_needed()
    page.mouse.move(*place(page, area, 0.8))
    values = area.locator(".tip b").first.inner_text().split("\u00a0")
    # One pixel is 7 ms; four digits.
    assert float(values[0]) == pytest.approx(recording.at("crank_angle", 0.8), rel=0.02)
    assert values[1] == "rad"
    page.mouse.move(5, 5)
    assert area.locator(".tip").is_hidden()


def test_a_drag_zooms_all_plots_and_a_double_click_resets(page: Any, recording: Recording, tmp_path: Path) -> None:
    area = page.locator(".plot-area").first
    area.scroll_into_view_if_needed()
    page.evaluate("lab.seek(0)")
    page.mouse.move(*place(page, area, 0.5))
    page.mouse.down()
    page.mouse.move(*place(page, area, 0.7), steps=3)
    page.mouse.move(*place(page, area, 1.0), steps=3)
    page.mouse.up()
    assert page.evaluate("lab.time") == 0.0
    start, end = page.evaluate("[lab.curves.window.start, lab.curves.window.end]")
    assert [start, end] == pytest.approx([0.5, 1.0], abs=0.02)
    forces = page.locator("figure.plot").filter(has_text="crank_angle_force")
    with page.expect_download() as download:
        forces.get_by_role("button", name="as a table").click()
    rows = list(csv.reader(Path(download.value.path()).read_text().splitlines()))
    assert rows[0] == ["t [s]", "crank_angle_force [N m]"]
    table = np.array(rows[1:], dtype=float)
    assert start <= table[0, 0] < start + 0.01 and end - 0.01 < table[-1, 0] <= end
    for time, force in table[:: len(table) // 5]:
        k = int(np.abs(recording.t - time).argmin())
        assert force == recording.channels["crank_angle_force"][k] or abs(force) < 1e-8
    with page.expect_download() as download:
        forces.get_by_role("button", name="as a picture").click()
    svg = ElementTree.parse(download.value.path()).getroot()
    assert svg.tag.endswith("svg")
    words = [x.text for x in svg.iter("{http://www.w3.org/2000/svg}text")]
    assert "time [s]" in words and "[N\u00b7m]" in words and "crank_angle_force" in words
    area.dblclick(position={"x": 120, "y": 60})
    assert page.evaluate("lab.curves.window.zoomed") is False


def test_the_cursor_can_be_dragged_and_keys_zoom(page: Any) -> None:
    area = page.locator(".plot-area").first
    page.evaluate("lab.seek(1)")
    page.mouse.move(*place(page, area, 1.0))
    page.mouse.down()
    page.mouse.move(*place(page, area, 1.5), steps=4)
    page.mouse.up()
    assert page.evaluate("lab.time") == pytest.approx(1.5, abs=0.02)
    area.focus()
    page.keyboard.press("+")
    assert page.evaluate("lab.curves.window.span") == pytest.approx(1.0, abs=1e-9)
    assert page.evaluate("lab.curves.window.start") == pytest.approx(page.evaluate("lab.time") / 2, abs=1e-9)
    page.keyboard.press("0")
    assert page.evaluate("lab.curves.window.zoomed") is False


def test_a_peak_of_one_sample_is_drawn(page: Any) -> None:
    """Of 200 000 samples, at most four for each column of pixels are drawn, the single one that sticks out among them."""
    places = page.evaluate("""() => {
        const view = lab.curves.views[0];
        const times = Float64Array.from({ length: 200000 }, (_, i) => i * 1e-5), values = times.map(() => 0);
        values[123456] = 7;
        return lab.curves.placesOf(times, values, 0, 199999, (t) => 150 * t, (v) => v);
    }""")
    assert len(places) < 4 * 302
    assert [p for p in places if p[1] == 7] == [[pytest.approx(150 * 1.23456), 7]]


def test_long_runs_keep_to_the_budget(story: Story, look: Look, tmp_path: Path) -> None:
    recording = api.simulate("fourbar", duration=0.2)
    few = recorded_channels(recording)
    assert few.t.tolist() == recording.t.tolist() and few.recorded == len(recording.t)
    t = np.arange(300_001) * 1e-3
    long = Recording(
        recording.mechanism,
        t,
        np.zeros((len(t), 0)),
        np.zeros((len(t), 0)),
        {f"c{k}": np.sin(t + k) for k in range(20)},
    )
    found = recorded_channels(long)
    assert FEWEST <= len(found.t) and 4 * 20 * len(found.t) <= MOST_BYTES + 200
    assert found.t[-1] == t[-1] and found.recorded == len(t)
    np.testing.assert_array_equal(found.values["c3"], np.sin(found.t + 3))
    assert Channels().values == {}
    assert from_poses("still", {"a": np.eye(4)}, ()).channels.recorded == 0
