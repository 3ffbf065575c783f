"""What machine code depends on in addition to its sources: Python, numba, llvmlite and the processor.

Code that a user's machine compiles is for its processor. Code that comes with a wheel runs on other
machines too. It is compiled for a *baseline*, and used wherever all features of that are there: the engine
computes with few numbers at a time, and wider instructions give it nothing. Measured on a processor with
AVX-512, branches and diagrams take the same time within the noise, to the same bits (docs/guide.md has the
figures). With an exact match instead, a wheel would fit the machine that it was built on.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from dataclasses import asdict, dataclass
from functools import cache

import llvmlite
import numba
from llvmlite import binding
from numba.core import config
from numba.core.codegen import get_host_cpu_features


@dataclass(frozen=True)
class Target:
    """What code is compiled by and for."""

    python: str
    numba: str
    llvmlite: str
    platform: str
    processor: str
    features: str

    @property
    def digest(self) -> str:
        """A short name of it, for files."""
        return hashlib.sha256(repr(sorted(asdict(self).items())).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Baseline:
    """A processor that code is compiled for, and the features that a machine must have to run it."""

    processor: str
    features: frozenset[str]


#: What x86-64-v3 is: AVX2, FMA, BMI and what came before.
_V3 = """avx avx2 bmi bmi2 cmov cx16 cx8 f16c fma fxsr lzcnt mmx movbe popcnt sahf sse sse2 sse3
sse4.1 sse4.2 ssse3 xsave"""
#: By the name of the machine, as Python has it.
BASELINES = {
    "x86_64": Baseline("x86-64-v3", frozenset(_V3.split())),
    "aarch64": Baseline("generic", frozenset()),
}
_SAME_MACHINE = {"amd64": "x86_64", "arm64": "aarch64"}


def baseline() -> Baseline | None:
    """Return the baseline of this kind of machine, or None."""
    machine = platform.machine().lower()
    return BASELINES.get(_SAME_MACHINE.get(machine, machine))


def target() -> Target:
    """Return what code is compiled for: this machine, or what numba was told."""
    return _target(config.CPU_NAME, config.CPU_FEATURES, config.ENABLE_AVX)


@cache
def _target(processor: str | None, features: str | None, _avx: int) -> Target:
    return _made_for(
        processor or binding.get_host_cpu_name(),
        get_host_cpu_features() if features is None else features,
    )


def shipped_target() -> Target | None:
    """Return the target of kernels that come with a wheel; None where this machine cannot run them.

    Nor are they used where numba was told of another processor: somebody wants to have code for that.
    """
    return _shipped_target(config.CPU_NAME, config.CPU_FEATURES, config.ENABLE_AVX)


@cache
def _shipped_target(processor: str | None, features: str | None, _avx: int) -> Target | None:
    base = baseline()
    if base is None or processor is not None or features is not None:
        return None
    here = {text[1:] for text in get_host_cpu_features().split(",") if text.startswith("+")}
    return _made_for(base.processor, "") if base.features <= here else None


def _made_for(processor: str, features: str) -> Target:
    return Target(
        sys.implementation.cache_tag,
        numba.__version__,
        llvmlite.__version__,
        binding.get_process_triple(),
        processor,
        features,
    )


def environment_of(base: Baseline) -> dict[str, str]:
    """Return the environment of a process that compiles for a baseline."""
    told = {"NUMBA_CPU_NAME": base.processor, "NUMBA_CPU_FEATURES": ""}
    # Intel's vector functions are on few machines
    return {**os.environ, **told, "NUMBA_DISABLE_INTEL_SVML": "1"}
