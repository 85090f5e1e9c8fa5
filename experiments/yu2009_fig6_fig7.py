"""Yu et al. 2009, Figs. 6 and 7: panoramas of things from all sides, by number of pieces, and a top view.

The same as `mpcam experiment yu2009-fig6-fig7`, options included;
the code is mpcam/experiments/yu2009_fig6_fig7.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "yu2009-fig6-fig7", *sys.argv[1:]]))
