"""Rasterizing against rebuilding a tree and tracing, for moving and still scenes.

The same as `mpcam experiment moving-scene`, options included;
the code is mpcam/experiments/moving_scene.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "moving-scene", *sys.argv[1:]]))
