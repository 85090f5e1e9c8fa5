"""Rosen et al. 2011, Fig. 3: ambient occlusion by z-buffers that see more than the output.

The same as `mpcam experiment rosen2011-ambient-occlusion`, options included;
the code is mpcam/experiments/rosen2011_ambient_occlusion.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "rosen2011-ambient-occlusion", *sys.argv[1:]]))
