"""Hou et al. 2006, Figs. 1 and 6: quality against tessellation, environment maps and ray tracing beside.

The same as `mpcam experiment hou2006-fig6`, options included;
the code is mpcam/experiments/hou2006_fig6.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "hou2006-fig6", *sys.argv[1:]]))
