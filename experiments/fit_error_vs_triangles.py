"""Rays of uniform, simplified and fitted camera triangles, 16 to 2,048 of them, on eight reflectors.

The same as `mpcam experiment fit-error-vs-triangles`, options included;
the code is mpcam/experiments/fit_error_vs_triangles.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "fit-error-vs-triangles", *sys.argv[1:]]))
