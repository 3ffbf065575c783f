"""Helpers handed to helpers, in a way that numba can cache.

A compiled function that takes another one as an argument is specialised for it, but numba then stores
the address of the Python object with the code, and such code is not cached on disk. A bundle carries its
helpers (and constants) in its *type*: it has no value at run time, so nothing is stored, and the calls
are resolved, and inlined where that pays, when the kernel is compiled.
"""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Any

from numba import types
from numba.core.extending import (
    infer_getattr,
    models,
    register_model,
    typeof_impl,
)
from numba.core.imputils import lower_constant, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate


class Bundle:
    """Helpers and numbers by their names; a global of the module whose kernels use it.

    Examples
    --------
    >>> from contfric.compiled import helper
    >>> bundle = Bundle(twice=helper(lambda x: 2.0 * x), absolute=1e-12)
    >>> bundle.members["absolute"]
    1e-12
    """

    def __init__(self, **members: Any) -> None:
        self.members = members

    @cached_property
    def name(self) -> str:
        """A name that is the same in every process, and another one for other members.

        It is part of the symbols of compiled code: code from the cache must not meet other code of the
        same name, as it would if this were an address.
        """
        content = hashlib.sha256()
        for key, member in sorted(self.members.items()):
            code = getattr(getattr(member, "py_func", None), "__code__", None)
            place = (code.co_filename, code.co_name, code.co_firstlineno) if code else repr(member)
            content.update(f"{key}={place};".encode())
        return f"Bundle{content.hexdigest()[:16]}"


class BundleType(types.Opaque):  # type: ignore[misc]
    """Numba's type of one bundle: two bundles are two types."""

    def __init__(self, bundle: Bundle) -> None:
        self.bundle = bundle
        super().__init__(bundle.name)

    @property
    def key(self) -> Any:
        """What makes it equal to another type: the same bundle, not one of the same name."""
        return self.name, id(self.bundle)


register_model(BundleType)(models.OpaqueModel)


@typeof_impl.register(Bundle)  # type: ignore[untyped-decorator]
def _typeof(bundle: Bundle, context: Any) -> BundleType:
    return BundleType(bundle)


@infer_getattr
class _Members(AttributeTemplate):  # type: ignore[misc]
    """What an attribute of a bundle is: a helper, or a number."""

    key = BundleType

    def generic_resolve(self, bundle: BundleType, name: str) -> Any:
        member = bundle.bundle.members.get(name)
        if member is None:
            return None
        return _number(member) or types.Dispatcher(member)


@lower_constant(BundleType)  # type: ignore[untyped-decorator]
def _no_value(context: Any, builder: Any, bundle: BundleType, value: Bundle) -> Any:
    return context.get_dummy_value()


@lower_getattr_generic(BundleType)  # type: ignore[untyped-decorator]
def _member(context: Any, builder: Any, bundle: BundleType, value: Any, name: str) -> Any:
    member = bundle.bundle.members[name]
    number = _number(member)
    return context.get_dummy_value() if number is None else context.get_constant(number, member)


def _number(member: Any) -> Any:
    if isinstance(member, float):
        return types.float64
    return types.int64 if isinstance(member, int) else None
