"""Yu et al. 2009, Fig. 1: a cross-slit strip along a city street that moves, against a rebuilt tree and traced rays.

The same as `mpcam experiment yu2009-fig1`, options included;
the code is mpcam/experiments/yu2009_fig1.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "yu2009-fig1", *sys.argv[1:]]))
