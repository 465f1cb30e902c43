"""Names of configurations: which interfaces are open, and about which corner.

A configuration is a tuple of signs, one for each interface from the base up: 0 closed, +1 open about the +x corner (the
block above leans more towards +x than what it stands on), -1 open about the -x corner. Two blocks have the names of the
thesis (N. Ceh, Rijeka 2018, chapter 6).
"""

from __future__ import annotations

from typing import TypeAlias

Configuration: TypeAlias = tuple[int, ...]

TWO_BLOCKS: dict[str, Configuration] = {
    "1a": (1, 1),
    "2a": (1, -1),
    "1b": (-1, -1),
    "2b": (-1, 1),
    "3a": (1, 0),
    "3b": (-1, 0),
    "4a": (0, 1),
    "4b": (0, -1),
}

_NAMES = {signs: name for name, signs in TWO_BLOCKS.items()}


def configuration_name(signs: Configuration) -> str:
    """Return the name of a configuration: the thesis' for two blocks, "rest" where all is closed, else the signs.

    Examples
    --------
    >>> configuration_name((1, -1)), configuration_name((0, 1, -1)), configuration_name((0, 0))
    ('2a', '0+-', 'rest')
    """
    if not any(signs):
        return "rest"
    return _NAMES.get(signs, "".join("0+-"[sign] for sign in signs))


def configuration_signs(name: str, blocks: int) -> Configuration:
    """Return the signs of a configuration called `name`, of so many blocks.

    Raises
    ------
    ValueError
        Where there is none of that name.
    """
    if name == "rest":
        return (0,) * blocks
    if blocks == 2 and name in TWO_BLOCKS:
        return TWO_BLOCKS[name]
    signs = tuple({"0": 0, "+": 1, "-": -1}.get(letter, 2) for letter in name)
    if len(signs) != blocks or 2 in signs:
        known = f"rest, {', '.join(TWO_BLOCKS)}, or" if blocks == 2 else "rest, or"
        raise ValueError(
            f"{name!r} is no configuration of {blocks} blocks: {known} a sign +, - or 0 for each interface"
        )
    return signs
