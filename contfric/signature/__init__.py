"""Signatures: notation, files, the transition graph and edits.

Importing this package is cheap: what needs YAML or pydantic is imported when it is first used,
and networkx when the graph is built.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.base.lazy import lazily
from contfric.signature.edits import double, swap_stops
from contfric.signature.graph import crossing, successors, transition_graph
from contfric.signature.library import signature_names, signature_path
from contfric.signature.notation import Signature, parse_signature
from contfric.signature.reduced import (
    NEVER,
    ReducedItinerary,
    ReducedPair,
    ReducedSegment,
    canonical_itinerary,
    mirror_itinerary,
    mirror_pair,
    reduce_signature,
    reduced_itinerary,
)
from contfric.signature.walks import is_closed_walk

if TYPE_CHECKING:
    from contfric.signature.schema import SignatureFile as SignatureFile
    from contfric.signature.schema import SignatureLike as SignatureLike
    from contfric.signature.schema import load_signature as load_signature

__all__ = [
    "NEVER",
    "ReducedItinerary",
    "ReducedPair",
    "ReducedSegment",
    "Signature",
    "SignatureFile",
    "SignatureLike",
    "canonical_itinerary",
    "crossing",
    "double",
    "is_closed_walk",
    "load_signature",
    "mirror_itinerary",
    "mirror_pair",
    "parse_signature",
    "reduce_signature",
    "reduced_itinerary",
    "signature_names",
    "signature_path",
    "successors",
    "swap_stops",
    "transition_graph",
]

__getattr__ = lazily(__name__)[1]
