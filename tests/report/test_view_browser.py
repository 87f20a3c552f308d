"""The page of a Franka's run in a real browser, opened from the disk: it draws, its slider moves the picture, it loads
nothing and complains of nothing.

Chromium draws without a graphics card here. The window is small and the page is told to hold still, so that few
pictures have to be drawn.
"""

from __future__ import annotations

import io
import json
import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdfctl.report.view.page import html_page, write_page
from cdfctl.report.view.replay import Replay
from cdfctl.simulation.run_folder import read_run

from .view.made import write_by_hand

webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed: no browser to drive")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(
    CHROMIUM is None or DRIVER is None,
    reason="chromium and chromedriver are not installed (Debian: apt-get install chromium chromium-driver)",
)

MOST_BYTES = 15_000_000
PATIENCE = 240.0
"""How long a picture may take on a machine that does other things too, s."""

FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--force-prefers-reduced-motion --window-size=640,480 --hide-scrollbars"
)
SLIDER = '[role="slider"][aria-valuenow]'


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a run of 10 s."""
    folder = tmp_path_factory.mktemp("page")
    text, warnings = html_page(Replay.of(read_run(write_by_hand(folder, steps=100))), "by-hand: a run", ["100 steps"])
    assert warnings == []
    write_page(folder / "run.html", text)
    return folder / "run.html"


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Any]:
    """A browser that nobody has used before."""
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for flag in (*FLAGS.split(), f"--user-data-dir={tmp_path / 'profile'}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(str(DRIVER)))
    driver.command_executor.client_config.timeout = int(PATIENCE)
    yield driver
    driver.quit()


def wait_for(what: str, found: Callable[[], Any]) -> Any:
    """What ``found`` gives once it gives something."""
    end = time.monotonic() + PATIENCE
    while not (value := found()):
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.2)
    return value


def picture(browser: Any) -> np.ndarray:
    """The right half of the canvas, which no panel and no notice covers, as (height, width, 3)."""
    from PIL import Image

    image = np.asarray(Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB"))
    bottom = int(browser.execute_script("return document.querySelector('canvas').getBoundingClientRect().bottom"))
    return image[:bottom, image.shape[1] // 2 :].astype(int)


def changed(before: np.ndarray, after: np.ndarray) -> float:
    """The share of pixels that differ by more than a shade."""
    return float((np.abs(before - after).max(axis=2) > 24).mean())


def test_the_page_names_no_outside_address_and_is_small_enough(page):
    text = page.read_text(encoding="utf-8")
    assert set(re.findall(r"https?://[^\s\"'<>)]+", text)) <= {"http://www.w3.org/2000/svg"}  # a name, never loaded
    assert page.stat().st_size <= MOST_BYTES


def test_the_slider_changes_the_picture_and_nothing_is_loaded(page, browser):
    from selenium.webdriver.common.action_chains import ActionChains

    def at() -> float:
        return float(browser.find_element("css selector", SLIDER).get_attribute("aria-valuenow"))

    def cursor() -> float:
        return float(browser.find_element("css selector", "#cdfctl .cursor").get_attribute("x1"))

    browser.get(f"{page.as_uri()}?fixedDpr=0.5")
    wait_for("the player", lambda: browser.find_elements("css selector", SLIDER))
    wait_for("the arm", lambda: (picture(browser) < 200).all(axis=2).mean() > 0.002)
    held = at()
    time.sleep(1.0)
    assert at() == held < 5.0  # the page holds still
    assert browser.title == "by-hand: a run"
    first, left = picture(browser), cursor()

    track = browser.find_element("css selector", ".mantine-Slider-track")
    ActionChains(browser).move_to_element_with_offset(track, int(0.1 * track.size["width"]), 0).click().perform()
    wait_for("the slider", lambda: abs(at() - 0.6 * 11.0) < 0.5)  # the run's 10 s, and 1 s at its end
    wait_for("another picture", lambda: changed(first, picture(browser)) > 0.01)
    assert cursor() > left + 100.0
    assert re.fullmatch(r"t = 6\.\d\d s", browser.find_element("css selector", "#cdfctl .now").text)

    browser.execute_script(
        "const svg = document.querySelector('#cdfctl svg'), box = svg.getBoundingClientRect(), run = window.CDFCTL_RUN;"
        "svg.dispatchEvent(new MouseEvent('click', {clientX: box.left + run.left + 0.8 * run.width}));"
    )
    wait_for("a click in a chart to move the slider", lambda: abs(at() - 8.0) < 0.1)

    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [e["params"] for e in events if e["method"] == "Network.requestWillBeSent"]
    ours = [p["request"]["url"] for p in asked if p["documentURL"].startswith("file:")]
    assert ours
    assert [url[:80] for url in ours if not url.startswith(("file:", "data:", "blob:"))] == []
