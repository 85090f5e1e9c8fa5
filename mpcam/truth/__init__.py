"""Ground truth by Mitsuba: first hits, every camera as a sensor, and shaded reference images."""

from mpcam.truth.sensor import register as register
from mpcam.truth.sensor import sensor as sensor
