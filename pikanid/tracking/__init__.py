"""From a video of a liquid's surface to its angle, with a standard error for each frame."""

from pikanid.tracking.colours import ColourRange
from pikanid.tracking.geometry import Geometry, from_corners, from_edges
from pikanid.tracking.region import Region
from pikanid.tracking.settings import TrackingSettings
from pikanid.tracking.tracked import Track
from pikanid.tracking.video import track

__all__ = ["ColourRange", "Geometry", "Region", "Track", "TrackingSettings", "from_corners",
           "from_edges", "track"]
