"""The report page in a real browser."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from comparison_example import HOSTILE, SIZE, comparison
from playwright.sync_api import Page, sync_playwright

from mpcam.comparison import report
from mpcam.comparison.rows import Row
from mpcam.comparison.table import Comparison


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return comparison().write(tmp_path_factory.mktemp("report") / "out").parent


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(
            executable_path=shutil.which("chromium") or "/usr/bin/chromium", args=["--no-sandbox"]
        )
        yield opened
        opened.close()


@pytest.fixture
def open_page(browser, folder):
    """Opens the page in a window of some size; checks at the end that it requested and complained of nothing."""
    contexts, troubles = [], []

    def open_(width: int = 1280, scheme: str = "light", **settings) -> Page:
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, **settings)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(5000)
        page.on("console", lambda message: troubles.append(message.text))
        page.on("pageerror", lambda error: troubles.append(str(error)))
        url = (folder / "report.html").as_uri()
        page.on(
            "request",
            lambda request: (
                troubles.append(request.url) if request.url != url and not request.url.startswith("data:") else None
            ),
        )
        page.goto(url)
        return page

    yield open_
    for context in contexts:
        context.close()
    assert troubles == []


def column_of(page: Page, heading: str) -> list[str]:
    headings = [text.strip("▲▼ ") for text in page.locator("#table thead th").all_inner_texts()]
    place = next(i for i, text in enumerate(headings) if " ".join(text.split()).strip("▲▼ ").startswith(heading))
    return [row.locator("th, td").nth(place).inner_text() for row in page.locator("#table tbody tr").all()]


def test_names_are_shown_as_they_are_and_run_nothing(open_page):
    page = open_page()
    assert page.locator("#name").inner_text() == HOSTILE
    assert page.title() == f"{HOSTILE}: error against run time"
    assert page.evaluate("window.broken") is None
    assert page.locator("#left-out").inner_text() == "other is left out: it <i>does not</i> apply."
    assert page.locator("#machine dd").inner_text() == "a <b>chip</b>"
    assert page.locator("#table tbody tr").count() == len(comparison().rows)


@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_fits_the_window_and_follows_the_scheme(open_page, width, scheme):
    page = open_page(width, scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    box = page.locator(".table-box")
    scrolls = box.evaluate("box => box.scrollWidth > box.clientWidth")
    assert scrolls == (width == 400)
    brightness = page.evaluate("getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3).map(Number)")
    assert (max(brightness) < 64) == (scheme == "dark")


def test_no_label_of_the_plot_covers_another(open_page):
    page = open_page()
    boxes = page.locator("#plot .label").evaluate_all(
        "all => all.map(e => { const b = e.getBoundingClientRect(); "
        "return [b.left, b.top + 2, b.right, b.bottom - 2]; })"
    )
    assert len(boxes) > 10
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def test_the_theme_button_switches_and_is_remembered(open_page):
    page = open_page()
    color = "getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(color)
    page.get_by_role("button", name="Switch to dark colors").click()
    dark = page.evaluate(color)
    assert dark != light
    page.reload()
    assert page.evaluate(color) == dark
    page.get_by_role("button", name="Switch to light colors").click()
    assert page.evaluate(color) == light


def test_sorting_by_mouse_and_keyboard(open_page):
    page = open_page()
    flip = page.locator("th[data-column=flip]")
    assert flip.get_attribute("aria-sort") == "none"
    flip.locator("button").click()
    assert flip.get_attribute("aria-sort") == "ascending"
    values = [float(text) for text in column_of(page, "FLIP")]
    assert values == sorted(values)
    assert len(set(values)) > 10
    page.keyboard.press("Enter")  # the heading keeps the focus
    assert flip.get_attribute("aria-sort") == "descending"
    assert [float(text) for text in column_of(page, "FLIP")] == sorted(values, reverse=True)
    page.locator("th[data-column=label] button").click()
    assert flip.get_attribute("aria-sort") == "none"
    names = column_of(page, "Method")
    assert names[:2] == ["cubemap 64", "cubemap 128"]  # as numbers
    page.locator("th[data-column=psnr] button").click()
    assert column_of(page, "PSNR")[0] == "∞"


def test_all_columns(open_page):
    page = open_page()
    few = page.locator("#table thead th").count()
    page.get_by_role("radio", name="All columns").check()
    assert page.locator("#table thead th").count() > few + 5
    assert "build 0.74, trace 2.31" in page.locator("tr[data-row=invert]").inner_text()
    assert "=note <i>" in page.locator("tr[data-row=invert]").inner_text()


def test_points_tell_their_numbers_on_hover_and_focus(open_page):
    page = open_page()
    tip = page.locator("#tooltip")
    assert tip.is_hidden()
    page.locator('.point[data-row="cubemap 256"]').hover()
    assert tip.is_visible()
    assert "cubemap 256" in tip.inner_text()
    assert "3.38 ±0.08 ms" in tip.inner_text()
    page.mouse.move(2, 2)
    assert tip.is_hidden()
    page.locator('.point[data-row="invert"]').focus()
    assert "2.31" in tip.inner_text()
    page.keyboard.press("Escape")
    assert tip.is_hidden()
    page.keyboard.press("Enter")
    assert page.locator("#shown").input_value() == "invert"
    assert page.locator("#left-tag").inner_text() == "invert"


def test_error_and_time_columns_change_plot_front_and_winners(open_page):
    page = open_page()
    assert "FLIP" in page.locator("#winners").inner_text()
    before = page.locator(".front-line").get_attribute("d")
    fronts = {(f["error"], f["time"]): f for f in json.loads(comparison().to_json())["fronts"]}

    def marked() -> set[str]:
        return {
            row.get_attribute("data-row") or "" for row in page.locator("tr:has(td[aria-label='on the front'])").all()
        }

    assert marked() == set(fronts["flip", "still_ms"]["rows"])
    page.get_by_role("radio", name="Moving frame").check()
    assert marked() == set(fronts["flip", "moving_ms"]["rows"]) != set(fronts["flip", "still_ms"]["rows"])
    assert page.locator(".front-line").get_attribute("d") != before
    page.locator("#error").select_option("projection_p95")
    assert "Projection error, 95%" in page.locator("#winners").inner_text()
    assert "Projection error, 95% (px)" in page.locator("#plot svg").text_content()  # type: ignore[operator]
    shown = [row.inner_text() for row in page.locator("#winners .who").all()]
    assert shown == [w["row"] for w in fronts["projection_p95", "moving_ms"]["winners"]]


def test_the_boundary_moves_by_keyboard_and_by_dragging(open_page):
    page = open_page()
    handle = page.get_by_role("slider")
    handle.focus()
    for key, value in (("ArrowRight", "51"), ("PageDown", "41"), ("Home", "0"), ("ArrowLeft", "0"), ("End", "100")):
        page.keyboard.press(key)
        assert handle.get_attribute("aria-valuenow") == value
    area = page.locator("#canvas").bounding_box()
    assert area is not None
    page.mouse.move(area["x"] + 0.9 * area["width"], area["y"] + 50)
    page.mouse.down()
    page.mouse.move(area["x"] + 0.25 * area["width"], area["y"] + 90)
    page.mouse.up()
    assert handle.get_attribute("aria-valuenow") == "25"
    page.mouse.move(area["x"] + 0.7 * area["width"], area["y"] + 90)
    assert handle.get_attribute("aria-valuenow") == "25"
    assert "75%" in page.locator("#left-image").evaluate("e => getComputedStyle(e).clipPath")


def test_the_viewer_shows_the_chosen_images(open_page):
    page = open_page()
    sources = set()
    for label in ("invert", "vertex level 0"):
        page.locator("#shown").select_option(label)
        sources.add(page.locator("#left-image").get_attribute("src"))
        assert page.locator("tr.chosen").get_attribute("data-row") == label
    assert len(sources) == 2
    truth = page.locator("#right-image").get_attribute("src")
    page.get_by_role("radio", name="Difference").check()
    assert page.locator("#right-image").get_attribute("src") != truth
    assert page.locator("#right-tag").inner_text() == "difference"
    widths = "[...document.querySelectorAll('#canvas img')].map(image => image.naturalWidth)"
    page.wait_for_function(f"{widths}.every(width => width === {SIZE})")
    narrow = page.locator("#canvas").evaluate("e => e.clientWidth")
    page.get_by_role("radio", name="4×").check()
    assert page.locator("#canvas").evaluate("e => e.clientWidth") == pytest.approx(4 * narrow, abs=60)
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280


def test_a_comparison_without_images_or_times_still_opens(browser, tmp_path):
    page_path = tmp_path / "page.html"
    page_path.write_text(report.build(Comparison((Row("invert"),), name="bare")), encoding="utf-8")
    page = browser.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(page_path.as_uri())
    assert page.locator("#table tbody tr").count() == 1
    assert page.locator("#viewer-section").is_hidden()
    assert "No row has both" in page.locator("#plot").inner_text()
    page.close()
    assert errors == []


def test_data_cannot_end_its_script_element():
    text = report.embed_json({"name": "</script><!-- \u2028"})
    assert "<" not in text
    assert "\u2028" not in text
    assert json.loads(text) == {"name": "</script><!-- \u2028"}


def test_the_page_stays_within_its_budget():
    base = comparison("big")
    images = {label: report.RowImages(image) for label, image in base.images.items()}
    whole, small = report.build(base, images), report.build(base, images, budget=20_000)
    assert '"shrink":1,' in whole.replace("}", ",")
    assert '"shrink":1,' not in small.replace("}", ",")
    assert len(small) < len(whole) - 20_000


def test_box_filter_keeps_the_mean_of_each_box():
    image = np.random.default_rng(0).random((5, 7, 3))
    small = report._box_filtered(image, 2)
    assert small.shape == (3, 4, 3)
    np.testing.assert_allclose(small[1, 2], image[2:4, 4:6].mean((0, 1)))
    np.testing.assert_allclose(small[2, 3], image[4, 6])
