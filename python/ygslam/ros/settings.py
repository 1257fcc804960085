"""The settings of `ygslam config`, as the parameters of a node want them."""
from __future__ import annotations

import re
from typing import NamedTuple

_LINE = re.compile(r"(?P<key>[a-z_]+\.\w+)\s+(?P<value>\S+)(?P<unit> [^ ]+(?: [^ ]+)*)?\s{2,}(?P<meaning>.+)")
_NUMBERS = re.compile(r"\((?P<low>-?[\d.e+-]+) \.\. (?P<high>-?[\d.e+-]+)\)$")


class Setting(NamedTuple):
    key: str
    default: bool | int | float | str
    meaning: str  # with unit and range, for people
    low: float | None
    high: float | None


def _typed(text: str):
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def parsed(listing: str) -> list[Setting]:
    """@param listing what `ygslam config` prints."""
    found = []
    for line in listing.splitlines():
        match = _LINE.match(line)
        if not match:
            continue
        numbers = _NUMBERS.search(match["meaning"])
        found.append(Setting(match["key"], _typed(match["value"]), match["meaning"] + (
            f" [{match['unit'].strip()}]" if match["unit"] else ""),
            float(numbers["low"]) if numbers else None, float(numbers["high"]) if numbers else None))
    return found


def text_of(value) -> str:
    """As --set wants it."""
    return str(value).lower() if isinstance(value, bool) else str(value)
