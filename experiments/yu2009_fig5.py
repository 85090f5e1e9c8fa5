"""Yu et al. 2009, Fig. 5: a cross-slit camera over solids, by two passes of several patches and by ray tracing.

The same as `mpcam experiment yu2009-fig5`, options included;
the code is mpcam/experiments/yu2009_fig5.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "yu2009-fig5", *sys.argv[1:]]))
