"""Compiled functions (kernels): their files on disk, the processor they are for, messages, inlining."""
