"""An independent checker of certificate files: it shares no code with the engine or the prover."""
