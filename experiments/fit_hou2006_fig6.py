"""The mirrors of Hou et al. 2006, Fig. 6, by fitted camera triangles: pictures as good with how many fewer.

The same as `mpcam experiment fit-hou2006-fig6`, options included;
the code is mpcam/experiments/fit_hou2006_fig6.py.
"""

import sys

from mpcam.cli import main

if __name__ == "__main__":
    sys.exit(main(["experiment", "fit-hou2006-fig6", *sys.argv[1:]]))
