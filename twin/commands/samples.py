"""`twin samples`: the recordings that ship."""

from __future__ import annotations

import argparse
import json

from recordings.samples import DESCRIPTIONS, sample_path


def run(options: argparse.Namespace) -> int:
    """List the samples; each name stands for its file wherever a command takes a recording."""
    if options.json:
        found = {name: {"text": text, "file": str(sample_path(name))} for name, text in DESCRIPTIONS.items()}
        print(json.dumps(found, indent=2))
    else:
        width = max(map(len, DESCRIPTIONS))
        print("\n".join(f"{name:{width}}  {text}" for name, text in DESCRIPTIONS.items()))
        print("as in: twin replay free, twin view free, twin compare sine, twin export fall --to csv")
    return 0
