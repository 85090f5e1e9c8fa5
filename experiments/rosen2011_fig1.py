"""Rosen et al. 2011, Fig. 1: what depth images lack in a mirror, by camera; errors and times.

The same as `mpcam experiment rosen2011-fig1`, options included;
the code is mpcam/experiments/rosen2011_fig1.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "rosen2011-fig1", *sys.argv[1:]]))
