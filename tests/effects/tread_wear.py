"""The effect of a user's own that the manual shows, installed as a package would install it."""

import re
import sys
from pathlib import Path

from parcontact.door import manual_texts
from parcontact.job import listing, model


def shown() -> str:
    """The module, as the manual has it."""
    found: str = re.findall(r"```python\n(# tread_wear.py\n.*?)```", manual_texts.page("effects"), re.S)[0]
    return found


def install(directory: Path, module: str) -> None:
    """Put the module and its entry point, as the manual has that, into a directory of the path."""
    (directory / "tread_wear.py").write_text(module)
    entry = re.findall(
        r'\[project.entry-points."parcontact.effects"\]\n(.*?)\n```', manual_texts.page("effects"), re.S
    )[0]
    package = directory / "tread_wear-1.0.dist-info"
    package.mkdir(exist_ok=True)
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: tread-wear\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text(f"[parcontact.effects]\n{entry.replace(chr(34), '')}\n")


def forget() -> None:
    """The program forgets the sections that it has found, and looks for them anew."""
    for found in (listing._registered, listing._load, listing.why_unusable, model.extended_model):
        found.cache_clear()
    sys.modules.pop("tread_wear", None)
