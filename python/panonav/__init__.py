"""Image-based memory for robot navigation from omnidirectional images.

    >>> import panonav
    >>> panonav.memorise("office.panonav", "memory_run")
    >>> place = panonav.localise("office.panonav", "query_run/view_00003.png")
    >>> if place.position: print(place.position.x_m, place.position.y_m)

Images are arrays of uint8 or uint16, PIL images or paths; panoramas are float32. Angles are in
radians, counter-clockwise; lengths in metres. "No answer" is None; what is wrong raises panonav.Error, which
is a ValueError for values and an OSError for files. Results have `to_dict()`, of which pandas makes tables.
"""
from ._core import *  # noqa: F403
from ._core import __version__

#: Names of the models that `Camera` has.
camera_models: tuple
#: Names of the scenes that come with `SimulatedWorld`.
scenes: tuple
