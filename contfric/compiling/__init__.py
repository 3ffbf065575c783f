"""Behind compiled code: its files on disk, what it was compiled for, how it is announced and inlined."""
