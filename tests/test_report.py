"""The report page in a real browser, and the files beside it."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, sync_playwright

from mpcam.cameras import Radial
from mpcam.comparison import output, report
from mpcam.comparison.metrics import flip_map
from mpcam.comparison.pareto import pareto_front
from mpcam.comparison.rows import Row
from mpcam.comparison.table import Comparison
from mpcam.errors import InputError
from mpcam.io.images import read_camera, read_channels, read_image

HOSTILE = """a <b>"scene"</b> & </script><img src=x onerror="window.broken=1"> 'x' {{DATA}} <!-- $1$ ünï"""
SIZE = 48


def comparison(name: str = HOSTILE) -> Comparison:
    """Fifteen rows with images whose noise grows with their error: plain data, no renderer."""
    random = np.random.default_rng(3)
    y, x = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    truth = np.stack([0.5 + 0.4 * np.sin(9 * x), 0.3 + 0.5 * x * y, 0.6 - 0.4 * x], -1).astype(np.float32)
    settings = [("invert", "", None, 2e-4, 2.31, 3.05), ("raytrace", "", None, 0.0, 1.4, 5.1)]
    settings += [("vertex", f"level {k}", k, 0.21 / 4**k, 0.9 * 1.9**k, 1.4 * 2.5**k) for k in range(5)]
    for k, n in enumerate((64, 128, 256, 512)):
        settings += [("cubemap", f"{n}", n, 0.12 / 2**k, 1.5 * 1.5**k, 3.3 * 1.5**k)]
        settings += [("hemicube", f"{n}", n, 0.121 / 2**k, 1.1 * 1.5**k, 2.2 * 1.5**k)]
    rows, images = [], {}
    for method, setting, parameter, error, still, moving in settings:
        row = Row(
            method,
            setting,
            parameter,
            hit_mismatch=error / 10,
            triangle_mismatch=error / 5,
            depth_median=error / 9,
            depth_p999=error,
            rmse=error,
            psnr=np.inf if error == 0 else -20 * np.log10(error),
            flip=error,
            projection_median=error * 10,
            projection_p95=error * 30,
            projection_max=error * 900,
            still_ms=still,
            still_spread=0.05 * still,
            moving_ms=moving,
            moving_spread=0.07 * moving,
            shade_ms=1.9,
            compile_ms=600.0,
            stages_ms={"build": moving - still, "trace": still},
            tests=1e6 * still,
            rendered=2e5,
            overdraw=5 * still,
            note="=note <i>",
        )
        rows.append(row)
        images[row.label] = np.clip(truth + error * random.standard_normal(truth.shape), 0, None).astype(np.float32)
    front = pareto_front([r.flip for r in rows], [r.still_ms for r in rows])
    depth = np.where(truth[..., 0] > 0.5, 2.0, np.inf).astype(np.float32)
    return Comparison(
        tuple(replace(r, on_front=bool(on)) for r, on in zip(rows, front, strict=True)),
        name,
        {"scene": name},
        {"processor": "a <b>chip</b>"},
        {"rounds": "9"},
        {"other": "it <i>does not</i> apply"},
        images,
        truth,
        depth,
        Radial.paraboloid(SIZE, SIZE),
    )


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
    page.get_by_role("button", name="Switch to dark colours").click()
    dark = page.evaluate(color)
    assert dark != light
    page.reload()
    assert page.evaluate(color) == dark
    page.get_by_role("button", name="Switch to light colours").click()
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


def test_all_files_are_written(folder):
    listed = json.loads((folder / "results.json").read_text(encoding="utf-8"))["files"]
    there = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    assert listed == there
    assert {
        "report.html",
        "results.csv",
        "pareto.png",
        "truth.exr",
        "images/truth.png",
        "images/cubemap-64.png",
        "images/vertex-level-0-difference.png",
    } <= set(there)
    base = comparison()
    assert base.truth_image is not None
    assert base.truth_depth is not None
    np.testing.assert_array_equal(read_image(folder / "truth.exr"), base.truth_image)
    np.testing.assert_array_equal(read_channels(folder / "truth.exr")["ray.distance"], base.truth_depth)
    assert read_camera(folder / "truth.exr") == base.camera
    assert read_image(folder / "pareto.png").shape[0] > 300
    difference = read_image(folder / "images" / "vertex-level-0-difference.png")
    expected = output.magma(flip_map(base.images["vertex level 0"], base.truth_image))
    np.testing.assert_allclose(difference, expected, atol=0.01)
    assert not read_image(folder / "images" / "raytrace-difference.png").any()


def test_a_failure_leaves_nothing_behind(tmp_path):
    broken = comparison("broken")
    images = dict(broken.images) | {"invert": np.full((SIZE, SIZE, 3), np.nan, np.float32)}
    with pytest.raises(InputError, match="NaN"):
        replace(broken, images=images).write(tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_a_failure_keeps_the_older_comparison(folder, tmp_path):
    target = tmp_path / "out"
    shutil.copytree(folder, target)
    (target / "notes.txt").write_text("mine", encoding="utf-8")
    before = {path: path.read_bytes() for path in target.rglob("*") if path.is_file()}
    broken = comparison("broken")
    images = {"invert": np.full((SIZE, SIZE, 3), np.nan, np.float32)}
    with pytest.raises(InputError):
        replace(broken, images=images).write(target)
    assert {path: path.read_bytes() for path in target.rglob("*") if path.is_file()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_only_our_own_files_are_replaced(folder, tmp_path):
    target = tmp_path / "out"
    shutil.copytree(folder, target)
    for name in ("notes.txt", "images/mine.png", "images/cubemap-64.txt"):
        (target / name).write_text("mine", encoding="utf-8")
    fewer = comparison("fewer")
    keep = [r for r in fewer.rows if r.method != "cubemap"]
    replace(fewer, rows=tuple(keep), images={r.label: fewer.images[r.label] for r in keep}).write(target)
    for name in ("notes.txt", "images/mine.png", "images/cubemap-64.txt"):
        assert (target / name).read_text(encoding="utf-8") == "mine"
    assert not (target / "images" / "cubemap-64.png").exists()
    assert (target / "images" / "hemicube-64.png").exists()
    assert json.loads((target / "results.json").read_text(encoding="utf-8"))["name"] == "fewer"


def test_a_list_of_files_from_elsewhere_removes_nothing(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    (tmp_path / "precious.png").write_text("x", encoding="utf-8")
    (target / "results.json").write_text(
        '{"files": ["../precious.png", "images/../../precious.png", 3]}', encoding="utf-8"
    )
    comparison("new").write(target)
    assert (tmp_path / "precious.png").exists()


def test_unusable_folders_are_named(tmp_path):
    (tmp_path / "file").write_text("x", encoding="utf-8")
    for name in ("file", "file/below"):
        with pytest.raises(InputError, match="file") as caught:
            output.check_output(tmp_path / name)
        assert "\n" not in str(caught.value)
