"""Pictures and clips of a dyed liquid's surface, drawn to the truth.

This room knows nothing of the tracker: what it draws is geometry, light and a camera.

`scene` says what there is to see, `passing` what is in its way, `pattern` a patch to
follow, `stage` draws it, `clip` writes
videos.
"""

from pikanid.tracking.render.clip import write
from pikanid.tracking.render.passing import Cover, Splash
from pikanid.tracking.render.pattern import Pattern
from pikanid.tracking.render.scene import Glare, Scene
from pikanid.tracking.render.stage import Stage, picture

__all__ = ["Cover", "Glare", "Pattern", "Scene", "Splash", "Stage", "picture", "write"]
