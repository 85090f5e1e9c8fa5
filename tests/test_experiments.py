"""The experiments in their quick form: rows, files, page, and figures that make sense."""

import contextlib
import csv
import io
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import sync_playwright

import mpcam as mp
import mpcam.experiments
from mpcam.cli import main
from mpcam.experiments import EXPERIMENTS, gascuel2008_paper, pixel_counts, run
from mpcam.experiments import gascuel2008_table2 as table2
from mpcam.experiments import gascuel2008_table3 as table3
from mpcam.experiments import gascuel2008_table3_pages as table3_pages
from mpcam.experiments.output import write
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.rendering.registry import OUTLINE_BOUNDS as BOUNDS

ROOT = Path(__file__).parents[1]
HOSTILE = """a <b>"name"</b> & </script><img src=x onerror="window.broken=1"> {{PARTS}} $1$"""


def small(name: str = HOSTILE, draw=lambda figure, theme: figure.subplots().plot([1, 2], [2, 1])) -> Report:
    columns = (Column("what", "What"), Column("ours_ms", "Ours", "ms", group="Time"))
    columns += (Column("paper_ms", "Paper", "ms", group="Time", paper=True),)
    rows = ({"what": name, "ours_ms": 1.25, "paper_ms": None}, {"what": "=b", "ours_ms": float("nan"), "paper_ms": 3})
    picture = Picture("one", name, np.linspace(0, 1, 48 * 64 * 3, dtype=np.float32).reshape(48, 64, 3))
    parts = (Table("numbers", name, columns, rows, name), Plot("curve", name, name, draw), Gallery(name, (picture,)))
    return Report("small", name, name, name, parts, {"scene": name}, {"chip": name}, {"how": name}, (name,), True)


def read(path: Path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def check_files(folder: Path, report: Report) -> None:
    """All files are there, and the numbers in them are those of the report."""
    for table in report.tables:
        rows = read(folder / f"{table.name}.csv")
        assert len(rows) == len(table.rows) > 0
        assert list(rows[0]) == [column.name for column in table.columns]
        assert len({column.name for column in table.columns}) == len(table.columns)
        used = {key for row in table.rows for key in row}
        assert {column.name for column in table.columns if not column.paper} <= used
    for plot in report.plots:
        assert mp.read_image(folder / f"{plot.name}.png").shape[0] > 200
    for picture in report.pictures:
        image = mp.read_image(folder / "images" / f"{picture.name}.png")
        assert image.shape == picture.image.shape and image.std() > 0.01
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert results["quick"] and results["machine"]["threads"]
    assert set(results["files"]) == {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "{{" not in page and "nan" not in report.reading


def quick(name: str, folder: Path) -> Report:
    seen = []
    report = run(
        name, repeats=1, quick=True, output=folder / name, progress=lambda done, total, what: seen.append((done, total))
    )
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert seen[-1][0] == seen[-1][1]
    check_files(folder / name, report)
    return report


def test_table2(tmp_path):
    report = quick("gascuel2008-table2", tmp_path)
    ratios, times = report.table("ratios"), report.table("times")
    assert len(ratios.rows) == 4 and len(times.rows) == 6
    assert max(row["wrong_percent"] for row in ratios.rows) <= 0.02
    both = ratios.row(views="2 paraboloids", size=16)
    assert both["color_paper_ratio"] == pytest.approx(8.8 / 3.4)
    assert ratios.row(views="1 Lambert", size=16)["pixel_ratio"] == 3
    for row in times.rows:
        assert all(0 < row[f"{output}_ms"] < 1e4 for output in table2.OUTPUTS)


def test_the_sets_of_views_see_the_same_surroundings():
    scene = mp.builtin_scene("facade", 48, 48, triangles=600)
    views = table2.view_sets(scene, 48)
    eyes = np.array([camera.eye for cameras in views.values() for camera in cameras])
    np.testing.assert_allclose(eyes, np.broadcast_to(scene.camera.eye, eyes.shape), atol=1e-9)
    front, back = (np.asarray(camera.camera_from_world)[:3, :3] for camera in views["2 paraboloids"])
    np.testing.assert_allclose(front[2], -back[2], atol=1e-12)
    sizes = [(camera.width, camera.height) for camera in views["5 hemicube faces"]]
    assert sizes == [(48, 48), (24, 48), (24, 48), (48, 24), (48, 24)]


def test_a_hemicube_unfolds_without_seams():
    """Each face continues the front one: directions change little from one pixel to the next."""
    camera = mp.Radial.paraboloid(32, 32)
    faces = []
    for face in table2.face_cameras(camera, 32, half=True):
        rows, columns = np.mgrid[0 : face.height, 0 : face.width]
        faces.append(face.ray(np.stack([columns, rows], -1) + 0.5).direction.astype(np.float32))
    whole = table2.unfolded(faces)
    assert whole.shape == (64, 64, 3)
    middle = slice(16, 48)
    for cut in (whole[middle], whole[:, middle].swapaxes(0, 1)):
        assert np.abs(np.diff(cut, axis=1)).max() < 0.1


def test_table3(tmp_path):
    report = quick("gascuel2008-table3", tmp_path)
    overdraw, steps = report.table("overdraw"), report.table("steps")
    assert len(report.left_out) == len(set(table3.ALL) - set(BOUNDS))
    assert overdraw.rows[0]["view"] == "linear" and overdraw.rows[0]["ratio_percent"] == 100
    views = {row["view"]: row for row in overdraw.rows}
    tight, quad = views["paraboloid tight"], views["paraboloid quad"]
    assert 0 < tight["overdraw_percent"] <= quad["overdraw_percent"] < 2000
    assert tight["rendered_k"] == quad["rendered_k"] > 0
    for row in overdraw.rows:
        assert row["wrong_percent"] <= 0.02
        assert row["covered_k"] >= row["rendered_k"]
    for row in steps.rows:
        parts = [row[f"{name}_ms"] for name in table3_pages.STEPS]
        assert sum(parts) == pytest.approx(row["total_ms"])


def test_the_papers_rows_add_up():
    for key, row in gascuel2008_paper.TABLE_3.items():
        if np.isfinite(row.covered):
            assert row.overdraw == pytest.approx(100 * (row.covered / row.rendered - 1), rel=0.02), key
        steps = np.nansum([row.vertex, row.geometry, row.raycasting, row.lighting, row.shadow, row.texturing])
        assert steps == 0 or steps == pytest.approx(row.total, rel=0.06), key


def test_every_row_of_the_paper_is_run():
    planned = {(c.scene, c.triangles, c.projection, c.bound) for c in table3.plan(quick=False)}
    assert {key for key in gascuel2008_paper.TABLE_3 if key[3] in ("", *BOUNDS)} <= planned


def test_fig9(tmp_path):
    report = quick("gascuel2008-fig9", tmp_path)
    rows = {row["bound"]: row for row in report.table("bounds").rows}
    assert {"tight", "quad"} <= set(rows)
    for row in rows.values():
        assert row["wrong_percent"] <= 0.02
        # Parts of a triangle bound overlap by what rounding may amount to, and the pixels there count twice.
        assert row["rendered_k"] == pytest.approx(row["plain_k"], rel=0.02 if row["bound"] == "triangle" else 2e-3)
        assert row["region_k"] >= row["plain_k"]
    # The quads' boxes are tested whole; the kernels widen them by what rounding may amount to.
    assert rows["quad"]["covered_k"] == pytest.approx(rows["quad"]["region_k"], rel=0.03)
    assert rows["tight"]["covered_k"] <= rows["quad"]["covered_k"]
    assert rows["tight"]["region_k"] <= rows["quad"]["region_k"]
    accessed = next(picture for picture in report.pictures if picture.name == "accessed-quad").image
    assert (accessed[..., 2] > 0).any() and (accessed[..., :2].sum(-1) > 0).any()


@pytest.mark.parametrize("bound", BOUNDS)
def test_pixels_are_counted(bound, monkeypatch):
    """Tests of one triangle fill its bound, hits are what is seen of it; and chunks do not matter."""
    camera = mp.Radial.equidistant(40, 30)
    mesh = mp.Mesh([[-1, -1, 2], [1, -1, 2], [0, 1, 2], [0.5, 0, 1]], [[0, 1, 2], [0, 1, 3]])
    corners = pixel_counts.local_corners(camera, mesh)
    tests, hits = pixel_counts.counts(camera, corners, bound)
    assert (hits <= tests).all() and 0 < hits.sum() < tests.sum()
    seen = [mp.rasterize(camera, mp.Mesh(mesh.vertices, mesh.faces[[n]])).mask for n in (0, 1)]
    np.testing.assert_array_equal(hits, np.sum(seen, 0))
    monkeypatch.setattr(pixel_counts, "CHUNK", 5)
    again = pixel_counts.counts(camera, corners, bound)
    np.testing.assert_array_equal(tests, again[0])
    np.testing.assert_array_equal(hits, again[1])


def test_growth(tmp_path):
    report = quick("gascuel2008-growth", tmp_path)
    assert [table.name for table in report.tables] == ["triangles", "pixels", "paper"]
    for row in report.table("triangles").rows:
        assert row["invert_mb"] > 20 and row["raytrace_mb"] > 20
        assert row["invert_moving_ms"] > 0
    paper = report.table("paper")
    assert [row["paper_ratio"] for row in paper.rows] == pytest.approx([1.55 / 2.06, 1])


def test_memory_grows_with_what_is_held():
    code = """
import numpy
from mpcam.experiments.peak_memory import own_peak
before = own_peak()
held = numpy.ones(40_000_000)
print(own_peak() - before)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert 310 < float(done.stdout) < 350


@pytest.fixture(scope="module")
def commanded(tmp_path_factory):
    """What `mpcam experiment` gives and prints of a whole experiment: its files, its report, and its JSON."""
    folder, kept = tmp_path_factory.mktemp("commanded") / "out", []

    def kept_too(*arguments, **settings):
        kept.append(run(*arguments, **settings))
        return kept[-1]

    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.setattr(mpcam.experiments, "run", kept_too)
        assert main(["experiment", "moving-scene", "--quick", "--repeats", "1", "--output", str(folder), "--json"]) == 0
    (report,) = kept
    return folder, report, json.loads(printed.getvalue())


def test_moving_scene(commanded):
    _, report, _ = commanded
    rows = report.table("moving_scene").rows
    assert [row["scene"] for row in rows] == ["sphere 80", "sphere 1280", "facade"]
    for row in rows:
        assert row["still_ratio"] == pytest.approx(row["invert_still_ms"] / row["raytrace_still_ms"])
        assert row["wrong_percent"] <= 0.02


# The page and the files, with names that would break them if they could


def test_a_failure_leaves_nothing_behind(tmp_path):
    def broken(figure, theme):
        raise RuntimeError("no plot")

    with pytest.raises(RuntimeError):
        write(small("x", broken), tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_only_our_own_files_are_replaced(tmp_path):
    target = tmp_path / "out"
    write(small("first"), target)
    (target / "images" / "mine.png").write_text("mine", encoding="utf-8")
    fewer = small("second")
    write(Report(**{**fewer.__dict__, "parts": fewer.parts[:1]}), target)
    assert (target / "images" / "mine.png").exists()
    assert not (target / "images" / "one.png").exists() and not (target / "curve.png").exists()
    assert json.loads((target / "results.json").read_text(encoding="utf-8"))["title"] == "second"


def test_the_page_opens(tmp_path):
    url = write(small(), tmp_path / "out").as_uri()
    troubles = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium") or "/usr/bin/chromium", args=["--no-sandbox"]
        )
        for width, scheme in ((1280, "light"), (400, "dark")):
            page = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme).new_page()
            page.on("console", lambda message: troubles.append(message.text))
            page.on("pageerror", lambda error: troubles.append(str(error)))
            page.goto(url)
            assert page.locator("h1").inner_text() == page.title() == HOSTILE
            assert page.evaluate("window.broken") is None
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            assert page.locator("tbody tr").count() == 2
            assert page.locator("tbody td").all_inner_texts() == ["1.25", "-", "-", "3"]
            shown = page.locator(".plot-box img:visible")
            assert shown.count() == 1 and shown.get_attribute("class") == f"only-{scheme}"
            assert all(page.evaluate("[...document.images].map(i => !i.checkVisibility() || i.naturalWidth > 0)"))
            page.get_by_role("button").click()
            assert page.locator(".plot-box img:visible").get_attribute("class") != f"only-{scheme}"
        browser.close()
    assert troubles == []


# The command


def test_the_command_lists_the_experiments(capsys):
    assert main(["experiment"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(EXPERIMENTS)
    assert main(["experiment", "--json"]) == 0
    assert [entry["name"] for entry in json.loads(capsys.readouterr().out)] == list(EXPERIMENTS)


def test_the_command_runs_and_writes(commanded):
    folder, report, answer = commanded
    assert answer["experiment"] == "moving-scene" and len(answer["tables"]["moving_scene"]["rows"]) == 3
    assert answer["measured"]["rounds"].startswith("1 timed rounds")
    check_files(folder, report)


def test_the_command_prints(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(mpcam.experiments, "run", lambda name, **settings: asked.append((name, settings)) or small())
    assert main(["experiment", "moving-scene", "--repeats", "4"]) == 0
    out = capsys.readouterr().out
    assert HOSTILE.split()[0] in out and "1.25" in out and "out/moving-scene/report.html" in out
    assert max(map(len, out.splitlines())) <= 120
    name, settings = asked[0]
    assert name == "moving-scene" and settings.pop("progress")
    assert settings == {"repeats": 4, "quick": False, "output": Path("out/moving-scene")}
    assert main(["experiment", "moving-scene", "--quiet"]) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("gascuel2008-table4", "gascuel2008-table3"),
        ("--quick", "gascuel2008-table3"),
        ("moving-scene --repeats 0", "repeats=0"),
        ("moving-scene --output file", "'file' is a file"),
    ],
)
def test_mistakes_cost_one_line(arguments, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert main(["experiment", *arguments.split()]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and said in err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_has_its_script_and_its_line_on_the_page(name):
    module = EXPERIMENTS[name].module
    script = ROOT / "experiments" / f"{module}.py"
    assert f'"{name}"' in script.read_text(encoding="utf-8")
    assert len(script.read_text(encoding="utf-8").splitlines()) < 15
    assert f"\n| `{name}` | " in (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")


def test_a_script_is_the_command():
    script = ROOT / "experiments" / "gascuel2008_table2.py"
    done = subprocess.run([sys.executable, str(script), "--repeats", "0"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and done.stderr == "mpcam: repeats=0: at least 1 timed round is needed\n"
