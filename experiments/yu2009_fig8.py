"""Yu et al. 2009, Fig. 8: a mirror sphere of 960 cameras among butterflies, by four kinds of rays between the vertices.

The same as `mpcam experiment yu2009-fig8`, options included;
the code is mpcam/experiments/yu2009_fig8.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "yu2009-fig8", *sys.argv[1:]]))
