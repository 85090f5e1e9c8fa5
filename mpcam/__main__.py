"""`python -m mpcam` is the command `mpcam`."""

import sys

from mpcam.cli import main

sys.exit(main())
