"""What each part of the rasterizer is worth, and the inner loop against its limit.

The same as `mpcam experiment leaving-out`, options included;
the code is mpcam/experiments/leaving_out.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "leaving-out", *sys.argv[1:]]))
