"""experiments/opencv_inverse.py in short: our inverse is right everywhere, OpenCV's is wrong where the page says."""

import csv
import importlib
import re
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest

cv2 = pytest.importorskip("cv2", reason="OpenCV, of the test extra, is not installed")

ROOT = Path(__file__).parents[1]
STEP = 3.0  # degrees
sys.path.append(str(ROOT / "experiments"))
sweep = importlib.import_module("opencv_inverse_sweep")
experiment = importlib.import_module("opencv_inverse")


@pytest.fixture(scope="module")
def results():
    return sweep.run(STEP)


@pytest.fixture(scope="module")
def samples(results):
    """Name of a lens -> its samples."""
    return {name: [sample for sample in results[0] if sample.lens == name] for name in sweep.LENSES}


def fisheye_rays(name, pixels, *criteria):
    """OpenCV's points (N, 2) on the plane z = 1 for pixels (N, 2)."""
    lens = sweep.LENSES[name]
    matrix = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1]])
    arguments = (None, None, None, *criteria) if criteria else ()
    return cv2.fisheye.undistortPoints(pixels[:, None], matrix, np.array(lens.k, float), *arguments)[:, 0]


def pixels_of(samples, *kinds):
    return np.array([(sample.u, sample.v) for sample in samples if sample.opencv.kind in kinds])


def test_ours_is_right_everywhere(results):
    for sample in results[0]:
        assert sample.ours.kind == ("refused" if np.isnan(sample.angle) else "right"), sample
        # At a fold an error of the pixel is magnified in the angle.
        assert not sample.ours.px > 1e-11 and not sample.ours.mrad > 1e-7, sample
    assert sum(np.isnan(sample.angle) for sample in results[0]) > 50


def test_the_truth_is_true():
    """True rays are imaged at their pixels; there is none beyond the rim."""
    with mpmath.workdps(sweep.DIGITS):
        for lens in sweep.LENSES.values():
            pixel = np.array([lens.cx + 0.7 * lens.fx, lens.cy - 0.3 * lens.fy])
            ray = sweep.true_ray(lens, pixel)
            assert sweep.pixel_error(lens, pixel, ray) < 1e-40
            assert abs(mpmath.norm(ray) - 1) < mpmath.mpf("1e-45")
            if sweep.folds(lens):
                assert sweep.true_ray(lens, pixel + 1e4) is None


def test_opencv_is_right_in_front_and_within_half_pi(samples):
    """Where the lens neither folds nor is nearly flat; beyond, it is wrong, and says nothing except next to a fold."""
    for name in ("narrow", "TUM-VI", "wide", "strongly stretched", "negative k"):
        for sample in samples[name]:
            if abs(sample.radius - np.pi / 2) < 0.02 or np.isnan(sample.angle):
                continue
            in_front, within = sample.angle < 90, sample.radius < np.pi / 2
            if in_front and within:
                assert sample.opencv.kind == "right" and sample.opencv.px < 1e-9, sample
            elif within:
                near_fold = sample.angle > np.degrees(sweep.LENSES[name].limit) - 1
                assert sample.opencv.kind in ("mirrored", "missed")[: 1 + near_fold], sample
            else:
                assert sample.opencv.kind == "wrong" and sample.opencv.px > 0.02, sample


def test_opencv_limits_r_to_half_pi_and_stretches_the_answer(samples):
    """Its issue 26174; once this fails, it has been mended."""
    lens = sweep.LENSES["wide"]
    pixels = pixels_of(samples["wide"], "wrong", "invented")
    radius = np.hypot(*((pixels - [lens.cx, lens.cy]) / lens.fx).T)
    expected = np.tan(lens.angle_at(np.pi / 2)) * radius / (np.pi / 2)
    assert np.abs(np.hypot(*fisheye_rays("wide", pixels).T) / expected - 1).max() < 1e-9


def test_opencv_omnidir_is_mirrored_beyond_90_degrees(samples):
    for sample in samples["Mei, xi = 1.4"]:
        if np.isnan(sample.angle):
            assert sample.opencv.kind == "refused"
        else:
            assert sample.opencv.kind == ("right" if sample.angle < 90 else "mirrored"), sample


def test_opencv_answers_beyond_the_rim_where_that_is_above_half_pi(samples):
    kinds = {name: {s.opencv.kind for s in samples[name] if np.isnan(s.angle)} for name in ("wide", "negative k")}
    assert kinds == {"wide": {"invented"}, "negative k": {"refused"}}


def test_opencv_crosses_the_fold_and_its_round_trip_does_not_show_it(samples):
    name = "folds in the image"
    lens = sweep.LENSES[name]
    folded = [sample.angle for sample in samples[name] if sample.opencv.kind == "folded"]
    assert len(folded) > 10 and min(folded) > 61.4 and max(folded) < 77.2
    assert all(sample.opencv.kind == "right" for sample in samples[name] if sample.angle < 61)
    pixels = pixels_of(samples[name], "folded")
    plane = fisheye_rays(name, pixels)
    matrix = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1]])
    points = np.concatenate([plane, np.ones((len(plane), 1))], 1)
    back, _ = cv2.fisheye.projectPoints(points[:, None], np.zeros(3), np.zeros(3), matrix, np.array(lens.k, float))
    assert np.abs(back[:, 0] - pixels).max() < 1e-6
    assert (np.degrees(np.arctan(np.hypot(*plane.T))) > np.degrees(lens.limit)).all()


def test_more_iterations_answer_what_is_missed_and_mend_nothing(samples):
    patient = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 1000, 1e-8)
    missed = [sample for sample in samples["nearly flat"] if sample.opencv.kind == "missed"]
    assert len(missed) > 10 and 60 < missed[0].angle < missed[-1].angle < 90
    plane = fisheye_rays("nearly flat", pixels_of(samples["nearly flat"], "missed"), patient)
    assert np.abs(np.degrees(np.arctan(np.hypot(*plane.T))) - [sample.angle for sample in missed]).max() < 1e-6
    for name in ("TUM-VI", "wide", "strongly stretched", "folds in the image"):
        pixels = pixels_of(samples[name], "mirrored", "wrong", "folded")
        plane = fisheye_rays(name, pixels)
        assert np.abs(fisheye_rays(name, pixels, patient) - plane).max() < 1e-6 * np.abs(plane).max()


def test_the_page_says_what_is_measured(results):
    """The table of docs/cameras.md; its fields of view and its counts are those of a finer sweep."""
    text = (ROOT / "docs" / "cameras.md").read_text(encoding="utf-8").split("## Where OpenCV's inverse", 1)[1]
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if re.match(r"\| [^|]+ \| \d+° \|", line)]
    assert [row[0] for row in rows] == list(sweep.LENSES)
    for (_, view, _, first, percent, missed, ours), measured in zip(rows, results[1], strict=True):
        assert abs(float(view.rstrip("°")) - measured.field_of_view) <= 2 * STEP
        assert measured.ours_worst_px < 10 * float(ours)
        if measured.opencv_image_percent is None:
            assert {first, percent, missed} == {"–"}
            continue
        assert abs(float(percent.rstrip(" %")) - measured.opencv_image_percent) < 0.1
        assert (measured.opencv_missed > 0) == (not missed.startswith("0 "))
        if measured.opencv_first is None:
            assert first == "nowhere"
        else:
            assert abs(float(first.rstrip("°")) - measured.opencv_first) < 0.1


def test_one_command_writes_the_tables_the_plot_and_a_page(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["opencv_inverse.py", "--step", "20", "--output", str(tmp_path / "new")])
    experiment.main()
    assert len(capsys.readouterr().out.splitlines()) == 2 + len(sweep.LENSES) + 1
    written = {path.name: path for path in (tmp_path / "new").iterdir()}
    assert set(written) == {"samples.csv", "summary.csv", "opencv_inverse.png", "index.html"}
    with open(written["summary.csv"], newline="") as file:
        assert [row["lens"] for row in csv.DictReader(file)] == list(sweep.LENSES)
    with open(written["samples.csv"], newline="") as file:
        assert {row["opencv_kind"] for row in csv.DictReader(file)} <= {"", *sweep.KINDS}
    assert written["opencv_inverse.png"].read_bytes().startswith(b"\x89PNG")
    text = written["index.html"].read_text(encoding="utf-8")
    assert text.count("<tr>") == 1 + len(sweep.LENSES)
    assert not re.search(r"https?://", text)
