"""How Sphinx builds these pages: `make docs`. Nothing is fetched from the network, neither here nor by a reader."""

import os
import sys
from pathlib import Path

import mpcam
from mpcam_kernels import llvm, pipeline, pixels, samples

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
os.environ.setdefault("COLUMNS", "88")

project = "mpcam"
author = copyright = "The mpcam authors"
release = version = mpcam.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
    "extensions.api",
    "extensions.figures",
    "extensions.mathml",
    "extensions.output",
]
exclude_patterns = ["_build/html", "_build/figures", "gallery", "figures", "extensions"]
default_role = "code"
smartquotes = False
nitpicky = True
nitpick_ignore_regex = [("py:.*", r"(numpy|np|collections|pathlib|os|typing|drjit|mitsuba)\..*")]
nitpick_ignore = [("py:class", "ArrayLike")]
# Names of annotations alone: what a number may be, and the settings of methods, which their own pages list.
nitpick_ignore_regex += [
    (
        "py:class",
        r"pi|[0-9.]+|mpcam\.(cameras\.(fields\.Limits|distortion\.Distortion|general_linear_kinds\.Line)|rendering\.registry\.\w+Settings)",
    )
]

myst_enable_extensions = ["deflist", "dollarmath", "substitution"]
myst_heading_anchors = 3
# Numbers of the code that the text names; read from it, so that the two cannot differ.
myst_substitutions = {
    "small": str(pipeline.SMALL),
    "coarse": str(samples.COARSE),
    "block": f"{samples.WIDTH} × {samples.HEIGHT}",
    "part": str(samples.PART),
    "parts": str(samples.PARTS),
    "per_thread": str(pixels.PER_THREAD),
    "pairs": f"{pipeline.PAIRS:,}",
    "per_block": str(pipeline.PER_BLOCK),
    "llvm_oldest": str(llvm.OLDEST_USABLE),
    "llvm_refused": str(llvm.OLDEST_LOADED),
}

html_theme = "furo"
html_title = f"mpcam {release}"
html_static_path = ["_static"]
html_css_files = ["mpcam.css"]
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "mathml"
html_theme_options = {"navigation_with_keys": True}
templates_path: list[str] = []
pygments_style = "friendly"
pygments_dark_style = "github-dark"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_use_legacy_class_based = False

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "_build/gallery",
    "filename_pattern": "plot_",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("matplotlib",),
    "reset_modules": ("extensions.gallery_style.reset",),
    "reset_modules_order": "both",
    "doc_module": ("mpcam",),
    "reference_url": {"mpcam": None},
    "backreferences_dir": None,
    "abort_on_example_error": True,
    "min_reported_time": 1e9,
    "show_memory": False,
    "write_computation_times": False,
    "remove_config_comments": True,
    "download_all_examples": False,
    "show_signature": False,
    "capture_repr": (),
    "notebook_extensions": set(),
    "copyfile_regex": r"$^",
    "thumbnail_size": (360, 260),
}
