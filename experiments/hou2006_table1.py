"""Hou et al. 2006, Table 1: overdraw of camera triangles by bound, and frames against rebuilding and tracing.

The same as `mpcam experiment hou2006-table1`, options included;
the code is mpcam/experiments/hou2006_table1.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "hou2006-table1", *sys.argv[1:]]))
