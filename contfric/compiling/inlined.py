"""Helpers as parts of the kernels that call them: typed and lowered once, compiled only inside of a kernel.

Numba optimises every function, with all that it calls, and turns it into machine code before it is linked
into its callers, where the same is done again: along a chain of calls the innermost function is compiled
once for each level. A helper is never called from outside, so all but the last time is wasted: half of the
time that a new model takes to compile. Here its code stays as it was lowered, and the kernel alone
(:mod:`contfric.compiled`) is optimised, as a whole.

It is a compiler pipeline of its own (numba's manual, "Customizing the compiler") with a code library that
leaves these steps out. The library is not a public class of numba: where it does not have what is
overridden here, helpers are compiled in numba's own way, with the same result.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import AnnotateTypes

#: What is overridden, and what it needs: without one of them numba has changed.
_NEEDED = (
    *("_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals"),
    *("get_pointer_to_function", "codegen"),
)


class _NoMachineCode:
    """Takes the environment that machine code would ask for, and has none."""

    def set_env(self, name: str, environment: Any) -> None:
        """Keep nothing."""


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code of a helper, to be linked into that of its callers, and nothing else."""

    def _optimize_final_module(self) -> None:
        """Leave that to the kernel."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: there is no machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        """What would run the machine code."""
        return _NoMachineCode()


@register_pass(mutates_CFG=False, analysis_only=True)
class _AsPart(LoweringPass):  # type: ignore[misc]
    """Give the function the library that its code goes to."""

    _name = "contfric_as_part"

    def __init__(self) -> None:
        """Numba's passes have no state, and say so by themselves."""
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Create the library, as lowering itself would do it."""
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return False


class _PartCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's pipeline, with a library of ours."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_AsPart, AnnotateTypes)
        passes.finalize()
        return [passes]


def part_options() -> dict[str, Any]:
    """Return the options of ``numba.njit`` for a helper."""
    known = all(hasattr(JITCodeLibrary, name) for name in _NEEDED)
    return {"pipeline_class": _PartCompiler} if known else {}
