"""Joins the types of the extension's classes, from the stub, and their docstrings, from the extension."""

from __future__ import annotations

import inspect

import furuta
import griffe


class FromTheExtension(griffe.Extension):
    def on_package(self, *, pkg: griffe.Module, **_: object) -> None:
        if pkg.path == "furuta":
            for name, thing in pkg.members["_furuta"].members.items():
                if name in furuta.__all__ and thing.is_class:
                    self.join(thing.final_target if thing.is_alias else thing, getattr(furuta, name))

    def join(self, thing: griffe.Object, at_run_time: object) -> None:
        """Gives what the stub declares, and its public members, the docstrings of what is there at run time."""
        has_own = (
            inspect.isroutine(at_run_time) or inspect.isclass(at_run_time) or inspect.isdatadescriptor(at_run_time)
        )
        if has_own and not thing.docstring and (text := inspect.getdoc(at_run_time)):
            thing.docstring = griffe.Docstring(text, parent=thing, parser="numpy")
        for name, member in thing.members.items():
            if not name.startswith("_"):
                self.join(member, getattr(at_run_time, name, None))
