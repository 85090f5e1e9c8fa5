"""Hou et al. 2006, Fig. 7: many moving objects around a teapot, with and without each acceleration.

The same as `mpcam experiment hou2006-fig7`, options included;
the code is mpcam/experiments/hou2006_fig7.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "hou2006-fig7", *sys.argv[1:]]))
