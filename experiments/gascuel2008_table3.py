"""Gascuel et al. 2008, Table 3: overdraw and the cost of each step, by projection and bound.

The same as `mpcam experiment gascuel2008-table3`, options included;
the code is mpcam/experiments/gascuel2008_table3.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "gascuel2008-table3", *sys.argv[1:]]))
