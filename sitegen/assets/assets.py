"""The pages' assets: style sheets, one script, the worker and pictures, all named by their content."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from sitegen.assets.bundle import Bundle, Entry, bundled, read_files
from sitegen.assets.css import urls
from sitegen.assets.download import Download
from sitegen.assets.hosting import MAP
from sitegen.assets.panel_classes import filled
from sitegen.assets.preload import Preload, preloads
from sitegen.assets.typefaces import FontSet
from sitegen.cache.files import hashed_name
from sitegen.problems import Place, Problems, hint
from sitegen.progress import Progress, quiet

PICTURES = (".svg", ".png", ".ico", ".webp", ".jpg")
ENTRIES = {  # file in templates/assets → its name on the site, the attribute of Assets for that name
    "css/site.css": ("site.css", "css"),
    "css/deck.css": ("deck.css", "deck_css"),
    "js/main.js": ("site.js", "js"),
    "js/theme.js": ("theme.js", "theme"),
    "worker.mjs": ("worker.mjs", "worker"),
}


@dataclass
class Assets:
    """The names of the loaded files, relative to the site, and their contents."""

    files: dict[str, bytes] = field(default_factory=dict)
    css: str = ""
    deck_css: str = ""
    js: str = ""
    theme: str = ""
    worker: str = ""
    search_library: str = ""
    search_data: str = ""
    pictures: dict[str, str] = field(default_factory=dict)
    preload: tuple[Preload, ...] = ()
    manifest: str = ""
    ground: tuple[str, str] = ("", "")  # behind the pages, light and dark
    download: Download | None = None
    runtime: dict[str, object] | None = None

    def has(self, name: str) -> bool:
        """Whether templates/assets holds this picture."""
        return name in self.pictures

    def get(self, name: str) -> str:
        """The picture's name on the site."""
        return self.pictures[name]

    def preloads(self, page: str) -> list[str]:
        """The typeface files that a page with this HTML preloads."""
        return preloads(self.preload, page)

    def from_disk(self) -> Assets:
        """The same for pages on a reader's disk, where browsers refuse to preload, and without manifest and
        download."""
        return replace(self, preload=(), manifest="", download=None)

    def add(self, name: str, data: bytes) -> str:
        """Add a file under assets/ and return its name, which holds its content's hash."""
        hashed = hashed_name(f"assets/{name}", data)
        self.files[hashed] = data
        return hashed


def read_assets(
    root: Path,
    pictures: Mapping[str, bytes],
    fontset: FontSet | None,
    mathematics_css: str,
    problems: Problems,
    cache: Path,
    progress: Progress = quiet,
) -> Assets:
    """Read templates/assets and add the pictures that the build draws and its fonts, whose styles and those of the
    mathematics come before its own sheets."""
    home = root / "templates" / "assets"
    assets = Assets()
    lying = {path.name: path.read_bytes() for path in sorted(home.glob("*")) if path.suffix in PICTURES}
    for name, data in {**pictures, **lying}.items():
        assets.pictures[name] = assets.add(name, data)
    if fontset:
        assets.files |= {f"assets/fonts/{name}": data for name, data in fontset.files.items()}
        assets.preload = tuple(replace(entry, url=f"assets/{entry.url}") for entry in fontset.preload)
    files: dict[str, str] = {}
    for folder, pattern in (("js", "*.js"), ("css", "*.css"), ("", "*.mjs")):
        files |= read_files(root, f"templates/assets/{folder}".rstrip("/"), pattern, problems)
    files = {name: filled(text) for name, text in files.items()}
    entries = [entry for entry in _entries(files, assets, problems) if entry.path in files]
    prelude = f"{fontset.css if fontset else ''}\n{mathematics_css}\n"
    for entry, bundle in zip(entries, bundled(entries, cache, problems, progress), strict=True):
        name, attribute = ENTRIES[entry.path.removeprefix("templates/assets/")]
        setattr(assets, attribute, _put(assets, name, bundle, prelude if attribute == "css" else ""))
    return assets


def _entries(files: Mapping[str, str], assets: Assets, problems: Problems) -> list[Entry]:
    """The entries to bundle, each with all files of its kind."""
    entries = []
    for path in ENTRIES:
        path = f"templates/assets/{path}"
        group = {name: text for name, text in files.items() if Path(name).suffix == Path(path).suffix}
        pictures = _picture_addresses(group, assets, problems) if path.endswith(".css") else {}
        entries.append(Entry(path, group, pictures))
    return entries


def _put(assets: Assets, name: str, bundle: Bundle, prelude: str) -> str:
    """Add a bundle and its source map, which its last line names; the `prelude` is not in the map."""
    if not bundle.code:
        return assets.add(name, prelude.encode())
    source_map = assets.add(f"{name}{MAP}", bundle.placed(prelude.count("\n")).encode())
    comment = f"sourceMappingURL={PurePosixPath(source_map).name}"
    last = f"/*# {comment} */" if name.endswith(".css") else f"//# {comment}"
    return assets.add(name, f"{prelude}{bundle.code.rstrip()}\n{last}\n".encode())


def _picture_addresses(sheets: Mapping[str, str], assets: Assets, problems: Problems) -> dict[str, str]:
    """The addresses on the site of the pictures that the sheets name by url(…); unknown ones go to `problems`."""
    addresses = {}
    for path, text in sheets.items():
        for url in urls(text):
            name = url.address
            if name.startswith(("data:", "#")):
                continue
            if name in assets.pictures:
                addresses[name] = assets.pictures[name].removeprefix("assets/")
                continue
            message = f"unknown picture {name!r}, not in templates/assets{hint(name, assets.pictures)}"
            problems.add(Place(path, url.line, url.column), message)
    return addresses
