"""Controllers that ship with tussle, a folder each."""
