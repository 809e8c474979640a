"""Generated pages: the reference of the Python package, the catalogue of effects with a picture each."""

from __future__ import annotations

import pathlib
import sys

from mkdocs.structure.files import File

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import effects  # noqa: E402
import reference  # noqa: E402


def on_files(files, config):
    for uri, content in {**reference.pages(), **effects.pages(), **effects.pictures()}.items():
        files.append(File.generated(config, uri, content=content))
    return files
