"""Rosen et al. 2011, Table 1: time of a reflection by output, fine step, depth image and coarse step; memory.

The same as `mpcam experiment rosen2011-table1`, options included;
the code is mpcam/experiments/rosen2011_table1.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "rosen2011-table1", *sys.argv[1:]]))
