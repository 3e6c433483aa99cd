"""Extension for the documentation: classes in Rust have `__new__`, but griffe only knows `__init__`."""

from typing import Any

import griffe


class Constructors(griffe.Extension):
    """Shows the signature of `__new__` as the signature of the class."""

    def on_class_members(self, *, cls: griffe.Class, **kwargs: Any) -> None:
        new = cls.members.get("__new__")
        if isinstance(new, griffe.Function) and "__init__" not in cls.members:
            init = griffe.Function(
                "__init__", parameters=new.parameters, lineno=new.lineno, endlineno=new.endlineno
            )
            cls.set_member("__init__", init)
