# Imports modules from a few bundles: each holds an index of its members, then their code. Python's own finders try
# folders and endings for every module: a small one takes 0.3 ms, from here 0.02. Python imports this file before
# everything that is not needed to read text.
import marshal
import os
import sys
from _frozen_importlib import ModuleSpec
from _frozen_importlib_external import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder

SITE_PACKAGES = "/lib/python3.14/site-packages/"


class Modules:
    def __init__(self, data, folder):
        end = data.index(b"\n\n")
        self.code, self.folder, self.places = memoryview(data), folder, {}
        at = end + 2
        for line in data[:end].decode().split("\n"):
            member, size = line.split(" ")
            name = member.removesuffix("/__init__").replace("/", ".")
            self.places[name] = member, at, at + int(size)
            at += int(size)

    def find_spec(self, name, path=None, target=None):
        if name not in self.places:
            return None
        member = self.places[name][0]
        package = member.endswith("/__init__")
        spec = ModuleSpec(name, self, origin=f"{self.folder}{member}.pyc", is_package=package)
        spec.has_location = True
        if package:
            spec.submodule_search_locations.append(self.folder + member.removesuffix("/__init__"))
        return spec

    def create_module(self, spec):
        return None

    def exec_module(self, module):
        _, start, end = self.places[module.__name__]
        exec(marshal.loads(self.code[start:end]), module.__dict__)

    def folder_hook(self, path):
        name = path.removeprefix(self.folder).replace("/", ".")
        if not path.startswith(self.folder) or name not in self.places:
            raise ImportError(f"{path} is not a package of these modules", path=path)
        return Package(name, path)


class Package:
    """Lists a package's modules for pkgutil, and finds its shared libraries, which are files."""

    def __init__(self, name, path):
        self.name = name
        self.find_spec = FileFinder(path, (ExtensionFileLoader, EXTENSION_SUFFIXES)).find_spec

    def iter_modules(self, prefix=""):
        names = [name for finder in sys.meta_path if isinstance(finder, Modules) for name in finder.places]
        parents = {name.rpartition(".")[0] for name in names}
        for name in [*names, *later.packs]:
            parent, _, last = name.rpartition(".")
            if parent == self.name:
                yield prefix + last, name in parents


class Later:
    """Modules in packs that are not loaded yet: their import fails, and the worker asks which pack is needed."""

    folder = SITE_PACKAGES

    def __init__(self):
        self.packs, self.wanted = {}, None

    def expect(self, top, file):
        """Note that a module and everything below it are in a file of the runtime, "hash/name.pack"."""
        self.packs[top] = file

    def find_spec(self, name, path=None, target=None):
        for top, file in self.packs.items():
            if f"{name}.".startswith(f"{top}."):
                self.wanted = file
                raise ModuleNotFoundError(f"{name} comes with {file}, which is not loaded yet", name=name)

    def taken(self):
        """The file that an import has needed since the last call, or None."""
        wanted, self.wanted = self.wanted, None
        return wanted

    def arrived(self, file):
        """Make the file's modules importable, now that its members are among the packages."""
        self.packs = {top: pack for top, pack in self.packs.items() if pack != file}
        name = file.rpartition("/")[2].removesuffix(".pack")
        if "dataclasses" in sys.modules:
            sys.modules["dataclasses"]._read_prepared(f"{SITE_PACKAGES}{name}.dataclasses")
        with open(f"{SITE_PACKAGES}{name}.modules", "rb") as bundle:
            install(bundle.read(), SITE_PACKAGES)


def install(data, folder):
    modules = Modules(data, folder)
    sys.meta_path.insert(0, modules)
    sys.path_hooks.insert(0, modules.folder_hook)


def install_all():
    try:
        library = __loader__.archive + "/"
        install(__loader__.get_data(library + "library.modules"), library)
        for name in sorted(os.listdir(SITE_PACKAGES)):
            if name.endswith(".modules"):
                with open(SITE_PACKAGES + name, "rb") as file:
                    install(file.read(), SITE_PACKAGES)
    except (AttributeError, OSError):
        pass  # before the build has made bundles, every module is a file


install_all()
later = Later()
sys.meta_path.append(later)
