"""Events of a branch as objects of their own: kinds, what happens there, what can follow, candidates."""
