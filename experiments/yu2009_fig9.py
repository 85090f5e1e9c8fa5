"""Yu et al. 2009, Fig. 9: a still animal turns its head, by two cross-slit cameras on a hinge.

The same as `mpcam experiment yu2009-fig9`, options included;
the code is mpcam/experiments/yu2009_fig9.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "yu2009-fig9", *sys.argv[1:]]))
