"""What a rendered picture shows: a tank with dyed liquid, its light, and the camera."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pikanid.tracking.render.passing import Array, Colour, Cover, Splash
from pikanid.tracking.render.pattern import Pattern


@dataclass(frozen=True)
class Glare:
    """A reflection: a soft bright ellipse that the camera sees in front of everything.

    Attributes:
        x, y: Its middle in the picture [px].
        width, height: Standard deviations along both axes [px].
        strength: Grey levels that are added in the middle.
    """

    x: float
    y: float
    width: float = 12.0
    height: float = 30.0
    strength: float = 120.0


@dataclass(frozen=True)
class Scene:
    """A tank of dyed liquid in front of a camera.

    Attributes:
        size: Height and width of the picture [px].
        tank: Left, top, width and height of the tank's inside [px], seen straight on.
        level: Of the surface at rest above the tank's floor, share of the tank's height.
        air, dye, outside, wall: Colours, RGB from 0 to 255.
        thickness: Of the tank's wall [px].
        light: Relative change of brightness from the middle to the right and to the lower edge.
        glare: Reflections.
        meniscus: How far the liquid climbs at the walls, and how far from them it does [px].
        yaw, pitch: Of the camera about the vertical and the horizontal axis [rad].
        distance: Of the camera from the tank, in widths of the tank.
        blur: Standard deviation of the optics' Gaussian blur [px].
        noise: Standard deviation of the sensor's noise [grey levels].
        covers: What passes in front of the tank.
        splashes: Drops above the surface.
        pattern: A printed patch in the tank's plane, if there is one.
        glued: Whether it is on the tank; else on what stands behind it.
        riding: Whether the camera moves with the tank; else it stands.
        gone: How far the tank has moved since the first picture (x, y) [px], seen straight on.

    >>> Scene().waterline
    255.0
    """

    size: tuple[int, int] = (480, 640)
    tank: tuple[int, int, int, int] = (170, 60, 300, 390)
    level: float = 0.5
    air: Colour = (205.0, 208.0, 200.0)
    dye: Colour = (40.0, 80.0, 175.0)
    outside: Colour = (120.0, 122.0, 118.0)
    wall: Colour = (170.0, 175.0, 178.0)
    thickness: int = 5
    light: tuple[float, float] = (0.0, 0.0)
    glare: tuple[Glare, ...] = ()
    meniscus: tuple[float, float] = (0.0, 8.0)
    yaw: float = 0.0
    pitch: float = 0.0
    distance: float = 6.0
    blur: float = 0.8
    noise: float = 3.0
    covers: tuple[Cover, ...] = ()
    splashes: tuple[Splash, ...] = ()
    pattern: Pattern | None = None
    glued: bool = True
    riding: bool = False
    gone: tuple[float, float] = (0.0, 0.0)

    def at(self, x: float, y: float) -> Scene:
        """The same when the tank has gone so far [px].

        >>> Scene().at(3.0, 1.0).place, Scene(riding=True).at(3.0, 1.0).place
        ((173.0, 61.0), (170.0, 60.0))
        """
        return replace(self, gone=(x, y))

    @property
    def place(self) -> tuple[float, float]:
        """Left and top of the tank's inside now [px], seen straight on."""
        moves = 0.0 if self.riding else 1.0
        return self.tank[0] + moves * self.gone[0], self.tank[1] + moves * self.gone[1]

    @property
    def shift(self) -> tuple[float, float]:
        """By which the pattern has moved (x, y) [px], seen straight on."""
        moves = float(self.glued) - float(self.riding)
        return moves * self.gone[0], moves * self.gone[1]

    @property
    def waterline(self) -> float:
        """Row of the surface at rest, seen straight on [px]."""
        _, _, _, height = self.tank
        return self.place[1] + (1 - self.level) * height

    @property
    def corners(self) -> Array:
        """Where the camera sees the corners of the tank's inside (4, 2) [px]: upper left, upper
        right, lower right, lower left.
        """
        (left, top), (_, _, width, height) = self.place, self.tank
        flat = np.array([[left, top], [left + width, top], [left + width, top + height],
                         [left, top + height]], float)
        return self.seen(flat)

    def seen(self, points: Array) -> Array:
        """Points (N, 2) of the tank's plane [px], as the turned camera sees them."""
        moved = np.column_stack([points, np.ones(len(points))]) @ self.homography.T
        return np.asarray(moved[:, :2] / moved[:, 2:])

    @property
    def homography(self) -> Array:
        """From the plane seen straight on to the picture (3, 3): a pinhole camera, turned about
        the middle of the tank where it was first.
        """
        left, top, width, height = self.tank
        x, y, far = left + width / 2, top + height / 2, self.distance * width
        cy, sy, cp, sp = (np.cos(self.yaw), np.sin(self.yaw), np.cos(self.pitch),
                          np.sin(self.pitch))
        turned = np.array([[cy, 0, 0], [sp * sy, cp, 0], [cp * sy / far, -sp / far, 1]])
        there = np.array([[1, 0, -x], [0, 1, -y], [0, 0, 1]])
        back = np.array([[1, 0, x], [0, 1, y], [0, 0, 1]])
        return back @ turned @ there
