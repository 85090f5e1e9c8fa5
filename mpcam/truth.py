"""Ground truth by Mitsuba: every camera as a sensor, for reference images."""

from mpcam.tracing.sensor import register as register
from mpcam.tracing.sensor import sensor as sensor
