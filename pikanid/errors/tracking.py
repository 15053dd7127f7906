"""What can be wrong with videos, and with what is said about them."""

from __future__ import annotations

from collections.abc import Iterable

from pikanid.errors.wording import listed


def bad_surface(shape: tuple[int, ...]) -> str:
    return (f"A surface of shape {shape} cannot be drawn; give an angle, or two or more finite "
            "heights from wall to wall, (n,) or (moments, n).")


def unknown_codec(path: str, codec: str, known: Iterable[str]) -> str:
    return (f"'{path}' cannot be written with codec '{codec}'; choose a name in .mp4 (mp4v), or in "
            f".avi (mjpg, ffv1), and one of {listed(known)}.")


def bad_colour_range(text: str) -> str:
    return (f"The colour range '{text}' cannot be read; give three ranges from low to high, as in "
            "'hsv:95..130,80..255,40..255' (hue to 179) or 'lab:0..255,90..140,20..110'.")


def one_colour() -> str:
    return ("The region shows no two colours, air above and dyed liquid below; set the region of "
            "the tank's inside, or the range of the liquid's colour.")


def no_video(where: str) -> str:
    return (f"'{where}' holds no picture that can be read: it is no video or no image, or its end, "
            "where some cameras put the index, is missing; record it again or convert it.")


def rate_of_images(where: str) -> str:
    return f"Images in '{where}' have no times; give the camera's rate in frames per second."


def no_tank() -> str:
    return ("No dyed liquid stands out from the first frames; set the region of the tank's inside, "
            "and the range of the liquid's colour if it is grey.")


def bad_corners() -> str:
    return ("Corners of the tank are four points of a convex quadrangle in the picture, clockwise "
            "from the upper left one.")


def bad_tank(width: float, height: float) -> str:
    return (f"A tank of {width:g} m x {height:g} m cannot be: give the width and height between "
            "the corners, such as 66mm,90mm.")


def bad_edge(side: str) -> str:
    return (f"The tank's {side} edge needs two or more points (x, y) in the picture, three or more "
            "where the lens bends it.")


def no_motion() -> str:
    return "--column, --position and --delay say how --motion is read: name the file of the motion."


def corners_and_tank() -> str:
    return ("--corners takes four points, --tank the width and the height between them, and one "
            "needs the other; --lens needs both, as in --corners \"168,60 471,66 470,452 170,448\" "
            "--tank 66mm,90mm.")


def not_so_many_numbers(option: str, text: str, count: int) -> str:
    return f"{option} takes {count} numbers with commas between them, not '{text}'."


def marker_outside(place: tuple[int, ...], size: tuple[int, int], least: int) -> str:
    return (f"The marker {','.join(map(str, place))} must lie within the picture of {size[1]} x "
            f"{size[0]} pixels and be {least} pixels or more wide and high.")


def marker_without_texture(place: tuple[int, ...]) -> str:
    return (f"The marker {','.join(map(str, place))} has no texture that can be recognised in both "
            "directions; choose a patch with corners or dots that is found nowhere else.")


def marker_or_motion() -> str:
    return "--marker and --motion both say what moved the tank: give one of them."


def no_scale() -> str:
    return ("How long a pixel is at the marker is not known: give --pixel, as 0.22mm, or the size "
            "of the tank's inside as --tank 66mm,90mm together with its place as --roi or "
            "--corners.")


def bad_pixel(length: float) -> str:
    return f"A pixel of {length:g} m cannot be: give its length at the marker, such as 0.22mm."


def pixel_without_marker() -> str:
    return "--pixel is the length of a pixel at a marker: name the marker's place with --marker."


def uneven_pixels(across: float, down: float) -> str:
    return (f"By --tank and --roi a pixel is {across:.4g} m wide and {down:.4g} m high: the region "
            "is not the tank's inside, or the camera looks askew; give --corners, or --pixel.")
