"""Classes of the compiled module are made by `__new__`; their pages show its arguments as those of any other class."""

from typing import Any

import griffe


class Constructors(griffe.Extension):
    """Shows `__new__` as `__init__`."""

    def on_class(self, *, cls: griffe.Class, **_: Any) -> None:
        """Called for each class that has been read."""
        new = cls.members.get("__new__")
        if isinstance(new, griffe.Function) and "__init__" not in cls.members:
            new.name = "__init__"
            cls.members["__init__"] = new
            del cls.members["__new__"]
