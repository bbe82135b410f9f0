"""Motion models that ship with tussle, a folder each."""
