"""Time and peak memory against the number of triangles and of pixels, next to ray tracing.

The same as `mpcam experiment gascuel2008-growth`, options included;
the code is mpcam/experiments/gascuel2008_growth.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "gascuel2008-growth", *sys.argv[1:]]))
