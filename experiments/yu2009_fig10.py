"""Yu et al. 2009, Fig. 10: mirrors by the number of cameras and of scene triangles, and what one more camera costs.

The same as `mpcam experiment yu2009-fig10`, options included;
the code is mpcam/experiments/yu2009_fig10.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "yu2009-fig10", *sys.argv[1:]]))
