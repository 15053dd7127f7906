"""Pictures and clips of a dyed liquid's surface, drawn to the truth.

This room knows nothing of the tracker: what it draws is geometry, light and a camera.

`scene` says what there is to see, `stage` draws it, `clip` writes videos.
"""

from pikanid.tracking.render.clip import write
from pikanid.tracking.render.scene import Glare, Scene
from pikanid.tracking.render.stage import Stage, picture

__all__ = ["Glare", "Scene", "Stage", "picture", "write"]
