"""The rooms of the code, as its imports have them: an arrow leads to a room that is used, unless it is used by way of
another that is drawn.
"""

from collections import Counter

from matplotlib import pyplot
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from tools.rooms import ROOMS, SOURCES, arrows, modules, room_of

FORMAT = "svg"
WIDE, HIGH = 1.5, 0.42


def uses():
    """Rooms by name, each with the rooms that its files import, and how many files each has."""
    files = modules(SOURCES)
    found = {name: set() for name in ROOMS}
    for module, others in arrows(files).items():
        found[room_of(module)] |= {room_of(other) for other in others} - {room_of(module)}
    return found, Counter(room_of(name) for name in files)


def reachable(found, room):
    """All rooms that a room leads to."""
    return found[room].union(*(reachable(found, other) for other in found[room]))


def draw(theme):
    found, count = uses()
    floor = {}
    for room in ROOMS:
        floor[room] = 1 + max((floor[other] for other in found[room]), default=-1)
    places = {}
    for level in range(max(floor.values()) + 1):
        row = [room for room in ROOMS if floor[room] == level]
        for number, room in enumerate(row):
            places[room] = (2.0 * (number - 0.5 * (len(row) - 1)) + 0.25 * (level % 2), 0.8 * level)
    figure, axes = pyplot.subplots(figsize=(theme.width, 0.5 * max(floor.values()) + 0.8))
    for room, others in found.items():
        direct = others - set().union(*(reachable(found, other) for other in others)) if others else set()
        for other in direct:
            start, end = places[room], places[other]
            axes.add_patch(
                FancyArrowPatch(
                    (start[0], start[1] - 0.5 * HIGH),
                    (end[0], end[1] + 0.5 * HIGH),
                    arrowstyle="-|>",
                    mutation_scale=8,
                    color=theme.weak,
                    linewidth=0.8,
                )
            )
    for room, (x, y) in places.items():
        box = FancyBboxPatch(
            (x - 0.5 * WIDE, y - 0.5 * HIGH),
            WIDE,
            HIGH,
            boxstyle="round,pad=0,rounding_size=0.08",
            facecolor=theme.page,
            edgecolor=theme.palette[0],
        )
        axes.add_patch(box)
        axes.text(x, y, f"{room}  {count[room]}", ha="center", va="center")
    across = [x for x, _ in places.values()]
    axes.set_xlim(min(across) - WIDE, max(across) + WIDE)
    axes.set_ylim(-HIGH, 0.8 * max(floor.values()) + HIGH)
    axes.set_axis_off()
    return figure
