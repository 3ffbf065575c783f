"""Signatures: notation, files, the transition graph and edits.

Importing this package is cheap: what needs YAML or pydantic is imported when it is first used,
and networkx when the graph is built.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from contfric.signature.edits import double, is_closed_walk, swap_stop, swap_stops
from contfric.signature.graph import crossing, successors, transition_graph
from contfric.signature.library import signature_names, signature_path
from contfric.signature.notation import Signature, parse_signature
from contfric.signature.reduced import (
    NEVER,
    ReducedPair,
    ReducedSegment,
    ReducedWord,
    canonical_word,
    mirror_pair,
    mirror_word,
    reduce_signature,
    reduced_word,
)

if TYPE_CHECKING:
    from contfric.signature.schema import SignatureFile, SignatureLike, load_signature

__all__ = [
    "NEVER",
    "ReducedPair",
    "ReducedSegment",
    "ReducedWord",
    "Signature",
    "SignatureFile",
    "SignatureLike",
    "canonical_word",
    "crossing",
    "double",
    "is_closed_walk",
    "load_signature",
    "mirror_pair",
    "mirror_word",
    "parse_signature",
    "reduce_signature",
    "reduced_word",
    "signature_names",
    "signature_path",
    "successors",
    "swap_stop",
    "swap_stops",
    "transition_graph",
]

_NEED_PYDANTIC = ("SignatureFile", "SignatureLike", "load_signature")


def __getattr__(name: str) -> Any:
    if name in _NEED_PYDANTIC:
        return getattr(import_module("contfric.signature.schema"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
