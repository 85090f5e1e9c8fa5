"""Gascuel et al. 2008, Table 2: cube and hemicube against one or two non-linear projections.

The same as `mpcam experiment gascuel2008-table2`, options included;
the code is mpcam/experiments/gascuel2008_table2.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "gascuel2008-table2", *sys.argv[1:]]))
