"""`twin scenes`: what ships with the package."""

from __future__ import annotations

import argparse
import json
import sys

from twin.errors import InputError, did_you_mean
from twin.scene import load_scene, shipped_scenes


def run(options: argparse.Namespace) -> int:
    """List the scenes, or print one."""
    texts = shipped_scenes()
    if options.name is not None:
        if options.name not in texts:
            raise InputError(f"no scene named {options.name!r}{did_you_mean(options.name, texts)}")
        scene = load_scene(options.name)
        text = scene.model_dump_json(indent=2) + "\n" if options.json else texts[options.name]
        sys.stdout.write(text)
        return 0
    titles = {name: load_scene(name).title for name in texts}
    if options.json:
        print(json.dumps(titles, indent=2))
    else:
        width = max(len(name) for name in titles)
        print("\n".join(f"{name:<{width}}  {title}" for name, title in titles.items()))
        print("\n`twin scenes NAME` prints one; copy it to a .toml file of your own and change it.")
    return 0
