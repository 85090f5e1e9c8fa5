"""Which methods are compared, and at which settings."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mpcam.effects.mirror_methods import MIRROR_METHODS
from mpcam.errors import InputError
from mpcam.rendering.registry import METHODS

MAX_TRIANGLES = 4_000_000


def knob(method: str) -> str | None:
    """The setting that trades time for error; None for methods that are compared as they are."""
    entry = METHODS.get(method) or MIRROR_METHODS.get(method)
    return entry.knob if entry else None


@dataclass(frozen=True, eq=False)
class Choice:
    """One row to be: a method, the settings that it is called with, and what to say about it."""

    method: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""

    @property
    def parameter(self) -> Any:
        """The value of the method's own parameter, or None."""
        return self.settings.get(knob(self.method) or "")

    @property
    def setting(self) -> str:
        """The settings as text: the bare number of the method's own parameter (levels named), others as name=value."""
        parts = []
        for name, value in self.settings.items():
            if name != knob(self.method):
                parts.append(f"{name}={value}")
            else:
                parts.append(f"level {value}" if name == "level" else f"{value}")
        return " ".join(parts)

    @property
    def label(self) -> str:
        return f"{self.method} {self.setting}".strip()


def make_plan(
    triangles: int,
    methods: Iterable[str] | None = None,
    settings: Mapping[str, Sequence[Mapping[str, Any] | float]] | None = None,
    camera: Any = None,
) -> list[Choice]:
    """Choose methods and settings for a mesh of so many triangles; whether a camera suits them, `prepare` knows.

    methods: names out of `mpcam.rendering.registry.METHODS`; None for those that are usual
    for the camera. settings: method -> list of settings, each a
    mapping for `prepare` or the bare number of the method's parameter, e.g. {"vertex": [0, 3], "invert": [{"bound":
    "tight"}]}; methods that it does not name keep theirs. Raises `InputError` for names that do not exist.
    """
    usual = [name for name, method in METHODS.items() if method.usual(camera)]
    names = usual if methods is None else list(dict.fromkeys(_named(methods)))
    settings = dict(settings or {})
    for name in (*names, *settings):
        if name not in METHODS:
            raise InputError(f"Unknown method {name!r}; the methods: {', '.join(METHODS)}.")
    idle = [name for name in settings if name not in names]
    if idle:
        raise InputError(f"settings are given for {', '.join(idle)}, not among the methods: {', '.join(names)}.")
    choices: list[Choice] = []
    for name in names:
        if name in settings:
            choices += [_choice(name, entry) for entry in settings[name]]
        else:
            choices += _defaults(name, triangles)
    labels = [choice.label for choice in choices]
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        raise InputError(f"settings name {', '.join(twice)} twice; give each setting once.")
    return choices


def _named(methods: Iterable[str]) -> Iterable[str]:
    return [methods] if isinstance(methods, str) else methods


def _defaults(method: str, triangles: int) -> list[Choice]:
    name, values, note = knob(method), METHODS[method].values, ""
    if name is None:
        return [Choice(method)]
    if name == "level":
        levels = [level for level in values if level == 0 or triangles * 4**level <= MAX_TRIANGLES]
        note = "" if levels == list(values) else f"higher levels left out: more than {MAX_TRIANGLES:,} triangles"
        values = tuple(levels)
    return [Choice(method, {name: value}, note if value == values[-1] else "") for value in values]


def _choice(method: str, entry: Mapping[str, Any] | float) -> Choice:
    if isinstance(entry, Mapping):
        return Choice(method, dict(entry))
    name = knob(method)
    if name is None:
        raise InputError(f"Setting {entry!r} of {method}: this method has no number to set; give a mapping, or {{}}.")
    return Choice(method, {name: entry})
