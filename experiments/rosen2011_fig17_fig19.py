"""Rosen et al. 2011, Figs. 17 and 19: steps of rays over depth images, with and without coarse steps.

The same as `mpcam experiment rosen2011-fig17-fig19`, options included;
the code is mpcam/experiments/rosen2011_fig17_fig19.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "rosen2011-fig17-fig19", *sys.argv[1:]]))
