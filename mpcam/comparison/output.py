"""The files of a result: written beside the target first, so that a failure leaves nothing half-written."""

import json
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.comparison import plot, report
from mpcam.comparison.encode import as_csv, as_dict
from mpcam.comparison.metrics import flip_map
from mpcam.comparison.rows import Findings
from mpcam.errors import InputError
from mpcam.io.images import write_image
from mpcam.math.srgb import linear_from_srgb

PAGE, RESULTS = "report.html", "results.json"
_LISTED = re.compile(r"(?:images/)?[a-z0-9.-]+\.(?:png|gif|csv)")


def check_output(output: str | Path) -> None:
    """Raise `InputError` if the folder could not be written later; better said before minutes of measuring."""
    path = Path(output)
    if path.exists() and not path.is_dir():
        raise InputError(f"Output {str(output)!r} is a file; give the name of a folder.")
    parent = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(f"Output {str(output)!r} cannot be written: no permission in {str(parent)!r}; choose another.")


def write(comparison: Findings, output: str | Path) -> Path:
    """Write all files of a comparison into a folder and return the path of the report page.

    report.html (self-contained), results.csv, results.json, pareto.png, truth.exr (linear light, distances, camera) and
    images/*.png. Raises `InputError` for an unusable folder.
    """
    with written_whole(output) as folder:
        _fill(comparison, folder)
    return Path(output).absolute() / PAGE


@contextmanager
def written_whole(output: str | Path) -> Iterator[Path]:
    """A folder to write the files of a result into, which become the files of `output` when the block ends.

    A new folder appears whole or not at all; in an existing one only these files are replaced, and those that an older
    result lists in its results.json and that have no successor are removed. Raises `InputError` for an unusable folder.
    """
    check_output(output)
    target = Path(output).absolute()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        staging = target.with_name(f".mpcam-{secrets.token_hex(8)}")
        staging.mkdir()
    except OSError as error:
        raise InputError(
            f"Output {str(output)!r} cannot be written: {error.strerror}; choose another folder."
        ) from error
    try:
        yield staging
        _publish(staging, target)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def write_results(folder: Path, results: dict[str, Any]) -> None:
    """results.json of a folder that holds all its other files: what is given, and their names."""
    files = sorted(str(p.relative_to(folder).as_posix()) for p in folder.rglob("*") if p.is_file()) + [RESULTS]
    text = json.dumps(results | {"files": sorted(files)}, indent=2, allow_nan=False)
    (folder / RESULTS).write_text(text + "\n", encoding="utf-8")


def differences(comparison: Findings) -> dict[str, np.ndarray]:
    """FLIP maps (H, W) in [0, 1] by row label, for rows that have an image."""
    if comparison.truth_image is None:
        return {}
    return {label: flip_map(image, comparison.truth_image) for label, image in comparison.images.items()}


def magma(values: np.ndarray) -> np.ndarray:
    """Values (H, W) in [0, 1] in the colors that FLIP is shown in, black to white, as linear RGB."""
    import matplotlib

    colors = matplotlib.colormaps["magma"](np.clip(values, 0.0, 1.0))[..., :3]
    black = np.asarray(values)[..., None] <= 0.0  # the map starts at a dark violet; no error shall look like none
    return linear_from_srgb(np.where(black, 0.0, colors)).astype(np.float32)


def _fill(comparison: Findings, folder: Path) -> None:
    (folder / "images").mkdir()
    names = _names(list(comparison.images))
    page_images: dict[str, report.RowImages] = {}
    truth = None
    if comparison.truth_image is not None:
        truth = folder / "images" / "truth.png"
        write_image(truth, comparison.truth_image)
        write_image(
            folder / "truth.exr", comparison.truth_image, depth=comparison.truth_depth, camera=comparison.camera
        )
    errors = {label: magma(values) for label, values in differences(comparison).items()}
    for label, image in comparison.images.items():
        write_image(folder / "images" / f"{names[label]}.png", image)
        if label in errors:
            write_image(folder / "images" / f"{names[label]}-difference.png", errors[label])
        page_images[label] = report.RowImages(image, errors.get(label))
    (folder / "results.csv").write_text(as_csv(comparison), encoding="utf-8")
    plot.draw(comparison, folder / "pareto.png")
    page = report.build(comparison, page_images)
    (folder / PAGE).write_text(page, encoding="utf-8")
    write_results(folder, as_dict(comparison))


def _publish(staging: Path, target: Path) -> None:
    if not target.exists():
        staging.rename(target)
        return
    files = [path.relative_to(staging) for path in staging.rglob("*") if path.is_file()]
    stale = _own_files(target) - set(files)
    for name in files:
        (target / name).parent.mkdir(exist_ok=True)
        os.replace(staging / name, target / name)
    for name in stale:
        (target / name).unlink(missing_ok=True)


def _own_files(target: Path) -> set[Path]:
    """Files that an older result in this folder says it wrote; anything else in the folder is not ours."""
    try:
        listed = json.loads((target / RESULTS).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    return {Path(name) for name in listed if isinstance(name, str) and _LISTED.fullmatch(name)}


def _names(labels: list[str]) -> dict[str, str]:
    """A file name for each label: lower case letters, digits and hyphens, no two alike."""
    names: dict[str, str] = {}
    for label in labels:
        plain = re.sub(r"[^a-z0-9]+", "-", label.lower()).strip("-") or "row"
        name, count = plain, 2
        while name in names.values() or name == "truth" or name.endswith("-difference"):
            name, count = f"{plain}-{count}", count + 1
        names[label] = name
    return names
