"""Gascuel et al. 2008, Fig. 9: the pixels that each bound tests, as pictures.

The same as `mpcam experiment gascuel2008-fig9`, options included;
the code is mpcam/experiments/gascuel2008_fig9.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "gascuel2008-fig9", *sys.argv[1:]]))
