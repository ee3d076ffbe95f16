"""The web manifest, which makes the site installable. It lies among the assets, so its addresses are relative to
them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import PurePosixPath

ICONS = {
    "icon-192.png": ("192x192", "any"),
    "icon-512.png": ("512x512", "any"),
    "icon-maskable.png": ("512x512", "maskable"),
}
SHORT = 12  # characters, the longest name that a home screen shows whole


def web_manifest(title: str, description: str, language: str, ground: str, pictures: Mapping[str, str]) -> bytes:
    """The manifest as JSON. ground: the pages' background colour; pictures: name → place on the site, with all
    ICONS."""
    icons = [
        {"src": PurePosixPath(pictures[name]).name, "sizes": sizes, "type": "image/png", "purpose": purpose}
        for name, (sizes, purpose) in ICONS.items()
    ]
    words = title.split()
    manifest = {
        "name": title,
        "short_name": title if len(title) <= SHORT else words[-1],
        "description": description,
        "lang": language,
        "start_url": "../index.html",
        "scope": "../",
        "display": "standalone",
        "background_color": ground,
        "theme_color": ground,
        "categories": ["education"],
        "icons": icons,
    }
    return json.dumps(manifest, ensure_ascii=False, indent=1).encode()
