"""Rosen et al. 2011, Figs. 2, 12, 13 and 20: cars and barrels as relief textures, against tracing all their triangles.

The same as `mpcam experiment rosen2011-relief`, options included;
the code is mpcam/experiments/rosen2011_relief.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "rosen2011-relief", *sys.argv[1:]]))
